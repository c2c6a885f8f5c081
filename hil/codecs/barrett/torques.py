"""Torque commands: four motors in one frame, 14 bits each, most significant first.

Byte 0 is the value form of the property T; the other 56 bits are `t0 << 42 | t1 << 28 | t2 << 14 | t3`, two's complement.
"""

import math
from collections.abc import Sequence
from struct import Struct
from typing import Final

from hil.errors import FrameError, ValueRangeError
from hil.record import is_finite

SLOTS: Final = 4
# The controllers take -8191 to 8191; -8192 is never sent.
MOST: Final = 8191
TORQUE_PROPERTY: Final = 42
_MOST: Final = 8191.0
_MASK: Final = 0x3FFF
_SIGN: Final = 0x2000
_WORD: Final = Struct(">Q")


def saturated(torques: Sequence[float]) -> list[int]:
    """Torques in a controller's units as whole numbers: cut to +-8191, then rounded down.

    Raises:
        ValueRangeError: if a torque is not finite.

    Example:
        >>> saturated([9000, -9000, -0.5, 0.5])
        [8191, -8191, -1, 0]
    """
    units = list[int]()
    for torque in torques:
        if not is_finite(torque):
            raise ValueRangeError(f"torque of slot {len(units)} is {torque}; a finite number was expected")
        units.append(math.floor(_MOST if torque > _MOST else -_MOST if torque < -_MOST else torque))
    return units


def pack_torques(torques: Sequence[int], property: int = TORQUE_PROPERTY) -> bytes:
    """Data (8 bytes) of a torque frame for up to four motors; missing ones are 0.

    Raises:
        ValueRangeError: if there are more than four, or one does not fit; nothing is cut here.

    Example:
        >>> pack_torques([1, 2, 3, 4]).hex(" ").upper()
        'AA 00 04 00 20 00 C0 04'
    """
    if len(torques) > SLOTS:
        raise ValueRangeError(f"{len(torques)} torques do not fit in a frame, which has {SLOTS} slots")
    word = 0
    for slot, torque in enumerate(torques):
        if not -MOST <= torque <= MOST:
            raise ValueRangeError(f"torque of slot {slot} is {torque}, outside [{-MOST}, {MOST}]")
        word = word << 14 | torque & _MASK
    # The first byte last: without it the word is a machine's integer.
    return _WORD.pack((0x80 | property) << 56 | word << 14 * (SLOTS - len(torques)))


def unpack_torques(data: bytes, property: int = TORQUE_PROPERTY) -> tuple[int, int, int, int]:
    """The four torques of a frame's data.

    Raises:
        FrameError: if the data are no torque frame.
    """
    if len(data) != 8 or data[0] != 0x80 | property:
        raise FrameError(f"{data.hex(' ') or 'no data'} is no torque frame: 8 bytes, the first {0x80 | property:#x}")
    (word,) = _WORD.unpack(data)
    return (
        (word >> 42 & _MASK ^ _SIGN) - _SIGN,
        (word >> 28 & _MASK ^ _SIGN) - _SIGN,
        (word >> 14 & _MASK ^ _SIGN) - _SIGN,
        (word & _MASK ^ _SIGN) - _SIGN,
    )

"""Readings of the force/torque sensor: three 16-bit numbers, little-endian, and sometimes a status byte."""

from collections.abc import Sequence
from struct import Struct
from typing import Final, NamedTuple

from hil.codecs.barrett.identifiers import Group
from hil.errors import FrameError, ValueRangeError

# Counts per N, per N.m, and per m/s2 (the unit of acceleration is the one the library's header names).
DIVISORS = {Group.FORCE: 256.0, Group.TORQUE: 4096.0, Group.ACCELERATION: 1024.0}
UNITS = {Group.FORCE: "N", Group.TORQUE: "N.m", Group.ACCELERATION: "m/s2"}
_THREE = Struct("<hhh")
_LOWEST, _HIGHEST = -(1 << 15), (1 << 15) - 1
# Bits of the status byte that say which strain gauges are saturated.
GAUGES: Final = 0x3F


class Status(NamedTuple):
    """The seventh byte: present only if a strain gauge saturated since the last tare."""

    tare_suggested: bool
    bad_data: bool
    saturated_gauges: tuple[int, ...]


class Reading(NamedTuple):
    """x, y, z in N, N.m or m/s2, and the status if it was sent."""

    x: float
    y: float
    z: float
    status: Status | None = None


def pack_reading(group: Group, values: Sequence[float], status: Status | None = None) -> bytes:
    """Data (6 bytes, 7 with a status) of a reading; `group` tells whether it is a force, torque or acceleration.

    Args:
        group: what is read.
        values: three, in N, N.m or m/s2.
        status: of the sensor, if it is sent along.

    Raises:
        ValueRangeError: if a value is outside what the sensor can say, or not finite.

    Example:
        >>> pack_reading(Group.FORCE, (1.0, -2.5, 10.25)).hex(" ").upper()
        '00 01 80 FD 40 0A'
    """
    divisor, unit = DIVISORS[group], UNITS[group]
    counts = []
    for axis, value in zip("xyz", values, strict=True):
        if not _LOWEST <= value * divisor < _HIGHEST + 0.5:  # false for NaN too
            raise ValueRangeError(
                f"{group.name.lower()} {axis} = {value:g} {unit} is outside [{_LOWEST / divisor:g}, {_HIGHEST / divisor:g}] {unit}"
            )
        counts.append(round(value * divisor))
    return _THREE.pack(*counts) + (b"" if status is None else bytes([_pack_status(status)]))


def unpack_reading(group: Group, data: bytes) -> Reading:
    """The reading of a frame's data.

    Raises:
        FrameError: if the data have neither 6 nor 7 bytes.
    """
    (x, y, z), status = unpack_counts(data)
    divisor = DIVISORS[group]
    return Reading(x / divisor, y / divisor, z / divisor, _unpack_status(status) if len(data) == 7 else None)


def unpack_counts(data: bytes) -> tuple[tuple[int, int, int], int]:
    """The three numbers of a reading's data in counts, and its status byte, 0 if there is none.

    Raises:
        FrameError: if the data have neither 6 nor 7 bytes.

    Example:
        >>> unpack_counts(bytes.fromhex("000180FD400A"))
        ((256, -640, 2624), 0)
    """
    if len(data) not in (6, 7):
        raise FrameError(f"{data.hex(' ') or 'no data'} is no reading: 6 or 7 bytes were expected")
    return (_signed(data[0], data[1]), _signed(data[2], data[3]), _signed(data[4], data[5])), data[6] if len(
        data
    ) == 7 else 0


def _signed(low: int, high: int) -> int:
    return ((high << 8 | low) ^ 0x8000) - 0x8000


def _pack_status(status: Status) -> int:
    gauges = 0
    for gauge in status.saturated_gauges:
        if not 0 <= gauge < 6:
            raise ValueRangeError(f"strain gauge {gauge} is outside [0, 5]")
        gauges |= 1 << gauge
    return status.tare_suggested << 7 | status.bad_data << 6 | gauges


def _unpack_status(byte: int) -> Status:
    return Status(bool(byte & 0x80), bool(byte & 0x40), tuple(g for g in range(6) if byte >> g & 1))

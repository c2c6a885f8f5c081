"""Positions of motors and joints: 22 bits, two's complement, most significant byte first."""

from typing import Final, NamedTuple

from hil.errors import FrameError, ValueRangeError

LOWEST, HIGHEST = -(1 << 21), (1 << 21) - 1
_MASK: Final = 0x3FFFFF
_SIGN: Final = 0x200000


class Positions(NamedTuple):
    """Counts of the motor's encoder, and of the joint's if there is one."""

    motor: int
    joint: int | None = None


def pack_positions(motor: int, joint: int | None = None) -> bytes:
    """Data (3 bytes, or 6 with a joint encoder) of a position.

    Raises:
        ValueRangeError: if counts do not fit.

    Example:
        >>> pack_positions(1427, 10430).hex(" ").upper()
        '00 05 93 00 28 BE'
    """
    return _three_bytes("motor", motor) + (b"" if joint is None else _three_bytes("joint", joint))


def unpack_positions(data: bytes) -> Positions:
    """Counts of a position's data; the two unused bits of each are ignored.

    Raises:
        FrameError: if the data have neither 3 nor 6 bytes.

    Example:
        >>> unpack_positions(bytes.fromhex("3FFC18")).motor
        -1000
    """
    if len(data) == 3:
        return Positions((int.from_bytes(data, "big") & _MASK ^ _SIGN) - _SIGN)
    if len(data) == 6:
        both = int.from_bytes(data, "big")
        return Positions((both >> 24 & _MASK ^ _SIGN) - _SIGN, (both & _MASK ^ _SIGN) - _SIGN)
    raise FrameError(f"{data.hex(' ') or 'no data'} is no position: 3 bytes, or 6 with a joint encoder, were expected")


def motor_counts(data: bytes) -> int:
    """Counts of the motor's encoder alone, for loops: without the tuple it takes a third of the time.

    Raises:
        FrameError: if the data have neither 3 nor 6 bytes.

    Example:
        >>> motor_counts(bytes.fromhex("3FFC18"))
        -1000
    """
    if len(data) == 3:
        return ((data[0] << 16 | data[1] << 8 | data[2]) & _MASK ^ _SIGN) - _SIGN
    return unpack_positions(data).motor


def nearest_turn(counts: int, previous: int) -> int:
    """Undo the wrap of 22 bits: the number congruent to `counts` that is nearest to the `previous` unwrapped one.

    Example:
        >>> nearest_turn(-2097152, 2097151)
        2097152
    """
    return previous + ((counts - previous & _MASK ^ _SIGN) - _SIGN)


def _three_bytes(words: str, counts: int) -> bytes:
    if not LOWEST <= counts <= HIGHEST:
        raise ValueRangeError(f"{words} position {counts} counts is outside [{LOWEST}, {HIGHEST}] counts")
    return (counts & _MASK).to_bytes(3, "big")

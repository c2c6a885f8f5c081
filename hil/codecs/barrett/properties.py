"""Messages about a property of a node: ask for it, set it, answer with it.

A request is one byte, the property. A value is `[property | 0x80][0][value, little-endian]`, of 16 or 32 bits; setting a
property and answering with it look alike, only the identifiers differ.
"""

from typing import NamedTuple

from hil.errors import FrameError, ValueRangeError

_VALUE_FLAG = 0x80
LAST_PROPERTY = 0x7F


class PropertyValue(NamedTuple):
    """A property's number and its signed value."""

    property: int
    value: int


def encode_request(property: int) -> bytes:
    """Data that ask for a property, in 1 byte.

    Raises:
        ValueRangeError: if the property has no 7 bits.
    """
    return bytes([_checked(property)])


def decode_request(data: bytes) -> int:
    """The property that data ask for.

    Raises:
        FrameError: if the data are no request.
    """
    if len(data) != 1 or data[0] & _VALUE_FLAG:
        raise FrameError(f"{data.hex(' ') or 'no data'} asks for no property: one byte below 0x80 was expected")
    return data[0]


def encode_value(property: int, value: int, size: int = 4) -> bytes:
    """Data that set a property, or answer with it.

    Args:
        size: bytes of the value; a host always sends 4, a node answers with 2 or 4.

    Raises:
        ValueRangeError: if property or value do not fit.

    Example:
        >>> encode_value(5, 2).hex(" ")
        '85 00 02 00 00 00'
    """
    number = _checked(property)
    if size not in (2, 4):
        raise ValueRangeError(f"the value of property {number} has {size} bytes; 2 or 4 can be sent")
    try:
        return bytes([number | _VALUE_FLAG, 0]) + value.to_bytes(size, "little", signed=True)
    except OverflowError as error:
        limit = 1 << (8 * size - 1)
        raise ValueRangeError(
            f"property {number} = {value} is outside [{-limit}, {limit - 1}], what {size} bytes hold"
        ) from error


def decode_value(data: bytes, expected: int | None = None) -> PropertyValue:
    """Property and value of data that set it or answer with it.

    Args:
        expected: the property that was asked for, if any.

    Raises:
        FrameError: if the data are no value, or that of another property.

    Example:
        >>> decode_value(bytes.fromhex("8900FBFF"))
        PropertyValue(property=9, value=-5)
    """
    if len(data) not in (4, 6) or not data[0] & _VALUE_FLAG or data[1] != 0:
        raise FrameError(
            f"{data.hex(' ') or 'no data'} holds no property: 4 or 6 bytes, the first above 0x7f, the second 0"
        )
    number = data[0] & LAST_PROPERTY
    if expected is not None and number != expected:
        raise FrameError(f"property {number} arrived where {expected} was asked for; a late answer?")
    return PropertyValue(number, int.from_bytes(data[2:], "little", signed=True))


def _checked(property: int) -> int:
    if not 0 <= property <= LAST_PROPERTY:
        raise ValueRangeError(f"property {property} is outside [0, {LAST_PROPERTY}]")
    return property

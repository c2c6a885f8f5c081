"""Bytes of the operations of FMI-LS-BUS 1.0, which stand one after the other in the value of a binary variable.

Each begins with its code and the length of all of it, four bytes each; numbers are little-endian, truth values 0 or 1.
Operations of CAN FD and CAN XL are named and not spoken here.
"""

import struct
from enum import IntEnum

from hil.codecs.frame import LAST_IDENTIFIER, MOST_BYTES, Frame
from hil.codecs.ls_bus.operations import (
    ArbitrationLost,
    BusFailure,
    Confirm,
    ErrorCode,
    FormatError,
    NodeState,
    Operation,
    Rate,
    SetArbitration,
    SetRate,
    Status,
    Transmit,
    Wakeup,
)
from hil.errors import FrameError

# What binary variables with such operations say they hold.
MIME_TYPE = 'application/org.fmi-standard.fmi-ls-bus.can; version="1.0.0"'
LAST_EXTENDED = 2**29 - 1


class Code(IntEnum):
    """Which operation it is."""

    FORMAT_ERROR = 0x01
    TRANSMIT = 0x10
    FD_TRANSMIT = 0x11
    XL_TRANSMIT = 0x12
    CONFIRM = 0x20
    ARBITRATION_LOST = 0x30
    BUS_ERROR = 0x31
    CONFIGURATION = 0x40
    STATUS = 0x41
    WAKEUP = 0x42


_HEAD, _FRAME, _ERROR = struct.Struct("<II"), struct.Struct("<IBBH"), struct.Struct("<IBBB")
# The kind of setting beside bit rates, and its values; those of the flag that says who noticed an error.
_ARBITRATION, _KEEP, _DROP = 4, 1, 2
_FIRST, _AFTER_OTHERS = 1, 2


def encode(operation: Operation) -> bytes:
    """Bytes of an operation.

    Raises:
        FrameError: if it holds what it cannot, such as nine bytes of data.

    Example:
        >>> encode(Confirm(0x401)).hex(" ")
        '20 00 00 00 0c 00 00 00 01 04 00 00'
    """
    try:
        code, arguments = _written(operation)
    except (struct.error, ValueError) as error:
        raise FrameError(f"{operation} cannot be written as an operation of FMI-LS-BUS: {error}") from error
    data = _HEAD.pack(code, _HEAD.size + len(arguments)) + arguments
    if type(operation) is not FormatError:
        decode(data)
    return data


def split(data: bytes) -> list[bytes]:
    """The operations in a variable's value, none of them read yet.

    Raises:
        FrameError: if a length leads nowhere; what follows cannot be told apart then.
    """
    found, at = [], 0
    while at < len(data):
        size = _HEAD.unpack_from(data, at)[1] if len(data) - at >= _HEAD.size else 0
        if not _HEAD.size <= size <= len(data) - at:
            left = f"{len(data) - at} bytes are left"
            raise FrameError(
                f"FMI-LS-BUS: the operation at byte {at} says it has {size} bytes, and {left}; 8 at least were expected"
            )
        found.append(data[at : at + size])
        at += size
    return found


def decode(data: bytes) -> Operation:
    """One operation; a receiver answers what cannot be read by `FormatError` with these bytes.

    Raises:
        FrameError: if it is none.
    """
    if len(data) < _HEAD.size or _HEAD.unpack_from(data)[1] != len(data):
        raise FrameError(f"FMI-LS-BUS: {data.hex(' ') or 'nothing'} is no operation: code and own length were expected")
    code, arguments = _HEAD.unpack_from(data)[0], data[_HEAD.size :]
    try:
        return _read(code, arguments)
    except (struct.error, ValueError) as error:
        raise FrameError(
            f"FMI-LS-BUS: operation {code:#04x} cannot be read: {error}; it was {data.hex(' ')}"
        ) from error


def frame_of(operation: Operation) -> Frame | None:
    """The standard data frame that an operation sends; None for others."""
    if type(operation) is not Transmit or operation.extended or operation.remote:
        return None
    return Frame(operation.identifier, operation.data)


def _written(operation: Operation) -> tuple[int, bytes]:
    match operation:
        case FormatError(data):
            return Code.FORMAT_ERROR, struct.pack("<H", len(data)) + data
        case Transmit(identifier, data, extended, remote):
            return Code.TRANSMIT, _FRAME.pack(identifier, extended, remote, len(data)) + data
        case Confirm(identifier):
            return Code.CONFIRM, struct.pack("<I", identifier)
        case ArbitrationLost(identifier):
            return Code.ARBITRATION_LOST, struct.pack("<I", identifier)
        case BusFailure(identifier, error, first, sender):
            return Code.BUS_ERROR, _ERROR.pack(identifier, error, _FIRST if first else _AFTER_OTHERS, sender)
        case SetRate(rate, bits_per_s):
            return Code.CONFIGURATION, struct.pack("<BI", rate, bits_per_s)
        case SetArbitration(drop):
            return Code.CONFIGURATION, bytes([_ARBITRATION, _DROP if drop else _KEEP])
        case Status(state):
            return Code.STATUS, bytes([state])
        case Wakeup():
            return Code.WAKEUP, b""


def _read(code: int, arguments: bytes) -> Operation:
    match code:
        case Code.FORMAT_ERROR:
            (size,) = struct.unpack_from("<H", arguments)
            return FormatError(_of_length(arguments[2:], size))
        case Code.TRANSMIT:
            return _transmit(arguments)
        case Code.CONFIRM:
            return Confirm(_identifier(*struct.unpack("<I", arguments)))
        case Code.ARBITRATION_LOST:
            return ArbitrationLost(_identifier(*struct.unpack("<I", arguments)))
        case Code.BUS_ERROR:
            identifier, error, first, sender = _ERROR.unpack(arguments)
            which = _one_of(first, {_FIRST: True, _AFTER_OTHERS: False}, "error flag")
            return BusFailure(_identifier(identifier), ErrorCode(error), which, _truth(sender))
        case Code.CONFIGURATION:
            return _setting(arguments)
        case Code.STATUS:
            return Status(NodeState(*struct.unpack("<B", arguments)))
        case Code.WAKEUP:
            _of_length(arguments, 0)
            return Wakeup()
        case Code.FD_TRANSMIT | Code.XL_TRANSMIT:
            raise ValueError("CAN FD and CAN XL are not spoken here")
    raise ValueError("there is no such operation")


def _transmit(arguments: bytes) -> Transmit:
    identifier, extended, remote, size = _FRAME.unpack_from(arguments)
    data = _of_length(arguments[_FRAME.size :], size)
    found = Transmit(_identifier(identifier), data, _truth(extended), _truth(remote))
    if not found.extended and identifier > LAST_IDENTIFIER:
        raise ValueError(f"identifier {identifier:#x} needs more than the 11 bits of a standard frame")
    if size > (0 if found.remote else MOST_BYTES):
        raise ValueError(f"{size} bytes of data; up to {0 if found.remote else MOST_BYTES} were expected")
    return found


def _setting(arguments: bytes) -> SetRate | SetArbitration:
    if arguments[:1] == bytes([_ARBITRATION]):
        (drop,) = struct.unpack("<xB", arguments)
        return SetArbitration(_one_of(drop, {_DROP: True, _KEEP: False}, "behaviour"))
    rate, bits_per_s = struct.unpack("<BI", arguments)
    return SetRate(Rate(rate), bits_per_s)


def _of_length(data: bytes, size: int) -> bytes:
    if len(data) != size:
        raise ValueError(f"{size} bytes of data are announced, and {len(data)} there")
    return data


def _identifier(value: int) -> int:
    if value > LAST_EXTENDED:
        raise ValueError(f"identifier {value:#x} needs more than 29 bits")
    return value


def _truth(value: int) -> bool:
    return _one_of(value, {0: False, 1: True}, "truth value")


def _one_of(value: int, known: dict[int, bool], what: str) -> bool:
    if value not in known:
        raise ValueError(f"{value} is no {what}; {' or '.join(map(str, sorted(known)))} was expected")
    return known[value]

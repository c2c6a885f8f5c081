"""What is said on a CAN bus between tools: the operations of FMI-LS-BUS 1.0."""

from enum import IntEnum
from typing import NamedTuple


class ErrorCode(IntEnum):
    """What went wrong on a simulated bus."""

    BIT = 1
    STUFFING = 2
    FORM = 3
    CHECKSUM = 4
    ACKNOWLEDGEMENT = 5
    BROKEN_ERROR_FRAME = 6


class NodeState(IntEnum):
    """How a node is to its bus."""

    ACTIVE = 1
    PASSIVE = 2
    BUS_OFF = 3


class Rate(IntEnum):
    """Whose bit rate is set."""

    CAN = 1
    CAN_FD = 2
    CAN_XL = 3


class FormatError(NamedTuple):
    """An operation came that could not be read; these are its bytes."""

    data: bytes


class Transmit(NamedTuple):
    """A frame is to be sent, or has come; a remote one has no data."""

    identifier: int
    data: bytes
    extended: bool = False
    remote: bool = False


class Confirm(NamedTuple):
    """A frame was sent and acknowledged."""

    identifier: int


class ArbitrationLost(NamedTuple):
    """A frame had to give way to another one and was dropped."""

    identifier: int


class BusFailure(NamedTuple):
    """An error on the bus (operation `Bus Error`): `first` for the node that noticed it, `sender` for that whose frame it was."""

    identifier: int
    code: ErrorCode
    first: bool
    sender: bool


class SetRate(NamedTuple):
    """The bus is to have this bit rate (operation `Configuration`)."""

    rate: Rate
    bits_per_s: int


class SetArbitration(NamedTuple):
    """Frames that have to wait are to be dropped with `ArbitrationLost`, or else kept (operation `Configuration`)."""

    drop: bool


class Status(NamedTuple):
    """How a node is to its bus now."""

    state: NodeState


class Wakeup(NamedTuple):
    """All nodes that sleep wake up."""


Operation = FormatError | Transmit | Confirm | ArbitrationLost | BusFailure | SetRate | SetArbitration | Status | Wakeup

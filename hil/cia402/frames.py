"""Frames of a cycle with CiA 402 drives: SYNC asks, each drive answers its status and position, and takes a command of
its own."""

from struct import Struct
from typing import NamedTuple

from canopen.profiles.p402 import State402

from hil.codecs.frame import Frame
from hil.errors import FrameError

NETWORK, SYNC = 0x000, 0x080
_EMERGENCY, _STATUS, _COMMAND, _REQUEST = 0x080, 0x180, 0x200, 0x600
LAST_NODE = 127
# Controlword and target torque; statusword, position in counts, torque. Torques are thousandths of the rated one.
_COMMANDED, _SAID = Struct("<Hh"), Struct("<Hih")
PERMILLE = 1000.0
MOST_PERMILLE = 32767
# Error codes of a drive whose commands stay away, and of one that is too hot.
EMERGENCY_WATCHDOG, EMERGENCY_HEAT = 0x8250, 0x4310

OFF, SHUTDOWN, SWITCH_ON, ENABLE = (
    State402.CW_DISABLE_VOLTAGE,
    State402.CW_SHUTDOWN,
    State402.CW_SWITCH_ON,
    State402.CW_OPERATION_ENABLED,
)
ENABLED, FAULTS = "OPERATION ENABLED", ("FAULT", "FAULT REACTION ACTIVE")
# From each state one step nearer to where torque acts.
_NEARER = {"SWITCH ON DISABLED": SHUTDOWN, "READY TO SWITCH ON": SWITCH_ON, "SWITCHED ON": ENABLE, ENABLED: ENABLE}


class Status(NamedTuple):
    """What a drive says in each cycle: its state by name, its position in counts, its torque in thousandths of the
    rated one."""

    state: str
    position: int
    torque: int
    word: int


def status_of(node: int) -> int:
    """Identifier on which a drive says its status."""
    return _STATUS + node


def command_of(node: int) -> int:
    """Identifier of a drive's commands."""
    return _COMMAND + node


def emergency_of(node: int) -> int:
    """Identifier on which a drive says what went wrong."""
    return _EMERGENCY + node


def is_hosts(identifier: int) -> bool:
    """Whether a frame comes from a host: network management, SYNC, commands and questions."""
    from_host = (range(_COMMAND + 1, _COMMAND + LAST_NODE + 1), range(_REQUEST + 1, _REQUEST + LAST_NODE + 1))
    return identifier in (NETWORK, SYNC) or any(identifier in numbers for numbers in from_host)


def state_of(word: int) -> str:
    """The state of a statusword.

    Example:
        >>> state_of(0x1637)
        'OPERATION ENABLED'
    """
    for name, (mask, bits) in State402.SW_MASK.items():
        if word & mask == bits:
            return str(name)
    return f"no known state (statusword {word:#06x})"


def pack_command(node: int, controlword: int, permille: int = 0) -> Frame:
    """A drive's command.

    Example:
    Args:
        node: number of the drive.
        controlword: as CiA 402 has it.
        permille: torque, in thousandths of the rated one.

        >>> str(pack_command(2, ENABLE, -250))
        '202#0F0006FF'
    """
    return Frame(command_of(node), _COMMANDED.pack(controlword, permille))


def unpack_command(frame: Frame) -> tuple[int, int]:
    """Controlword and thousandths of the rated torque.

    Raises:
        FrameError: if these are no four bytes.
    """
    if len(frame.data) != _COMMANDED.size:
        raise FrameError(f"{frame} is no command of a drive: {_COMMANDED.size} bytes were expected")
    word, permille = _COMMANDED.unpack(frame.data)
    return int(word), int(permille)


def unpack_status(data: bytes) -> Status:
    """What a drive says.

    Raises:
        FrameError: if these are no eight bytes.
    """
    if len(data) != _SAID.size:
        raise FrameError(f"{data.hex(' ') or 'no data'} is no status of a drive: {_SAID.size} bytes were expected")
    word, position, torque = _SAID.unpack(data)
    return Status(state_of(word), position, torque, word)


def nearer(state: str) -> int:
    """The controlword that brings a drive one step nearer to where torque acts; from a fault none does."""
    return _NEARER.get(state, OFF)

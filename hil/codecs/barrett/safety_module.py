"""What the safety module says and takes: its mode and the pendant."""

from enum import IntEnum
from typing import NamedTuple

from hil.errors import FrameError, ValueRangeError


class Mode(IntEnum):
    """State of the whole arm; only the buttons of the pendant lead upwards."""

    ESTOP = 0
    IDLE = 1
    ACTIVE = 2


class Button(IntEnum):
    """The pressed button of the pendant."""

    ESTOP = 0
    ACTIVATE = 1
    IDLE = 2
    NONE = 3


class Level(IntEnum):
    """How far a watched quantity is; on the bus one bit each."""

    SAFE = 1
    WARNING = 2
    FAULT = 4


class Pendant(NamedTuple):
    """The pendant's state: lights, the pattern of its seven-segment display, and five watched quantities."""

    button: Button
    activate_light: bool
    idle_light: bool
    display: int
    other: Level
    heartbeat: Level
    voltage: Level
    torque: Level
    velocity: Level


_LEVELS = {"other": 12, "heartbeat": 9, "voltage": 6, "torque": 3, "velocity": 0}


def decode_mode(value: int) -> Mode:
    """The mode of a value of the property MODE.

    Raises:
        FrameError: if it is none of the three.
    """
    try:
        return Mode(value)
    except ValueError:
        raise FrameError(
            f"MODE {value} of the safety module; 0 (e-stop), 1 (idle) or 2 (active) was expected"
        ) from None


def decode_pendant(value: int) -> Pendant:
    """The pendant's state in a value of the property PEN.

    Raises:
        FrameError: if a watched quantity is not exactly one of safe, warning, fault.

    Example:
        >>> decode_pendant(0x0D3F1249).heartbeat.name
        'SAFE'
    """
    levels = {}
    for name, shift in _LEVELS.items():
        bits = value >> shift & 0b111
        try:
            levels[name] = Level(bits)
        except ValueError:
            raise FrameError(
                f"pendant state {value & 0xFFFFFFFF:#010x}: {name} is {bits:03b}, not one of 001, 010, 100"
            ) from None
    return Pendant(
        Button(value >> 26 & 0b11), bool(value >> 25 & 1), bool(value >> 24 & 1), value >> 16 & 0xFF, **levels
    )


def quantities(pendant: Pendant, level: Level) -> str:
    """The watched quantities that are at a level, "" if none is.

    Example:
        >>> quantities(decode_pendant(0x0D3F124A), Level.WARNING)
        'velocity'
    """
    return " and ".join([name for name in _LEVELS if getattr(pendant, name) is level])


def encode_pendant(pendant: Pendant) -> int:
    """Value of the property PEN, as a signed 32-bit number; unused bits are 0.

    Raises:
        ValueRangeError: if the display's pattern has no 8 bits.
    """
    if not 0 <= pendant.display <= 0xFF:
        raise ValueRangeError(f"display pattern {pendant.display} is outside [0, 255]")
    value = pendant.button << 26 | pendant.activate_light << 25 | pendant.idle_light << 24 | pendant.display << 16
    for name, shift in _LEVELS.items():
        value |= getattr(pendant, name) << shift
    return value

"""Frames of any robot by a database of its messages (DBC, KCD, ARXML, SYM), through cantools: pure functions, no bus."""

import math
from collections.abc import Mapping
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from fmus.errors import MisfitError
from hil.codecs.barrett.database import ROBOTS, dbc_of
from hil.codecs.frame import Frame
from hil.errors import FrameError, ValueRangeError

if TYPE_CHECKING:
    from cantools.database.can import Message

# A database that is shipped as a file, beside those of Barrett's robots: an arm with three joints that are commanded by
# torque.
JOINT_ARM = "joint_arm"


class Decoded(NamedTuple):
    """A frame in words: the name of its message, and its signals in the units of the database."""

    message: str
    signals: dict[str, float]


class Database:
    """Messages by name and by identifier.

    Args:
        source: a file, or `joint_arm`, `proficio`, `wam4`, `wam7` for those that are shipped.

    Raises:
        MisfitError: if it cannot be read, or is no database of CAN messages.
    """

    def __init__(self, source: str | Path) -> None:
        import cantools
        from cantools.database.can import Database as CanDatabase

        path = Path(str(files("hil.codecs") / f"{JOINT_ARM}.dbc")) if str(source) == JOINT_ARM else Path(source)
        try:
            if str(source) in ROBOTS:
                found = cantools.database.load_string(dbc_of(str(source)), "dbc")
            else:
                found = cantools.database.load_file(path)
        except OSError as error:
            raise MisfitError(f"{path} cannot be read: {error.strerror}; name a DBC or KCD file") from error
        except (cantools.Error, ValueError, KeyError) as error:
            reason = " ".join(str(error).split())
            raise MisfitError(
                f"{path} is no database of CAN messages: {reason}; DBC, KCD, ARXML and SYM are read"
            ) from error
        if not isinstance(found, CanDatabase):
            raise MisfitError(f"{path} is a database of diagnostics, not of messages")
        self._by_name: dict[str, Message] = {message.name: message for message in found.messages}
        self._by_identifier = {(message.frame_id, message.is_extended_frame): message for message in found.messages}

    @property
    def messages(self) -> tuple[str, ...]:
        """Names of all messages."""
        return tuple(self._by_name)

    def units(self, message: str) -> dict[str, str]:
        """Units of a message's signals, "1" where there is none."""
        return {signal.name: signal.unit or "1" for signal in self._message(message).signals}

    def encode(self, message: str, signals: Mapping[str, float]) -> Frame:
        """The frame of a message.

        Raises:
            ValueRangeError: if a signal is missing, unknown, no number or beyond its range; nothing is clipped.
        """
        from cantools import Error

        found = self._message(message)
        for signal in found.signals:
            value = signals.get(signal.name)
            if value is None:
                raise ValueRangeError(f"{message} needs {signal.name}; signals are {', '.join(self.units(message))}")
            low = -math.inf if signal.minimum is None else signal.minimum
            high = math.inf if signal.maximum is None else signal.maximum
            if not low <= value <= high:
                unit = f" {signal.unit}" if signal.unit else ""
                raise ValueRangeError(f"{message}: {signal.name} = {value}{unit} is outside [{low:g}, {high:g}]{unit}")
        if unknown := sorted(set(signals) - {signal.name for signal in found.signals}):
            raise ValueRangeError(f"{message} has no signal {unknown[0]}; signals are {', '.join(self.units(message))}")
        try:
            return Frame(found.frame_id, found.encode(dict(signals)))
        except (ValueError, OverflowError, Error) as error:  # a database may allow more than its bits carry
            raise ValueRangeError(f"{message}: {' '.join(str(error).split())}") from error

    def decode(self, frame: Frame, extended: bool = False) -> Decoded:
        """What a frame says.

        Raises:
            FrameError: if its identifier is not in the database, or it is too short.
        """
        from cantools import Error

        found = self._by_identifier.get((frame.identifier, extended))
        if found is None:
            raise FrameError(f"{frame}: no message of the database has this identifier")
        try:
            # What a multiplexer selects may need fewer bytes than the message's longest part.
            signals = found.decode(frame.data, decode_choices=False, allow_truncated=found.is_multiplexed())
        except (ValueError, Error) as error:
            raise FrameError(f"{frame} is no {found.name}: {' '.join(str(error).split())}") from error
        assert isinstance(signals, dict)
        if found.is_multiplexed() and len(signals) < 2:
            raise FrameError(f"{frame} is no {found.name}: it is too short for what it selects")
        return Decoded(found.name, {name: float(value) for name, value in signals.items()})  # type: ignore[arg-type]

    def _message(self, name: str) -> "Message":
        if name not in self._by_name:
            raise MisfitError(f"message {name!r} is not in the database; there are {', '.join(self._by_name)}")
        return self._by_name[name]

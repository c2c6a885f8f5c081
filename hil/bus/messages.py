"""Any bus of python-can, asked for frames."""

import time
from collections.abc import Sequence
from typing import Protocol, runtime_checkable

import can

from hil.bus.error_frames import words_of
from hil.codecs.frame import Frame
from hil.errors import BusError

# Of a bus that `select` cannot wait for.
NO_HANDLE = -1


@runtime_checkable
class Frames(Protocol):
    """What gives and takes frames: buses of our own by themselves, every other one through `Messages`."""

    def next_frame(self, timeout_s: float) -> Frame | None:
        """The next standard data frame; None if none comes in time. Raises `BusError` for an error that is reported."""
        ...

    def send_frames(self, frames: Sequence[Frame]) -> None:
        """Send all of them, without waiting."""
        ...

    def handle(self) -> int:
        """What `select` waits for once `next_frame` has none left; `NO_HANDLE` if there is no such thing."""
        ...


def frames_of(bus: can.BusABC) -> Frames:
    """The way to a bus's frames."""
    return bus if isinstance(bus, Frames) else Messages(bus)


class Messages:
    """Makes frames of a bus's messages, and messages of frames."""

    def __init__(self, bus: can.BusABC) -> None:
        self._bus = bus

    def next_frame(self, timeout_s: float) -> Frame | None:
        """See `Frames`."""
        message = self._bus.recv(timeout_s)
        began = time.monotonic() if message is not None and _passed_over(message) else 0.0
        while message is not None and _passed_over(message):
            message = self._bus.recv(max(began + timeout_s - time.monotonic(), 0.0))
        return None if message is None else Frame(message.arbitration_id, bytes(message.data))

    def send_frames(self, frames: Sequence[Frame]) -> None:
        """See `Frames`."""
        for frame in frames:
            self._bus.send(can.Message(arbitration_id=frame.identifier, data=frame.data, is_extended_id=False))

    def handle(self) -> int:
        """See `Frames`."""
        try:
            return int(self._bus.fileno())
        except NotImplementedError:
            return NO_HANDLE


def _passed_over(message: can.Message) -> bool:
    """Whether a message is of no concern here.

    Raises:
        BusError: if it reports an error.
    """
    if message.is_error_frame:
        raise BusError(f"the adapter reports an error on the bus: {words_of(message)}")
    return message.is_extended_id or message.is_remote_frame or message.is_fd

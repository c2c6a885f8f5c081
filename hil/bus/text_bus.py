"""A bus whose frames are text on a connection: one read takes all that waits, and a frame costs one look at its text.

python-can's buses of this kind read byte by byte (slcan) or build a message for every frame. This one is a bus of
python-can, so that whatever takes one takes it, and has a shorter way for `Wire`: `next_frame` and `send_frames`. What a
connection has brought is parsed when it is asked for, by either way.
"""

import select
import time
from collections import deque
from collections.abc import Sequence
from typing import Protocol

import can

from hil.bus.error_frames import words_of
from hil.codecs.can_text import Language
from hil.codecs.frame import Frame
from hil.errors import BusError, FrameError


class Line(Protocol):
    """A connection: `name` says of what; `write` never waits and returns how many bytes were taken."""

    name: str

    def fileno(self) -> int:
        """What `select` waits for."""
        ...

    def read(self) -> bytes:
        """What has come, after `select` said so; none if the other side is gone."""
        ...

    def write(self, data: bytes) -> int:
        """Send what the connection takes at once."""
        ...

    def close(self) -> None:
        """Give it back."""
        ...


class TextBus(can.BusABC):
    """A bus over a line, in a language; closes the line."""

    def __init__(
        self, line: Line, language: Language, channel: str, can_filters: can.typechecking.CanFilters | None = None
    ) -> None:
        self._line, self._language = line, language
        self._rest = ""
        self._waiting: deque[str] = deque()
        self.channel_info = line.name
        super().__init__(channel=channel, can_filters=can_filters)

    def next_frame(self, timeout_s: float) -> Frame | None:
        """The next standard data frame; None if none comes in time. Others are passed over.

        Raises:
            BusError: if an error is reported.
            CanOperationError: if the connection is lost.
        """
        parse, waiting, end = self._language.parse, self._waiting, 0.0
        while True:
            while waiting:
                text = waiting.popleft()
                heard = parse(text)
                if type(heard) is Frame:
                    if self._filters is None or self._matches_filters(_message(heard)):
                        return heard
                elif isinstance(heard, can.Message) and heard.is_error_frame:
                    words = f": {words_of(heard)}" if heard.arbitration_id else ""
                    raise BusError(f"an error is reported on the bus: {text.strip()}{words}")
            # The first wait is the whole time; what is left of it needs to be known only if that brought nothing.
            now = time.monotonic()
            end = end or now + timeout_s
            if not self._fill(max(end - now, 0.0)):
                return None

    def send_frames(self, frames: Sequence[Frame]) -> None:
        """Send all at once, without waiting.

        Raises:
            CanOperationError: if they are not taken: what lies on the way to a robot comes too late.
        """
        data = b"".join(map(self._language.write, frames))
        taken = self._line.write(data)
        if taken < len(data):
            raise can.CanOperationError(f"{self._line.name} has stopped taking frames ({taken} of {len(data)} bytes)")

    def handle(self) -> int:
        """The line's; python-can's `fileno` stays away, since its asyncio readers do not ask for what was read already."""
        return self._line.fileno()

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        """Send a message, waiting until it is taken; without end if there is no `timeout` (s)."""
        try:
            data = self._language.write_message(msg)
        except FrameError as error:
            raise can.CanOperationError(str(error)) from error
        end = None if timeout is None else time.monotonic() + timeout
        while data := data[self._line.write(data) :]:
            left = None if end is None else max(end - time.monotonic(), 0.0)
            if not select.select([], [self._line.fileno()], [], left)[1]:
                raise can.CanTimeoutError(f"{self._line.name} has not taken a frame within {timeout:g} s")

    def _recv_internal(self, timeout: float | None) -> tuple[can.Message | None, bool]:
        if not self._waiting and not self._fill(timeout):
            return None, False
        while self._waiting:
            text = self._waiting.popleft()
            heard = self._language.parse(text)
            if heard is not None:
                message = _message(heard) if isinstance(heard, Frame) else heard
                stamped = self._language.stamp(text)
                message.timestamp = time.time() if stamped is None else stamped
                message.channel = self.channel_info
                return message, False
        return None, False

    def shutdown(self) -> None:
        """Close the connection; may be called again."""
        if not self._is_shutdown:
            super().shutdown()
            self._line.close()

    def _fill(self, timeout_s: float | None) -> bool:
        """Take what has come, waiting for it; whether there was anything."""
        if not select.select([self._line.fileno()], [], [], timeout_s)[0]:
            return False
        data = self._line.read()
        if not data:
            raise can.CanOperationError(f"{self._line.name} closed the connection")
        texts, self._rest = self._language.cut(self._rest + data.decode("latin-1"))
        self._waiting.extend(texts)
        return True


def _message(frame: Frame) -> can.Message:
    return can.Message(arbitration_id=frame.identifier, data=frame.data, is_extended_id=False)

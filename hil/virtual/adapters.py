"""The virtual robot behind any bus of python-can, and behind a serial adapter."""

import heapq
import itertools
import os
import re
import select
import time
from collections import deque
from collections.abc import Callable

import can

from hil.codecs.frame import Frame, Timed
from hil.errors import BusError
from hil.virtual.beside import Ears
from hil.virtual.control import Control
from hil.virtual.faults import Faults
from hil.virtual.robot import EVERY_NS, RealTime

# Words beside the bus are heard once in so long: frames come first.
LISTEN_NS = 10_000_000


class BusServer:
    """Answers on a bus until told to stop.

    Args:
        bus: where the session is; closing it is left to whoever opened it.
        faults: what goes wrong on it.
        ears: where words beside the bus come in; closing them is left to whoever opened them.
    """

    def __init__(
        self, robot: RealTime, bus: can.BusABC, faults: Faults | None = None, ears: Ears | None = None
    ) -> None:
        self.robot, self.bus, self.faults, self.ears = robot, bus, faults or Faults(), ears
        self.control = Control(robot, self.faults)
        self._heard_ns = 0
        self._due: list[tuple[int, int, Frame]] = []
        self._count = itertools.count()

    def serve(self, stop: Callable[[], bool]) -> None:
        """Answer, and let the plant move.

        Raises:
            BusError: if the bus breaks.
        """
        try:
            while not stop():
                self._turn()
        except (can.CanError, OSError) as error:
            raise BusError(f"the bus of the virtual robot broke: {error}") from error

    def _turn(self) -> None:
        now = time.monotonic_ns()
        wait = min(self._due[0][0] - now, EVERY_NS) if self._due else EVERY_NS
        message = self.bus.recv(max(wait, 0) * 1e-9)
        if message is not None and not (message.is_extended_id or message.is_remote_frame or message.is_error_frame):
            at = self.robot.arrival(time.monotonic_ns())
            self._hear(Timed(at, Frame(message.arbitration_id, bytes(message.data))))
        now = time.monotonic_ns()
        # Answers first: a host waits for them, and nobody for the plant.
        while self._due and self._due[0][0] <= now:
            _, _, frame = heapq.heappop(self._due)
            self.bus.send(can.Message(arbitration_id=frame.identifier, data=frame.data, is_extended_id=False))
        now = time.monotonic_ns()
        if self.ears is not None and now - self._heard_ns >= LISTEN_NS:
            self._heard_ns = now
            self.ears.hear(self.control, now)
        self.robot.keep_up(now)

    def _hear(self, timed: Timed) -> None:
        for heard in self.faults.to_robot(timed):
            for answer in self.robot.receive(heard.frame, timed.time_ns):
                for changed in self.faults.to_host(answer):
                    heapq.heappush(self._due, (changed.time_ns, next(self._count), changed.frame))


_FRAME = re.compile(rb"t([0-7][0-9A-Fa-f]{2})([0-8])((?:[0-9A-Fa-f]{2})*)")
_OK, _BELL = b"\r", b"\a"
# A line is not longer than this.
_LONGEST = 64


class SerialAdapter(can.BusABC):
    """The robot's side of an adapter; programs open the terminal at `path`."""

    def __init__(self) -> None:
        super().__init__(channel="slcan")
        self._master, self._slave = os.openpty()
        import tty  # not on Windows

        tty.setraw(self._slave)
        os.set_blocking(self._master, False)
        self.path = os.ttyname(self._slave)
        self._text = b""
        self._frames: deque[can.Message] = deque()

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        """Type a frame; a program that does not read loses it."""
        self._type(f"t{msg.arbitration_id:03X}{len(msg.data)}{bytes(msg.data).hex().upper()}\r".encode())

    def recv(self, timeout: float | None = None) -> can.Message | None:
        """The next frame that was typed, None if none is in time."""
        end = None if timeout is None else time.monotonic() + timeout
        # What comes first may be an answer, or a part of a line: neither is a frame.
        while not self._frames:
            left = None if end is None else max(end - time.monotonic(), 0.0)
            if not select.select([self._master], [], [], left)[0]:
                return None
            self.hear(os.read(self._master, 4096))
        return self._frames.popleft()

    def hear(self, text: bytes) -> None:
        """Take in what was typed."""
        *lines, rest = (self._text + text).split(b"\r")
        self._text = rest[-_LONGEST:]
        for line in lines:
            self._follow(line)

    def shutdown(self) -> None:
        """Close the terminal."""
        if not self._is_shutdown:
            os.close(self._master)
            os.close(self._slave)
        super().shutdown()

    def _follow(self, line: bytes) -> None:
        match = _FRAME.fullmatch(line)
        if match is not None and len(match[3]) == 2 * int(match[2]):
            data = bytes.fromhex(match[3].decode())
            self._frames.append(can.Message(arbitration_id=int(match[1], 16), data=data, is_extended_id=False))
        self._type(_OK if match is not None or line[:1] in (b"S", b"O", b"C", b"") else _BELL)

    def _type(self, text: bytes) -> None:
        if select.select([], [self._master], [], 0)[1]:
            os.write(self._master, text)

"""A bus inside one process: the robot answers the moment it is asked, and time is what the caller says."""

import time
from collections import deque

import can
import numpy as np

from hil.codecs.frame import Frame, Timed
from hil.virtual.faults import Faults
from hil.virtual.robot import RealTime

# rad/s below which joints stand, s that they have done so, s that they have for that, and how often (s) they are looked at.
STANDS, STOOD_S, PATIENCE_S, _LOOK_S = 1e-3, 0.5, 10.0, 0.01


class DirectBus(can.BusABC):
    """A python-can bus at whose other end is a virtual robot; `time_ns` is the clock of both."""

    def __init__(self, robot: RealTime, faults: Faults | None = None, time_ns: int = 0) -> None:
        super().__init__(channel="virtual robot")
        self.robot, self.faults, self.time_ns = robot, faults or Faults(), time_ns
        self._waiting: deque[Timed] = deque()

    def now(self) -> int:
        """The clock (ns)."""
        return self.time_ns

    def sleep(self, seconds: float) -> None:
        """Let the clock pass."""
        self.time_ns += int(seconds * 1e9)

    def come_to_rest(self) -> bool:
        """Let the clock pass until the robot's joints stand, or have had their time; frames until then are lost."""
        plant, stood = self.robot.plant, 0.0
        for _ in range(round(PATIENCE_S / _LOOK_S)):
            self.recv(_LOOK_S)
            stood = stood + _LOOK_S if np.max(np.abs(plant.speeds)) < STANDS else 0.0
            if stood > STOOD_S:
                break
        return True

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        """Hand a frame to the robot, which hears standard data frames only; its answers wait until their time has come."""
        if msg.is_extended_id or msg.is_remote_frame or msg.is_error_frame or msg.is_fd:
            return
        frame = Frame(msg.arbitration_id, bytes(msg.data))
        for timed in self.faults.to_robot(Timed(self.time_ns, frame)):
            for answer in self.robot.receive(timed.frame, self.time_ns):
                self._waiting.extend(self.faults.to_host(answer))
        self._waiting = deque(sorted(self._waiting, key=lambda timed: timed.time_ns))

    def inject(self, frame: Frame) -> None:
        """Put a frame on the bus that is not the robot's."""
        self._waiting.append(Timed(self.time_ns, frame))

    def recv(self, timeout: float | None = None) -> can.Message | None:
        """The next answer; waiting for it lets this clock pass, not the real one."""
        limit = self.time_ns + int((timeout or 0.0) * 1e9)
        if self._waiting and self._waiting[0].time_ns <= limit:
            timed = self._waiting.popleft()
            self.time_ns = max(self.time_ns, timed.time_ns)
            return can.Message(arbitration_id=timed.frame.identifier, data=timed.frame.data, is_extended_id=False)
        self.time_ns = limit
        self.robot.advance(self.time_ns)
        return None


class VirtualTimer:
    """Cycles by a bus's clock, which is as fast as the machine's but does not count what a busy machine needs longer."""

    missed = 0

    def __init__(self, bus: DirectBus, period_ns: int) -> None:
        self.bus, self.period_ns = bus, period_ns
        self.start()

    def start(self) -> None:
        """Cycles are due from now on."""
        self._next = self.bus.time_ns + self.period_ns
        self._ahead_ns = time.monotonic_ns() - self.bus.time_ns

    def wait(self) -> tuple[int, int]:
        """Let the clock pass until the next cycle is due; returns that time twice, as none is late."""
        due = self.bus.time_ns = max(self._next, self.bus.time_ns)
        self._next += self.period_ns
        left = due + self._ahead_ns - time.monotonic_ns()
        self._ahead_ns -= min(left, 0)
        time.sleep(max(left, 0) * 1e-9)
        return due, due

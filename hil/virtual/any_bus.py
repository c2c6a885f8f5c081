"""The virtual robot at the other end of any bus of python-can: a virtual one of the kernel, a second adapter, a pair of
wires."""

import heapq
import itertools
import time
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

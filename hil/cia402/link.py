"""The frames of a session with CiA 402 drives: SYNC and answers, states, torques. See `hil.robots.base.Link`."""

from collections.abc import Collection, Sequence
from typing import Protocol

import numpy as np

from hil.cia402.frames import (
    ENABLED,
    FAULTS,
    MOST_PERMILLE,
    OFF,
    SHUTDOWN,
    SYNC,
    Status,
    command_of,
    emergency_of,
    nearer,
    pack_command,
    status_of,
    unpack_status,
)
from hil.codecs.frame import Frame, Timed
from hil.errors import FrameError
from hil.robots.absent import MODULE, SENSOR
from hil.robots.answers import Answers, listen_ns
from hil.robots.base import Reading
from hil.safety.cycle import Module, Outcome
from hil.safety.limits import Limits

# An armed drive is in operation after so long, or something keeps it from it.
ENABLE_NS = 500_000_000


class Drives(Protocol):
    """What a link needs of drives that are awake; see `robot.DrivesRobot`."""

    @property
    def nodes(self) -> tuple[int, ...]: ...

    def joint_angles(self, counts: np.ndarray) -> np.ndarray:
        """Joint angles (n,) in rad from counts (n,)."""
        ...

    def permille(self, torques: np.ndarray) -> np.ndarray:
        """Commands (n,) in thousandths of rated torque for joint torques (n,) in N.m."""
        ...


class DrivesLink:
    """Asks all drives in each cycle by one SYNC; has no clock and no bus."""

    def __init__(self, robot: Drives, limits: Limits, waived: Collection[str]) -> None:
        self.robot = robot
        self.listen_ns = listen_ns(limits)
        self.strange_frames = self.cycle = 0
        self._status: list[Status | None] = [None] * len(robot.nodes)
        self._answers = [Answers() for _ in robot.nodes]
        self._errors = [0] * len(robot.nodes)
        self._of_status = {status_of(node): k for k, node in enumerate(robot.nodes)}
        self._of_error = {emergency_of(node): k for k, node in enumerate(robot.nodes)}
        self._commands = frozenset(map(command_of, robot.nodes))
        self._module = Module.WAIVED if MODULE in waived else Module.ABSENT
        self._has_sensor = SENSOR in waived
        # When torques were first allowed, and which drives have been in operation since.
        self._is_armed, self._armed_ns = False, 0
        self._worked = [False] * len(robot.nodes)

    @property
    def awaited(self) -> frozenset[int]:
        """Identifiers that a decision needs."""
        return frozenset(self._of_status)

    @property
    def missing_answers(self) -> int:
        """Questions that were not answered in time, by drive."""
        return sum(answers.missing for answers in self._answers)

    @property
    def late_answers(self) -> int:
        """Those of them that were answered later."""
        return sum(answers.late for answers in self._answers)

    def requests(self, arrived: Sequence[Timed]) -> list[Frame]:
        """A SYNC, unless an older one is still open."""
        said = [timed.frame.identifier for timed in arrived]
        is_quiet = any(
            answers.would_be_quiet(self.cycle, said.count(identifier))
            for identifier, answers in zip(self._of_status, self._answers, strict=True)
        )
        return [] if is_quiet else [Frame(SYNC, b"")]

    def read(self, start_ns: int, frames: Sequence[Timed]) -> Reading:
        """Take the frames of a cycle in; those from before it answer older questions."""
        until_ns, fresh, ages = start_ns + self.listen_ns, list[bool](), list[int]()
        foreign = self._hear(frames, start_ns, until_ns)
        is_asked = not any(answers.is_quiet(self.cycle) for answers in self._answers)
        for k, answers in enumerate(self._answers):
            age = answers.match(self.cycle, start_ns, until_ns, is_asked=is_asked)
            fresh.append(age is not None and self._take(k, answers.data))
            ages += [age] if age is not None else []
        self.cycle += 1
        if self._is_armed and not self._armed_ns:
            self._armed_ns = start_ns
        counts = np.array([0 if status is None else status.position for status in self._status], dtype=float)
        angles = self.robot.joint_angles(counts).tolist()
        return Reading(
            positions=tuple(angle if is_fresh else None for angle, is_fresh in zip(angles, fresh, strict=True)),
            doubted=tuple(answers.is_doubtful for answers in self._answers),
            age_ns=max(ages) if all(fresh) else None,
            sensor=self._has_sensor,
            module=self._module,
            foreign_torque=foreign,
            trouble=self._trouble(start_ns),
        )

    def _hear(self, frames: Sequence[Timed], start_ns: int, until_ns: int) -> bool:
        """Note answers, and what drives say went wrong; whether somebody else commands them."""
        foreign = False
        for timed in frames:
            identifier, data = timed.frame.identifier, timed.frame.data
            foreign |= identifier in self._commands
            if identifier in self._of_status:
                self._answers[self._of_status[identifier]].hear(timed, start_ns, until_ns)
            elif identifier in self._of_error and len(data) >= 2:
                self._errors[self._of_error[identifier]] = int.from_bytes(data[:2], "little")
        return foreign

    def _take(self, drive: int, data: bytes) -> bool:
        try:
            self._status[drive] = unpack_status(data)
        except FrameError:
            self.strange_frames += 1
            return False
        return True

    def _trouble(self, now_ns: int) -> str:
        """Why a drive does not make what it is asked for; "" if all do, or none has to yet."""
        for k, (node, status) in enumerate(zip(self.robot.nodes, self._status, strict=True)):
            if status is None:
                continue
            error = f", error {self._errors[k]:#06x}" if self._errors[k] else ""
            if status.state in FAULTS:
                return f"drive {node} is in the state {status.state}{error}"
            works = status.state == ENABLED
            if self._armed_ns and not works and (self._worked[k] or now_ns - self._armed_ns > ENABLE_NS):
                return f"drive {node} is not in operation but in the state {status.state}{error}"
            self._worked[k] = bool(self._armed_ns) and (works or self._worked[k])
        return ""

    def frames(self, outcome: Outcome, armed: bool) -> list[Frame]:
        """A command for each drive: one step towards operation once the arm is armed, and its torque there."""
        if outcome.torques is None:
            return []
        if outcome.to_idle or not armed:
            word = OFF if outcome.to_idle else SHUTDOWN
            return [pack_command(node, word) for node in self.robot.nodes]
        self._is_armed = True
        wanted = np.clip(self.robot.permille(np.array(outcome.torques)), -MOST_PERMILLE, MOST_PERMILLE)
        states = ["" if status is None else status.state for status in self._status]
        return [
            pack_command(node, nearer(state), int(permille) if state == ENABLED else 0)
            for node, state, permille in zip(self.robot.nodes, states, wanted.tolist(), strict=True)
        ]

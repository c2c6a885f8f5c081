"""A robot with two joints and a protocol of its own: what somebody writes for a robot that is not known here."""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import asdict, dataclass
from struct import Struct
from typing import Any

import numpy as np

from hil.codecs.frame import Frame, Timed
from hil.errors import BusError
from hil.robots.answers import Answers, listen_ns
from hil.robots.base import Gains, Line, Reading, Sleep
from hil.robots.defaults import limits_of
from hil.safety.cycle import Module, Outcome, Vector
from hil.safety.limits import JointLimits, Limits
from hil.virtual.plant import FreeJoints
from hil.virtual.robot import RealTime

WAKE, ASK, SAID, COMMAND, HALT = 0x010, 0x011, 0x012, 0x020, 0x021
PAIR = Struct(">hh")  # mrad, and mN.m


class ToyLink:
    """Asks with one frame, gets both angles in one."""

    def __init__(self, limits: Limits) -> None:
        self.listen_ns, self.strange_frames, self.cycle = listen_ns(limits), 0, 0
        self.awaited = frozenset({SAID})
        self._answers = Answers()

    @property
    def missing_answers(self) -> int:
        return self._answers.missing

    @property
    def late_answers(self) -> int:
        return self._answers.late

    def requests(self, arrived: Sequence[Timed]) -> list[Frame]:
        quiet = self._answers.would_be_quiet(self.cycle, sum(timed.frame.identifier == SAID for timed in arrived))
        return [] if quiet else [Frame(ASK, b"")]

    def read(self, start_ns: int, frames: Sequence[Timed]) -> Reading:
        answers, until_ns = self._answers, start_ns + self.listen_ns
        for timed in frames:
            if timed.frame.identifier == SAID:
                answers.hear(timed, start_ns, until_ns)
        age = answers.match(self.cycle, start_ns, until_ns, is_asked=not answers.is_quiet(self.cycle))
        self.cycle += 1
        positions: tuple[float | None, ...] = (None, None)
        if age is not None:
            positions = tuple(1e-3 * part for part in PAIR.unpack(answers.data))
        return Reading(positions, age, module=Module.ACTIVE)

    def frames(self, outcome: Outcome, armed: bool) -> list[Frame]:
        if outcome.torques is None:
            return []
        sent = [Frame(COMMAND, PAIR.pack(*(int(1e3 * torque) for torque in outcome.torques)))]
        return [*sent, Frame(HALT, b"")] if outcome.to_idle else sent


@dataclass(frozen=True)
class ToyRobot:
    """All that is to be known of it."""

    serial: int

    about = "toy"
    lacks = ()
    steps = np.array([1e-3, 1e-3])

    def link(self, limits: Limits, waived: Collection[str], force_axes: np.ndarray) -> ToyLink:
        return ToyLink(limits)

    def question(self) -> tuple[list[Frame], frozenset[int]]:
        return [Frame(ASK, b"")], frozenset({SAID})

    def holding_torques(self, angles: Vector) -> Vector:
        return (0.0, 0.0)

    def looser_limits(self, line: Line, limits: Limits) -> list[str]:
        return []

    def commanded(self, frames: Sequence[Frame]) -> np.ndarray | None:
        said = [PAIR.unpack(frame.data) for frame in frames if frame.identifier == COMMAND]
        return 1e-3 * np.array(said[-1]) if said else None

    def to_json(self) -> dict[str, Any]:
        return asdict(self)


class Toy:
    """The kind, as a bench file names it: `kind = "tests.hil.toy_robot:Toy"`; `reach` rad is a key of its own."""

    name, joints, frame = "toy", 2, "robot: toy (1 turns, 2 bends)"
    torque_identifiers, heard = frozenset({COMMAND}), ((SAID, 0x7FF),)

    def __init__(self, reach: float = 1.0) -> None:
        self.reach = reach

    def limits(self, rate_hz: float) -> Limits:
        return limits_of((JointLimits(3.0, 500.0, 2.0, -self.reach, self.reach),) * 2, rate_hz, 1.0)

    def gains(self) -> Gains:
        return Gains((5.0, 5.0), (0.5, 0.5), (1.0, 1.0))

    def company(self, line: Line) -> Frame | None:
        return None

    def enumerate(self, line: Line) -> list[str]:
        return [self.missing(line) or "the toy is there"]

    def start_up(self, line: Line, sleep: Sleep, at_home: Callable[[], bool]) -> ToyRobot:
        line.send(Frame(WAKE, b""))
        timed = line.receive(0.1)
        if timed is None:
            raise BusError(f"{line.name}: the toy did not wake")
        return ToyRobot(timed.frame.data[0])

    def missing(self, line: Line) -> str:
        line.send(Frame(ASK, b""))
        return "" if line.receive(0.1) is not None else f"{line.name}: the toy does not answer"

    def stop(self) -> list[Frame]:
        return [Frame(COMMAND, PAIR.pack(0, 0)), Frame(HALT, b"")]

    def restore(self, document: Mapping[str, Any]) -> ToyRobot:
        return ToyRobot(**document)


class VirtualToy(RealTime):
    """Its other end."""

    def __init__(self) -> None:
        self.plant, self.nodes, self.time_ns = FreeJoints(np.array([0.2, -0.3])), (), None
        self.torques, self.halted = np.zeros(2), 0

    def receive(self, frame: Frame, time_ns: int) -> list[Timed]:
        self.advance(time_ns)
        if frame.identifier == COMMAND:
            self.torques = 1e-3 * np.array(PAIR.unpack(frame.data))
        elif frame.identifier == HALT:
            self.halted, self.torques = self.halted + 1, np.zeros(2)
        answers = {WAKE: b"\x07", ASK: PAIR.pack(*(round(1e3 * angle) for angle in self.plant.angles))}
        said = answers.get(frame.identifier)
        return [] if said is None else [Timed(time_ns + 100_000, Frame(SAID, said))]

    def advance(self, time_ns: int) -> None:
        if self.time_ns is not None and time_ns > self.time_ns:
            self.plant.step(self.torques, (time_ns - self.time_ns) * 1e-9)
        self.time_ns = max(self.time_ns or 0, time_ns)

"""What a session needs of a robot, whatever protocol it speaks: the contract that every kind of robot meets.

A `RobotKind` is made from the `[robot]` table of a bench file and knows the bus: who is there, how they are woken and
zeroed, which frames carry torque, and which ones stop everything. Its `start_up` gives a `Robot`: what its nodes said
of themselves. A `Robot` gives each session a `Link`, which turns frames into what the safety core sees, and the core's
outcome into frames; it has no clock and no bus, so that a recording goes through the same code again.
"""

from collections.abc import Callable, Collection, Mapping, Sequence
from typing import Any, NamedTuple, Protocol

import numpy as np

from hil.codecs.frame import Frame, Timed
from hil.record import Record
from hil.safety.cycle import Module, Outcome, Vector
from hil.safety.limits import Limits

Sleep = Callable[[float], None]


class Line(Protocol):
    """The bus as a robot uses it while it starts up; torque frames are refused here. `now` is its clock in ns."""

    name: str
    now: Callable[[], int]

    def send(self, *frames: Frame) -> None:
        """Put frames on the bus."""
        ...

    def receive(self, timeout_s: float) -> Timed | None:
        """The next frame; None if none comes in time."""
        ...

    def drain(self) -> list[Timed]:
        """What is waiting."""
        ...


class Gains(NamedTuple):
    """By joint: stiffness N.m/rad and damping N.m.s/rad of the posture that is held, N.m at most with which a joint
    proves its way."""

    stiffness: Vector
    damping: Vector
    proof_torque: Vector


class Reading(Record):
    """What the frames of a cycle say.

    `positions` rad by joint, None where no answer to this cycle's question came in time; `age_ns` how old the oldest of
    them was, None if one is missing; `doubted` says by joint whether its answer may be that to an older question. `force` N at the wrist as it was last told, None without a sensor; `sensor`
    whether there is one or the bench may do without. `module` is what the robot's own safety module says, None if it is
    lost; `trouble` why the drives cannot make what is asked for, "" if they can. The rest is as in
    `hil.safety.cycle.Seen`.
    """

    def __init__(
        self,
        positions: tuple[float | None, ...],
        age_ns: int | None = None,
        force: Vector | None = None,
        force_saturated: bool = False,
        force_missing_ns: int = 0,
        sensor: bool = True,
        temperatures: tuple[float | None, ...] = (),
        module: Module | None = Module.ACTIVE,
        warning: str = "",
        fault: str = "",
        foreign_torque: bool = False,
        trouble: str = "",
        doubted: tuple[bool, ...] = (),
    ) -> None:
        self.positions = positions
        self.age_ns = age_ns
        self.force = force
        self.force_saturated = force_saturated
        self.force_missing_ns = force_missing_ns
        self.sensor = sensor
        self.temperatures = temperatures
        self.module = module
        self.warning = warning
        self.fault = fault
        self.foreign_torque = foreign_torque
        self.trouble = trouble
        self.doubted = doubted


class Link(Protocol):
    """The frames of one session; `awaited` are the identifiers that a decision needs, `listen_ns` how long they are
    waited for."""

    listen_ns: int
    strange_frames: int

    @property
    def awaited(self) -> frozenset[int]: ...

    @property
    def missing_answers(self) -> int:
        """Questions for positions that were not answered in time; `late_answers` of them were answered later."""
        ...

    @property
    def late_answers(self) -> int: ...

    def requests(self, arrived: Sequence[Timed]) -> list[Frame]:
        """What a cycle asks for at its beginning; changes nothing. `arrived` are the frames that have come since the
        last one."""
        ...

    def read(self, start_ns: int, frames: Sequence[Timed]) -> Reading:
        """Take the frames of a cycle in; it began at `start_ns`, and frames from before it answer older questions."""
        ...

    def frames(self, outcome: Outcome, armed: bool) -> list[Frame]:
        """The torque frames that an outcome of the safety core allows, and those that switch motors to idle."""
        ...


class Robot(Protocol):
    """A robot that is awake and zeroed."""

    @property
    def about(self) -> str:
        """What an operator is asked about, such as "Proficio, mounted on the right"."""
        ...

    @property
    def steps(self) -> np.ndarray:
        """Resolution (n,) rad of each joint's angle."""
        ...

    @property
    def lacks(self) -> tuple[str, ...]:
        """Safeguards of `hil.robots.absent` that it has not."""
        ...

    def link(self, limits: Limits, waived: Collection[str], force_axes: np.ndarray) -> Link:
        """The frames of a new session.

        Args:
            waived: safeguards that this bench may do without.
            force_axes: (3, 3), turns what the force sensor shows into the wrist's axes and N.
        """
        ...

    def question(self) -> tuple[list[Frame], frozenset[int]]:
        """Frames that ask for all positions, and the identifiers of the answers."""
        ...

    def holding_torques(self, angles: Vector) -> Vector:
        """Joint torques in N.m, one a joint, that hold its weight at joint angles in rad."""
        ...

    def looser_limits(self, line: Line, limits: Limits) -> list[str]:
        """Where limits of a session are looser than the robot's own, in words."""
        ...

    def commanded(self, frames: Sequence[Frame]) -> np.ndarray | None:
        """Joint torques (n,) in N.m that those frames command, in the drives' own whole units; None if none is among them."""
        ...

    def to_json(self) -> dict[str, Any]:
        """All of it, for a recording; the kind's `restore` takes it back."""
        ...


class RobotKind(Protocol):
    """A kind of robot on its bus.

    `frame` says whose joints the angles belong to, so that nobody takes them for another's; `torque_identifiers` are
    those of frames that only the safety core's gate may send, `heard` pairs of identifier and mask of what a session
    hears (all if there is none).
    """

    name: str
    joints: int
    frame: str

    @property
    def torque_identifiers(self) -> frozenset[int]: ...

    @property
    def heard(self) -> tuple[tuple[int, int], ...]: ...

    def limits(self, rate_hz: float) -> Limits:
        """Limits where the bench file says nothing else."""
        ...

    def gains(self) -> Gains:
        """Gains where the bench file says nothing else."""
        ...

    def company(self, line: Line) -> Frame | None:
        """A frame of another host, to be heard before the own first one; None if nobody else talks to the robot."""
        ...

    def enumerate(self, line: Line) -> list[str]:
        """Who is there, a line each; nobody is woken."""
        ...

    def start_up(self, line: Line, sleep: Sleep, at_home: Callable[[], bool]) -> Robot:
        """Look who is there, wake and zero them, without torque.

        Args:
            at_home: asks the operator to put the robot where it is zeroed, if it has not been; False ends the session.

        Raises:
            MisfitError: if this is another robot, or one that cannot be used.
            BusError: if the bus or a node fails.
        """
        ...

    def missing(self, line: Line) -> str:
        """Who of the robot does not answer, in words; "" if all do."""
        ...

    def stop(self) -> list[Frame]:
        """Frames that need no permission and no knowledge of the robot's state: no torque, and motors idle."""
        ...

    def restore(self, document: Mapping[str, Any]) -> Robot:
        """The robot of a recording."""
        ...

"""What the safety core takes and gives in each cycle.

What is made anew in every cycle are named tuples: they are made in a third of the time of frozen dataclasses.
"""

from dataclasses import dataclass
from enum import IntEnum
from typing import NamedTuple

Vector = tuple[float, ...]


class Reaction(IntEnum):
    """What becomes of the torque that a controller asks for; the higher one wins, and all from COMPLY on stay."""

    PASS = 0
    # Less torque while something is in doubt.
    REDUCE = 1
    # The arm gives way: the controller's part fades, the arm's weight is held, motion is damped.
    COMPLY = 2
    # The arm's weight is held and nothing else.
    SUPPORT = 3
    # No torque: the motors are switched to idle, where they brake by themselves.
    RELEASE = 4
    # Nothing is sent: someone else has switched the robot off.
    SILENCE = 5


class Module(IntEnum):
    """What the robot's own safety module says; a robot without one is always ACTIVE."""

    ESTOP = 0
    IDLE = 1
    ACTIVE = 2


class Seen(NamedTuple):
    """What a cycle shows.

    Args:
        time_ns: monotonic time at which the cycle began.
        positions: rad of each joint; None where no answer came in this cycle.
        asked: N.m that the controller asks for, without the arm's weight.
        support: N.m that hold the arm's weight where it is.
        computing_ns: time that the controller took.
        force: N at the wrist; None if there is no sensor.
        force_saturated: whether the sensor says that it is beyond its range.
        temperatures: degC of each motor as it was last told; None where it is not known.
        expected: rad of each joint where a model expects the arm; None without a model.
        module: what the safety module says; None if it did not answer for too long.
        warning, fault: whether it warns of, or has found, a limit passed.
        foreign_torque: whether somebody else sent torques on the bus.
        watched: whether the watchdog is content.
        recording: whether what happens can still be recorded.
        abort: whether the operator, or the end of the process, wants to stop.
        end: whether the session is over and the arm is to be let go.
        arm: whether the operator has just armed the arm, which ends a stop as well.
        controller: number of who asks for torques; another one than before has just taken over.
    """

    time_ns: int
    positions: tuple[float | None, ...]
    asked: Vector
    support: Vector
    computing_ns: int = 0
    force: Vector | None = None
    force_saturated: bool = False
    temperatures: tuple[float | None, ...] = ()
    expected: Vector | None = None
    module: Module | None = Module.ACTIVE
    warning: bool = False
    fault: bool = False
    foreign_torque: bool = False
    watched: bool = True
    recording: bool = True
    abort: bool = False
    end: bool = False
    arm: bool = False
    controller: int = 0


class Motion(NamedTuple):
    """Where the arm is, as far as the core believes the encoders.

    `seconds` since the last cycle (0 if time did not pass), `positions` rad and `speeds` rad/s by joint, `missing` cycles in
    a row without a believable position by joint, `still` cycles in a row with exactly the same one.
    """

    seconds: float
    positions: Vector
    speeds: Vector
    missing: tuple[int, ...]
    still: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class Trip:
    """A rule that was broken: its name, what should become of the torque, and the value against its limit."""

    rule: str
    reaction: Reaction
    words: str

    def __str__(self) -> str:
        """The rule and what broke it."""
        return f"{self.rule}: {self.words}"


class State(NamedTuple):
    """What the core remembers from cycle to cycle.

    `torques` were sent last, `active` is the part of them that does not hold the weight, `asked` what the controller asked
    for while all was well; `armed_ns` is when the arm was armed, None while it is not; `ramp_ns` when the `controller` (its
    number) took over, from where its torque comes up; `stopped` is the first trip that stays; `fading` the share of
    the controller's torque that is left while the arm gives way; `energy` J given so far; `flips` the times (ns) of recent
    changes of sign of each joint's torque, `swing` the last torque of each joint that was more than half its limit; `heat` of
    each joint as a share of what its motor bears for ever; `pinched` cycles in a row in which a joint has pressed with all
    that it may where it can pinch.
    """

    time_ns: int
    motion: Motion
    torques: Vector
    active: Vector
    asked: Vector
    armed_ns: int | None = None
    ramp_ns: int = 0
    controller: int = 0
    stopped: Trip | None = None
    reaction: Reaction = Reaction.PASS
    fading: float = 1.0
    energy: float = 0.0
    late: int = 0
    force: Vector | None = None
    force_still: int = 0
    flips: tuple[tuple[int, ...], ...] = ()
    swing: Vector = ()
    heat: Vector = ()
    pinched: tuple[int, ...] = ()


class Outcome(NamedTuple):
    """What may be sent: `torques` N.m by joint (None: nothing at all), whether to switch motors to idle, and why."""

    torques: Vector | None
    to_idle: bool
    reaction: Reaction
    trips: tuple[Trip, ...]
    limited: tuple[str, ...]

"""What the safety core takes and gives in each cycle."""

from dataclasses import dataclass
from enum import IntEnum

from hil.record import Record

Vector = tuple[float, ...]
# rad by joint; None where no answer came.
Positions = tuple[float | None, ...]


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
    """What the robot's own safety module says; ABSENT if the robot has none, WAIVED if the bench may do without."""

    ESTOP = 0
    IDLE = 1
    ACTIVE = 2
    ABSENT = 3
    WAIVED = 4


class Seen(Record):
    """What a cycle shows.

    Args:
        time_ns: monotonic time at which the cycle began.
        positions: rad of each joint; None where no answer came in this cycle.
        asked: N.m that the controller asks for, without the arm's weight.
        support: N.m that hold the arm's weight where it is.
        computing_ns: time that the controller took.
        force: N at the wrist as it was last told; None if there is no sensor.
        force_missing_ns: time since the sensor last answered; 0 if it has in this cycle.
        force_saturated: whether the sensor says that it is beyond its range.
        temperatures: degC of each motor as it was last told; None where it is not known.
        unmodelled: N.m of each joint that neither a model of the arm nor what was learned beside it explains; None without a model.
        module: what the safety module says; None if it has not answered for too long.
        sensor: whether there is a force sensor, or the bench may do without.
        warning, fault: of which quantities it warns, and of which it has found a limit passed; "" of none.
        trouble: why the drives cannot make what is asked for, "" if they can.
        foreign_torque: whether somebody else sent torques on the bus.
        watched: whether the watchdog is there, awake and content; `watchdog_silent` if it has fallen silent.
        recording: whether what happens can still be recorded.
        abort: whether the operator, or the end of the process, wants to stop.
        end: whether the session is over and the arm is to be let go.
        arm: whether the operator has just armed the arm, which ends a stop as well.
        controller: number of who asks for torques; another one than before has just taken over.
        doubted: whether the position of each joint may be older than the cycle; it is believed for good if the next one is not missing.
    """

    def __init__(
        self,
        time_ns: int,
        positions: Positions,
        asked: Vector,
        support: Vector,
        computing_ns: int = 0,
        force: Vector | None = None,
        force_saturated: bool = False,
        force_missing_ns: int = 0,
        temperatures: tuple[float | None, ...] = (),
        unmodelled: Vector | None = None,
        module: Module | None = Module.ACTIVE,
        sensor: bool = True,
        warning: str = "",
        fault: str = "",
        trouble: str = "",
        foreign_torque: bool = False,
        watched: bool = True,
        watchdog_silent: bool = False,
        recording: bool = True,
        abort: bool = False,
        end: bool = False,
        arm: bool = False,
        controller: int = 0,
        doubted: tuple[bool, ...] = (),
    ) -> None:
        self.time_ns = time_ns
        self.positions = positions
        self.asked = asked
        self.support = support
        self.computing_ns = computing_ns
        self.force = force
        self.force_saturated = force_saturated
        self.force_missing_ns = force_missing_ns
        self.temperatures = temperatures
        self.unmodelled = unmodelled
        self.module = module
        self.sensor = sensor
        self.warning = warning
        self.fault = fault
        self.trouble = trouble
        self.foreign_torque = foreign_torque
        self.watched = watched
        self.watchdog_silent = watchdog_silent
        self.recording = recording
        self.abort = abort
        self.end = end
        self.arm = arm
        self.controller = controller
        self.doubted = doubted


class Motion(Record):
    """Where the arm is, as far as the core believes the encoders.

    `seconds` since the last cycle (0 if time did not pass), `positions` rad and `speeds` rad/s by joint; by joint `missing` is
    the time (ns) since a position could be believed, 0 if this cycle's can, `still` the time (ns) for which it has been exactly
    the same, from a speed of `halted` rad/s on, `jumps` the cycles in a row with an answer too far away, `jumped` rad how far the last of them was,
    `owed` the time (ns) before a position that was doubted, which counts as missing too if none comes after it (empty if there is none).
    """

    def __init__(
        self,
        seconds: float,
        positions: Vector,
        speeds: Vector,
        missing: tuple[int, ...],
        still: tuple[int, ...],
        jumps: tuple[int, ...] = (),
        jumped: Vector = (),
        halted: Vector = (),
        owed: tuple[int, ...] = (),
    ) -> None:
        self.seconds = seconds
        self.positions = positions
        self.speeds = speeds
        self.missing = missing
        self.still = still
        self.jumps = jumps
        self.jumped = jumped
        self.halted = halted
        self.owed = owed

    @property
    def unknown(self) -> tuple[int, ...]:
        """Time (ns) since a position of each joint was certain; 0 if there is one in this cycle."""
        if not self.owed:
            return self.missing
        return tuple(gap + owed if gap else 0 for gap, owed in zip(self.missing, self.owed, strict=True))


@dataclass(frozen=True, slots=True)
class Trip:
    """A rule that was broken: its name, what should become of the torque, and the value against its limit."""

    rule: str
    reaction: Reaction
    words: str

    def __str__(self) -> str:
        """The rule and what broke it."""
        return f"{self.rule}: {self.words}"


class State(Record):
    """What the core remembers from cycle to cycle.

    `torques` were sent last, `active` is the part of them that does not hold the weight, `asked` what the controller asked
    for while all was well; `armed_ns` is when the arm was armed, None while it is not; `share` is how much of its torque the
    `controller` (its number) may have since it took over; `stopped` is the first trip that stays; `fading` the share of
    the controller's torque that is left while the arm gives way; `energy` J given so far; `flips` the times (ns) of recent
    changes of sign of each joint's torque, `swing` the last torque of each joint that was more than half its limit; `heat` of
    each joint as a share of what its motor bears for ever. By joint in ns: `pinched` is how long it has pressed with all that it
    may where it can pinch, `pressed` how long a torque that should move it has not, from `pressed_from` rad at `pressed_speed` rad/s on, `unsure` how
    long its position did not come lately, `disagreed` how long more torque than the limit has not been explained by the model. `calm_speed` rad/s is how fast it was when something last pushed it along. `late`
    and `force_still` are times in ns, too: of cycles in a row that were late, and of an unchanged force.
    """

    def __init__(
        self,
        time_ns: int,
        motion: Motion,
        torques: Vector,
        active: Vector,
        asked: Vector,
        armed_ns: int | None = None,
        controller: int = 0,
        stopped: Trip | None = None,
        reaction: Reaction = Reaction.PASS,
        fading: float = 1.0,
        share: float = 0.0,
        energy: float = 0.0,
        late: int = 0,
        force: Vector | None = None,
        force_still: int = 0,
        flips: tuple[tuple[int, ...], ...] = (),
        swing: Vector = (),
        heat: Vector = (),
        pinched: tuple[int, ...] = (),
        pressed: tuple[int, ...] = (),
        pressed_speed: Vector = (),
        pressed_from: Vector = (),
        unsure: tuple[int, ...] = (),
        calm_speed: Vector = (),
        disagreed: tuple[int, ...] = (),
    ) -> None:
        self.time_ns = time_ns
        self.motion = motion
        self.torques = torques
        self.active = active
        self.asked = asked
        self.armed_ns = armed_ns
        self.controller = controller
        self.stopped = stopped
        self.reaction = reaction
        self.fading = fading
        self.share = share
        self.energy = energy
        self.late = late
        self.force = force
        self.force_still = force_still
        self.flips = flips
        self.swing = swing
        self.heat = heat
        self.pinched = pinched
        self.pressed = pressed
        self.pressed_speed = pressed_speed
        self.pressed_from = pressed_from
        self.unsure = unsure
        self.calm_speed = calm_speed
        self.disagreed = disagreed


class Outcome(Record):
    """What may be sent: `torques` N.m by joint (None: nothing at all), whether to switch motors to idle, and why."""

    def __init__(
        self,
        torques: Vector | None,
        to_idle: bool,
        reaction: Reaction,
        trips: tuple[Trip, ...],
        limited: tuple[str, ...],
    ) -> None:
        self.torques = torques
        self.to_idle = to_idle
        self.reaction = reaction
        self.trips = trips
        self.limited = limited

"""The decision of a cycle, from its frames alone: the same live, in a dry run and in replay."""

from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from hil.bus.gate import TORQUE_IDENTIFIERS, TorqueGate
from hil.codecs.barrett.force_torque import unpack_reading
from hil.codecs.barrett.identifiers import Group, Node, answer_of, to_group, to_node
from hil.codecs.barrett.positions import motor_counts, nearest_turn
from hil.codecs.barrett.properties import decode_value, encode_request
from hil.codecs.barrett.safety_module import Level, decode_mode, decode_pendant
from hil.codecs.frame import Frame, Timed
from hil.errors import FrameError
from hil.robots import proficio
from hil.safety.core import begin, step
from hil.safety.cycle import Module, Outcome, Reaction, Seen, State, Trip
from hil.safety.limits import Limits
from hil.safety.motion import follow
from hil.safety.rules import SLOW_SHARE
from hil.session.absent import MODULE, SENSOR
from hil.session.answers import Answers
from hil.session.controllers import Controller, Observed, Showing
from hil.session.proof import Proof
from hil.session.start_up import Robot
from hil.session.timing import Lateness

# The safety module is asked for its mode and its pendant in turn, each in this time if a cycle is shorter; it is lost after so long.
MODULE_EVERY_S = 0.01
MODULE_LOST_NS = 250_000_000

# The motors are asked in turn for their temperature, one every so many cycles.
TEMPERATURE_EVERY = 100
# Answers that have not come in this share of a period are missing.
LISTEN_SHARE = 0.5

# Motors by joint whose angles it takes.
_NEEDED = [frozenset(np.flatnonzero(row).tolist()) for row in proficio.MOTOR_TO_JOINT]
_POSITIONS = {answer_of(k + 1, Group.POSITIONS): k for k in range(proficio.JOINTS)}
_PROPERTIES = {answer_of(k + 1, Group.PROPERTIES): k for k in range(proficio.JOINTS)}
_FORCE = answer_of(Node.FORCE_SENSOR, Group.FORCE)
_MODULE = answer_of(Node.SAFETY, Group.PROPERTIES)


class CycleInput(NamedTuple):
    """All that a decision depends on; a recording holds exactly this.

    `start_ns` is when the cycle asked for positions (monotonic), `frames` what came since the last cycle listened, `computing_ns` what the controller took
    in the cycle before, `asked` N.m what somebody outside asks for, None while nobody does; the rest are wishes of the operator,
    and whether recorder and watchdog are content.
    """

    start_ns: int
    frames: Sequence[Timed]
    computing_ns: int = 0
    arm: bool = False
    abort: bool = False
    recording: bool = True
    end: bool = False
    watched: bool = True
    confirm: bool = False
    watchdog_silent: bool = False
    asked: tuple[float, ...] | None = None


class Decision(NamedTuple):
    """What a cycle sends, and what was known when that was decided.

    `passed` (3,) N.m is what the core let pass of the torque `asked` for, without the part that holds the weight; `shown` are
    the controller's own signals.
    """

    frames: list[Frame]
    outcome: Outcome
    observed: Observed
    asked: np.ndarray
    passed: tuple[float, ...]
    shown: tuple[float, ...] = ()


class Pilot:
    """Turns the frames of a cycle into the frames of a decision; has no clock and no bus.

    Args:
        gravity: whether the arm's weight is held; a robot whose joints are vertical has none to hold.
        proof: what an armed arm has to prove before the controller gets it.
        waived: safeguards that this bench may do without, see `hil.session.absent`.
        force_axes: (3, 3), turns what the force sensor shows into the wrist's axes and N; as it is without them.
    """

    def __init__(
        self,
        robot: Robot,
        limits: Limits,
        controller: Controller,
        *,
        gravity: bool = True,
        proof: Proof | None = None,
        force_axes: np.ndarray | None = None,
        waived: Collection[str] = (),
    ) -> None:
        self._force_axes = np.eye(3) if force_axes is None else force_axes
        self.proof = proof
        # Who asked for torques last, how many have taken over so far, and when the last of them did.
        self._asking: tuple[object, int] = (None, 0)
        self._takeovers, self._taken_ns = 0, 0
        self.robot, self.limits, self.controller, self.gravity = robot, limits, controller, gravity
        self._showing = controller if isinstance(controller, Showing) else None
        self.gate = TorqueGate(robot.torque_units, robot.motor["MODE"])
        self.state: State | None = None
        self.cycle = 0
        self.strange_frames = 0
        self._position_answers = [Answers() for _ in _POSITIONS]
        self._force_answers = Answers()
        # How old the positions of each cycle were when they came, from their question on.
        self.round_trip = Lateness()
        # Decisions that took more than their share of the period, so that the next cycle began late or may have.
        self.slow_cycles = 0
        self.listen_ns = int(min(LISTEN_SHARE * limits.period_ns, 1e9 * limits.answer_s))
        self._module_every = 2 * max(round(0.5 * MODULE_EVERY_S * 1e9 / limits.period_ns), 1)
        self.controller_error = ""
        # Why the arm was not armed when that was last looked at.
        self.refused: Trip | None = None
        self._counts: list[int | None] = [None] * proficio.JOINTS
        self._force = np.zeros(3)
        self._force_ns = 0
        self._force_saturated = False
        self._temperatures: list[float | None] = [None] * proficio.JOINTS
        absent = Module.WAIVED if MODULE in waived else Module.ABSENT
        self._module: Module | None = absent if robot.module is None else None
        self._has_sensor = robot.sensor is not None or SENSOR in waived
        # Time in cycles since the module has said its mode; while the session stood still nobody asked it.
        self._module_silent_ns = 0
        self._unsure: tuple[int, ...] = (0,) * proficio.JOINTS
        self._warning = self._fault = self._foreign = False
        self._before_ns = 0

    def requests(self, arrived: Sequence[Timed] = ()) -> list[Frame]:
        """What a cycle asks for at its beginning; `arrived` are the frames that have come since the last one."""
        robot, frames = self.robot, list[Frame]()
        counts = Counter(frame.identifier for _, frame in arrived)
        if not self._is_quiet(counts):
            frames.append(Frame(to_group(Group.ARM), encode_request(robot.motor["P"])))
        if robot.sensor is not None and not self._force_answers.would_be_quiet(self.cycle, counts[_FORCE]):
            frames.append(Frame(to_node(Node.FORCE_SENSOR), encode_request(robot.sensor["FT"])))
        if robot.module is not None and self.cycle % self._module_every in (0, self._module_every // 2):
            name = "MODE" if self.cycle % self._module_every == 0 else "PEN"
            frames.append(Frame(to_node(Node.SAFETY), encode_request(robot.module[name])))
        turn, rest = divmod(self.cycle, TEMPERATURE_EVERY)
        if rest == TEMPERATURE_EVERY - 1:
            motor = turn % proficio.JOINTS + 1
            frames.append(Frame(to_node(motor), encode_request(robot.motor["TEMP"])))
        return frames

    def _is_quiet(self, arrived: Mapping[int, int]) -> bool:
        """Whether positions are not asked for in this cycle, as an older question for them is open."""
        return any(
            answers.would_be_quiet(self.cycle, arrived.get(identifier, 0))
            for identifier, answers in zip(_POSITIONS, self._position_answers, strict=True)
        )

    @property
    def awaited(self) -> frozenset[int]:
        """Identifiers that a decision needs."""
        return frozenset(_POSITIONS) | ({_FORCE} if self.robot.sensor is not None else frozenset())

    def decide(self, given: CycleInput) -> Decision:
        """Decide what to send."""
        self.slow_cycles += given.computing_ns > SLOW_SHARE * self.limits.period_ns
        seen = self._seen(given, self._read(given))
        if self.state is None:
            positions = tuple(0.0 if q is None else q for q in seen.positions)
            self.state = begin(self.limits, given.start_ns - self.limits.period_ns, positions)
            self.state = self.state._replace(unsure=self._unsure)
        # The controller sees what the core believes, never a raw answer.
        motion = follow(self.limits, self.state, seen)
        angles = np.array(motion.positions)
        armed = self.state.armed_ns
        seconds = -1.0 if armed is None else (given.start_ns - armed) * 1e-9
        sent = np.array(self.state.active)
        fresh = not any(motion.missing)
        speeds, force = np.array(motion.speeds), self._force.copy()
        observed = Observed(seconds, angles, speeds, force, sent, given.confirm, fresh, given.asked)
        asked = self._ask(observed, given.start_ns)
        support = proficio.holding_torques(angles, self.robot.side) if self.gravity else np.zeros(proficio.JOINTS)
        seen = seen._replace(asked=tuple(asked.tolist()), support=tuple(support.tolist()))
        seen = seen._replace(controller=self._takeovers)
        self.state, outcome = step(self.limits, self.state, seen)
        self.cycle += 1
        passed = self.state.active
        if not self.is_armed and outcome.trips:
            # Nothing is worth remembering of an arm that was never energised; a first position may have been wrong.
            worst = max(outcome.trips, key=lambda trip: trip.reaction)
            self.refused, self._unsure, self.state = worst, self.state.unsure, None
        shown = self._showing.shown if self._showing is not None else ()
        return Decision(self.gate.frames(outcome), outcome, observed, asked, passed, shown)

    @property
    def is_armed(self) -> bool:
        """Whether the arm was armed at some time."""
        return self.state is not None and self.state.armed_ns is not None

    @property
    def is_ready(self) -> bool:
        """Whether the arm is armed and has proved what it has to, so that the controller asks for torques."""
        return self.is_armed and (self.proof is None or self.proof.is_done)

    @property
    def stopped(self) -> Trip | None:
        """Why the arm is stopped; None while it is not."""
        return self.state.stopped if self.state is not None else None

    @property
    def is_over(self) -> bool:
        """Whether the arm was let go, or gives way without anything left of what was asked."""
        state = self.state
        if state is None or state.stopped is None or not self.is_armed:
            return False
        return state.reaction >= Reaction.RELEASE or state.fading == 0.0

    def _ask(self, observed: Observed, now_ns: int) -> np.ndarray:
        """What the controller asks for; one that raises asks for what is no number, which the core does not let pass."""
        is_proving = self.proof is not None and observed.seconds >= 0 and not self.proof.is_done
        try:
            if is_proving and self.proof is not None:
                self._take_over(self.proof, now_ns)
                return self.proof.torque(observed)
            self._take_over(self.controller, now_ns)
            if observed.seconds >= 0:
                observed = observed._replace(seconds=min(observed.seconds, (now_ns - self._taken_ns) * 1e-9))
            asked = np.asarray(self.controller.torque(observed), dtype=float).ravel()
            self._take_over(self.controller, now_ns)  # it may just have begun again
            return asked
        except Exception as error:  # a user's own class may raise anything
            self.controller_error = f"{type(error).__name__}: {error}"
            return np.full(proficio.JOINTS, np.nan)

    def _take_over(self, asking: object, now_ns: int) -> None:
        """Note who asks, and when somebody else begins to: its torque comes up along the ramp."""
        turn = getattr(asking, "turn", 0)
        if asking is not self._asking[0] or turn != self._asking[1]:
            self._asking = asking, turn
            self._takeovers += 1
            self._taken_ns = now_ns

    def _seen(self, given: CycleInput, fresh: set[int]) -> Seen:
        """What the core is shown of a cycle, but for the torques that are not known yet."""
        self._module_silent_ns += (
            min(given.start_ns - self._before_ns, 2 * self.limits.period_ns) if self._before_ns else 0
        )
        self._force_ns = self._force_ns or given.start_ns
        self._before_ns = given.start_ns
        angles = self._angles()
        lost = self.robot.module is not None and self._module_silent_ns > MODULE_LOST_NS
        foreign, self._foreign = self._foreign, False
        return Seen(
            time_ns=given.start_ns,
            positions=tuple(angles[k] if self._believed(k, fresh) else None for k in range(proficio.JOINTS)),
            asked=(),
            support=(),
            computing_ns=given.computing_ns,
            force=tuple(self._force.tolist()) if self.robot.sensor is not None else None,
            force_saturated=self._force_saturated,
            force_missing_ns=given.start_ns - self._force_ns,
            sensor=self._has_sensor,
            temperatures=tuple(self._temperatures),
            module=None if lost else self._module,
            warning=self._warning,
            fault=self._fault,
            foreign_torque=foreign,
            recording=given.recording,
            abort=given.abort,
            end=given.end,
            watched=given.watched,
            watchdog_silent=given.watchdog_silent,
            arm=given.arm,
        )

    def _read(self, given: CycleInput) -> set[int]:
        """Take the frames of a cycle in; returns the motors whose position answers this cycle's question, and in time."""
        before: dict[int, list[Timed]] = {}
        since: dict[int, list[Timed]] = {}
        for timed in given.frames:
            at, (identifier, data) = timed
            if identifier in _POSITIONS or identifier == _FORCE:
                part = before if at <= given.start_ns else since
                part.setdefault(identifier, []).append(timed)
                continue
            try:
                if identifier in _PROPERTIES:
                    number, value = decode_value(data)
                    if number == self.robot.motor["TEMP"]:
                        self._temperatures[_PROPERTIES[identifier]] = float(value)
                elif identifier == _MODULE:
                    self._hear_module(data)
                elif identifier in TORQUE_IDENTIFIERS:
                    self._foreign = True
            except FrameError:
                self.strange_frames += 1
        self._read_force(given.start_ns, before.get(_FORCE, []), since.get(_FORCE, []))
        return self._read_positions(given.start_ns, before, since)

    def _read_positions(
        self, start_ns: int, before: Mapping[int, list[Timed]], since: Mapping[int, list[Timed]]
    ) -> set[int]:
        """Match answers to questions: those from before the cycle, or from after its time, belong to an older one."""
        until_ns, fresh, oldest = start_ns + self.listen_ns, set[int](), 0
        is_asked = not self._is_quiet({identifier: len(found) for identifier, found in before.items()})
        for (identifier, motor), answers in zip(_POSITIONS.items(), self._position_answers, strict=True):
            found = since.get(identifier, [])
            answers.belated(len(before.get(identifier, [])))
            if is_asked:
                answers.asked(self.cycle, start_ns)
            age = answers.match([at for at, _ in found], until_ns, is_asked=is_asked)
            in_time = {frame.data for at, frame in found if at <= until_ns}
            if age is not None and self._position(motor, in_time):
                fresh.add(motor)
                oldest = max(oldest, age)
        if len(fresh) == proficio.JOINTS:
            self.round_trip.add(oldest)
        return fresh

    def _read_force(self, start_ns: int, before: list[Timed], since: list[Timed]) -> None:
        """The same for the force sensor's answers."""
        if self.robot.sensor is None:
            return
        answers = self._force_answers
        is_asked = not answers.would_be_quiet(self.cycle, len(before))
        answers.belated(len(before))
        if is_asked:
            answers.asked(self.cycle, start_ns)
        if answers.match([at for at, _ in since], start_ns + self.listen_ns, is_asked=is_asked) is None:
            return
        try:
            reading = unpack_reading(Group.FORCE, since[0].frame.data)
        except FrameError:
            self.strange_frames += 1
            return
        self._force = self._force_axes @ np.array(reading[:3])
        self._force_saturated = reading.status is not None and bool(reading.status.saturated_gauges)
        self._force_ns = start_ns

    @property
    def missing_answers(self) -> int:
        """Questions for positions that were not answered in time."""
        return sum(answers.missing for answers in self._position_answers)

    @property
    def late_answers(self) -> int:
        """Those of them that were answered later."""
        return sum(answers.late for answers in self._position_answers)

    def _position(self, motor: int, answers: set[bytes]) -> bool:
        """Take the position of a motor; not if two nodes answer differently in its name, or it makes no sense."""
        data, *others = answers
        try:
            counts, before = motor_counts(data), self._counts[motor]
        except FrameError:
            self.strange_frames += 1
            return False
        if others:
            self.strange_frames += 1
            return False
        self._counts[motor] = counts if before is None else nearest_turn(counts, before)
        return True

    def _hear_module(self, data: bytes) -> None:
        assert self.robot.module is not None
        number, value = decode_value(data)
        if number == self.robot.module["MODE"]:
            self._module = Module(decode_mode(value))
            self._module_silent_ns = 0
        elif number == self.robot.module["PEN"]:
            levels = decode_pendant(value)[4:]
            self._warning, self._fault = Level.WARNING in levels, Level.FAULT in levels

    def _angles(self) -> np.ndarray:
        counts = [0 if c is None else c for c in self._counts]
        return self.robot.joint_angles(np.array(counts, dtype=float))

    def _believed(self, joint: int, fresh: set[int]) -> bool:
        """Whether all motors that a joint's angle comes from have answered."""
        return _NEEDED[joint] <= fresh

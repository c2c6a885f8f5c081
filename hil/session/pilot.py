"""The decision of a cycle, from its frames alone: the same live, in a dry run and in replay."""

from collections.abc import Sequence
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
from hil.session.controllers import Controller, Observed, Showing
from hil.session.proof import Proof
from hil.session.start_up import Robot

# The safety module is asked for its mode and its pendant in turn, every so many cycles; it is lost after so long.
MODULE_EVERY = 10
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
    in the cycle before; the rest are wishes of the operator, and whether recorder and watchdog are content.
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
        # Answers that did not come in time, and those of them that came later.
        self.missing_answers = self.late_answers = self.strange_frames = 0
        # Decisions that took more than their share of the period, so that the next cycle began late or may have.
        self.slow_cycles = 0
        self._owed = [0] * proficio.JOINTS
        self.listen_ns = int(LISTEN_SHARE * limits.period_ns)
        self.controller_error = ""
        # Why the arm was not armed when that was last looked at.
        self.refused: Trip | None = None
        self._counts: list[int | None] = [None] * proficio.JOINTS
        self._force = np.zeros(3)
        self._force_saturated = False
        self._temperatures: list[float | None] = [None] * proficio.JOINTS
        self._module: Module | None = Module.ACTIVE if robot.module is None else None
        self._module_ns = 0
        self._warning = self._fault = self._foreign = False

    def requests(self) -> list[Frame]:
        """What a cycle asks for at its beginning."""
        frames = [Frame(to_group(Group.ARM), encode_request(self.robot.motor["P"]))]
        if self.robot.sensor is not None:
            frames.append(Frame(to_node(Node.FORCE_SENSOR), encode_request(self.robot.sensor["FT"])))
        if self.robot.module is not None and self.cycle % MODULE_EVERY in (0, MODULE_EVERY // 2):
            name = "MODE" if self.cycle % MODULE_EVERY == 0 else "PEN"
            frames.append(Frame(to_node(Node.SAFETY), encode_request(self.robot.module[name])))
        turn, rest = divmod(self.cycle, TEMPERATURE_EVERY)
        if rest == TEMPERATURE_EVERY - 1:
            motor = turn % proficio.JOINTS + 1
            frames.append(Frame(to_node(motor), encode_request(self.robot.motor["TEMP"])))
        return frames

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
        # The controller sees what the core believes, never a raw answer.
        motion = follow(self.limits, self.state, seen)
        angles = np.array(motion.positions)
        armed = self.state.armed_ns
        seconds = -1.0 if armed is None else (given.start_ns - armed) * 1e-9
        sent = np.array(self.state.active)
        fresh = not any(motion.missing)
        observed = Observed(seconds, angles, np.array(motion.speeds), self._force.copy(), sent, given.confirm, fresh)
        asked = self._ask(observed, given.start_ns)
        support = proficio.holding_torques(angles, self.robot.side) if self.gravity else np.zeros(proficio.JOINTS)
        seen = seen._replace(asked=tuple(asked.tolist()), support=tuple(support.tolist()))
        seen = seen._replace(controller=self._takeovers)
        self.state, outcome = step(self.limits, self.state, seen)
        self.cycle += 1
        passed = self.state.active
        if not self.is_armed and outcome.trips:
            # Nothing is worth remembering of an arm that was never energised; a first position may have been wrong.
            self.refused, self.state = outcome.trips[0], None
        shown = self._showing.shown if self._showing is not None else ()
        return Decision(self.gate.frames(outcome), outcome, observed, asked, passed, shown)

    @property
    def is_armed(self) -> bool:
        """Whether the arm was armed at some time."""
        return self.state is not None and self.state.armed_ns is not None

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
            return np.asarray(self.controller.torque(observed), dtype=float).ravel()
        except Exception as error:  # a user's own class may raise anything
            self.controller_error = f"{type(error).__name__}: {error}"
            return np.full(proficio.JOINTS, np.nan)

    def _take_over(self, asking: object, now_ns: int) -> None:
        """Note who asks, and when somebody else begins to: its torque comes up along the ramp."""
        turn = getattr(asking, "turn", 0)
        if (asking, turn) != self._asking:
            self._asking = asking, turn
            self._takeovers += 1
            self._taken_ns = now_ns

    def _seen(self, given: CycleInput, fresh: set[int]) -> Seen:
        """What the core is shown of a cycle, but for the torques that are not known yet."""
        if not self._module_ns:
            self._module_ns = given.start_ns
        angles = self._angles()
        lost = self.robot.module is not None and given.start_ns - self._module_ns > MODULE_LOST_NS
        foreign, self._foreign = self._foreign, False
        return Seen(
            time_ns=given.start_ns,
            positions=tuple(angles[k] if self._believed(k, fresh) else None for k in range(proficio.JOINTS)),
            asked=(),
            support=(),
            computing_ns=given.computing_ns,
            force=tuple(self._force.tolist()) if self.robot.sensor is not None else None,
            force_saturated=self._force_saturated,
            temperatures=tuple(self._temperatures),
            module=None if lost else self._module,
            warning=self._warning,
            fault=self._fault,
            foreign_torque=foreign,
            recording=given.recording,
            abort=given.abort,
            end=given.end,
            watched=given.watched,
            arm=given.arm,
        )

    def _read(self, given: CycleInput) -> set[int]:
        """Take the frames of a cycle in; returns the motors whose position came in time.

        An answer from before the cycle, or from after its time, belongs to another one.
        """
        positions: dict[int, set[bytes]] = {}
        belated: list[int] = []
        for at, frame in given.frames:
            try:
                if frame.identifier in _POSITIONS:
                    motor = _POSITIONS[frame.identifier]
                    if not given.start_ns < at <= given.start_ns + self.listen_ns:
                        belated.append(motor)
                    elif motor in positions:  # one of the two is late
                        belated.append(motor)
                        positions[motor].add(frame.data)
                    else:
                        positions[motor] = {frame.data}
                elif frame.identifier == _FORCE:
                    reading = unpack_reading(Group.FORCE, frame.data)
                    self._force = self._force_axes @ np.array(reading[:3])
                    self._force_saturated = reading.status is not None and bool(reading.status.saturated_gauges)
                elif frame.identifier in _PROPERTIES:
                    number, value = decode_value(frame.data)
                    if number == self.robot.motor["TEMP"]:
                        self._temperatures[_PROPERTIES[frame.identifier]] = float(value)
                elif frame.identifier == _MODULE:
                    self._hear_module(frame.data, at)
                elif frame.identifier in TORQUE_IDENTIFIERS:
                    self._foreign = True
            except FrameError:
                self.strange_frames += 1
        fresh = {motor for motor, answers in positions.items() if self._position(motor, answers)}
        self._count(fresh, belated)
        return fresh

    def _count(self, fresh: set[int], belated: list[int]) -> None:
        """Count the answers that are missing, and those of them that have come since."""
        for motor in range(proficio.JOINTS):
            if motor not in fresh:
                self._owed[motor] += 1
                self.missing_answers += 1
        for motor in belated:
            if self._owed[motor]:
                self._owed[motor] -= 1
                self.late_answers += 1

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

    def _hear_module(self, data: bytes, at: int) -> None:
        assert self.robot.module is not None
        number, value = decode_value(data)
        if number == self.robot.module["MODE"]:
            self._module = Module(decode_mode(value))
            self._module_ns = at
        elif number == self.robot.module["PEN"]:
            levels = decode_pendant(value)[4:]
            self._warning, self._fault = Level.WARNING in levels, Level.FAULT in levels

    def _angles(self) -> np.ndarray:
        counts = [0 if c is None else c for c in self._counts]
        return self.robot.joint_angles(np.array(counts, dtype=float))

    def _believed(self, joint: int, fresh: set[int]) -> bool:
        """Whether all motors that a joint's angle comes from have answered."""
        return _NEEDED[joint] <= fresh

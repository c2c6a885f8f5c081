"""The frames of a session with a Barrett robot: questions, what answers say, torques."""

from collections.abc import Collection, Mapping, Sequence
from typing import Final, Protocol

import numpy as np

from hil.bus.gate import TORQUE_IDENTIFIERS, TorqueGate
from hil.codecs.barrett.force_torque import DIVISORS, GAUGES, unpack_counts
from hil.codecs.barrett.identifiers import Group, Node, answer_of, to_group, to_node
from hil.codecs.barrett.positions import motor_counts, nearest_turn
from hil.codecs.barrett.properties import decode_value, encode_request
from hil.codecs.barrett.safety_module import Level, decode_mode, decode_pendant, quantities
from hil.codecs.frame import Frame, Timed
from hil.errors import FrameError
from hil.robots import proficio
from hil.robots.absent import MODULE, SENSOR
from hil.robots.answers import Answers, listen_ns
from hil.robots.base import Reading
from hil.safety.cycle import Module, Outcome
from hil.safety.limits import Limits

# The safety module is asked for its mode and its pendant in turn, each in this time if a cycle is shorter; it is lost
# after so long.
MODULE_EVERY_S: Final = 0.01
MODULE_LOST_NS: Final = 250_000_000
# The motors are asked in turn for their temperature, one in so much time.
TEMPERATURE_EVERY_S: Final = 0.2

# Motors by joint whose angles it takes.
_NEEDED: Final[list[list[int]]] = [np.flatnonzero(row).tolist() for row in proficio.MOTOR_TO_JOINT]
# Identifiers by motor.
_POSITIONS: Final = [answer_of(k + 1, Group.POSITIONS) for k in range(proficio.JOINTS)]
_PROPERTIES: Final = [answer_of(k + 1, Group.PROPERTIES) for k in range(proficio.JOINTS)]
_FORCE: Final = answer_of(Node.FORCE_SENSOR, Group.FORCE)
_MODULE: Final = answer_of(Node.SAFETY, Group.PROPERTIES)
_NEWTONS: Final = DIVISORS[Group.FORCE]


class Awake(Protocol):
    """What a link needs of a robot that is awake: numbers of properties by name, and what counts mean; see `start_up.Robot`."""

    @property
    def torque_units(self) -> tuple[int, ...]: ...

    @property
    def motor(self) -> Mapping[str, int]: ...

    @property
    def sensor(self) -> Mapping[str, int] | None: ...

    @property
    def module(self) -> Mapping[str, int] | None: ...

    def joint_angles(self, counts: proficio.Vector) -> proficio.Vector:
        """Joint angles in rad from the unwrapped counts of each motor."""
        ...


class BarrettLink:
    """Asks for positions in each cycle, and now and then for the rest; has no clock and no bus. See `hil.robots.base.Link`."""

    def __init__(self, robot: Awake, limits: Limits, waived: Collection[str], force_axes: np.ndarray) -> None:
        self.robot, self.period_ns = robot, limits.period_ns
        self.gate = TorqueGate(robot.torque_units, robot.motor["MODE"])
        self.listen_ns = listen_ns(limits)
        self.strange_frames = 0
        self.cycle = 0
        self._module_every = 2 * max(round(0.5 * MODULE_EVERY_S * 1e9 / limits.period_ns), 1)
        self._temperature_every = max(round(TEMPERATURE_EVERY_S * 1e9 / limits.period_ns), 1)
        self._temperature_number = robot.motor["TEMP"]
        self._has_module, self._hears_force = robot.module is not None, robot.sensor is not None
        self._ask_positions = Frame(to_group(Group.ARM), encode_request(robot.motor["P"]))
        self._ask_force: Frame | None = None
        if robot.sensor is not None:
            self._ask_force = Frame(to_node(Node.FORCE_SENSOR), encode_request(robot.sensor["FT"]))
        self._awaited = frozenset(_POSITIONS) | (frozenset({_FORCE}) if self._hears_force else frozenset())
        self._position_answers = [Answers() for _ in _POSITIONS]
        self._force_answers = Answers()
        self._answers_of = {identifier: self._position_answers[motor] for motor, identifier in enumerate(_POSITIONS)}
        if self._hears_force:
            self._answers_of[_FORCE] = self._force_answers
        self._counts: list[int | None] = [None] * proficio.JOINTS
        self._force_axes = proficio.matrix(force_axes)
        self._force = (0.0, 0.0, 0.0)
        self._force_ns = 0
        self._force_saturated = False
        self._temperatures: list[float | None] = [None] * proficio.JOINTS
        absent = Module.WAIVED if MODULE in waived else Module.ABSENT
        self._module: Module | None = absent if robot.module is None else None
        # A sensor that has not answered yet is none: nobody knows the force with which the arm would be armed.
        self._has_sensor = robot.sensor is None and SENSOR in waived
        # Time in cycles since the module has said its mode, and what it watches; while the session stood still nobody asked it.
        self._mode_silent_ns = self._pendant_silent_ns = 0
        self._warning = self._fault = ""
        self._foreign = False
        self._pendant: int | None = None  # the last value, which is seldom another one
        self._before_ns = 0

    @property
    def awaited(self) -> frozenset[int]:
        """Identifiers that a decision needs."""
        return self._awaited

    @property
    def missing_answers(self) -> int:
        """Questions for positions that were not answered in time."""
        return sum([answers.missing for answers in self._position_answers])

    @property
    def late_answers(self) -> int:
        """Those of them that were answered later."""
        return sum([answers.late for answers in self._position_answers])

    def requests(self, arrived: Sequence[Timed]) -> list[Frame]:
        """What a cycle asks for at its beginning; `arrived` are the frames that have come since the last one."""
        robot, frames, before = self.robot, list[Frame](), dict[int, int]()
        for timed in arrived:
            identifier = timed.frame.identifier
            before[identifier] = before.get(identifier, 0) + 1
        is_quiet = False
        for motor, answers in enumerate(self._position_answers):
            if answers.would_be_quiet(self.cycle, before.get(_POSITIONS[motor], 0)):
                is_quiet = True
        if not is_quiet:
            frames.append(self._ask_positions)
        if self._ask_force is not None and not self._force_answers.would_be_quiet(self.cycle, before.get(_FORCE, 0)):
            frames.append(self._ask_force)
        if robot.module is not None and self.cycle % self._module_every in (0, self._module_every // 2):
            name = "MODE" if self.cycle % self._module_every == 0 else "PEN"
            frames.append(Frame(to_node(Node.SAFETY), encode_request(robot.module[name])))
        turn, rest = divmod(self.cycle, self._temperature_every)
        if rest == self._temperature_every - 1:
            motor = turn % proficio.JOINTS + 1
            frames.append(Frame(to_node(motor), encode_request(robot.motor["TEMP"])))
        return frames

    def frames(self, outcome: Outcome, armed: bool) -> list[Frame]:
        """The frames that an outcome allows; whether motors make torque the safety module decides."""
        return self.gate.frames(outcome)

    def read(self, start_ns: int, frames: Sequence[Timed]) -> Reading:
        """Take the frames of a cycle in."""
        until_ns = start_ns + self.listen_ns
        for timed in frames:
            answers = self._answers_of.get(timed.frame.identifier)
            if answers is not None:
                answers.hear(timed, start_ns, until_ns)
            else:
                self._hear(timed.frame)
        if self._hears_force:
            self._read_force(start_ns, until_ns)
        fresh, age = self._read_positions(start_ns, until_ns)
        passed_ns = min(start_ns - self._before_ns, 2 * self.period_ns) if self._before_ns else 0
        self._mode_silent_ns += passed_ns
        self._pendant_silent_ns += passed_ns
        self._force_ns = self._force_ns or start_ns
        self._before_ns = start_ns
        self.cycle += 1
        lost = self._has_module and max(self._mode_silent_ns, self._pendant_silent_ns) > MODULE_LOST_NS
        foreign, self._foreign = self._foreign, False
        return Reading(
            positions=self._positions(fresh),
            doubted=self._doubted(fresh),
            age_ns=age,
            force=self._force if self._hears_force else None,
            force_saturated=self._force_saturated,
            force_missing_ns=start_ns - self._force_ns,
            sensor=self._has_sensor,
            temperatures=tuple(self._temperatures),
            module=None if lost else self._module,
            warning=self._warning,
            fault=self._fault,
            foreign_torque=foreign,
        )

    def _hear(self, frame: Frame) -> None:
        """Take in what is no answer of each cycle."""
        identifier = frame.identifier
        try:
            if identifier in _PROPERTIES:
                number, value = decode_value(frame.data)
                if number == self._temperature_number:
                    self._temperatures[_PROPERTIES.index(identifier)] = float(value)
            elif identifier == _MODULE:
                self._hear_module(frame.data)
            elif identifier in TORQUE_IDENTIFIERS:
                self._foreign = True
        except FrameError:
            self.strange_frames += 1

    def _read_positions(self, start_ns: int, until_ns: int) -> tuple[list[bool], int | None]:
        """Which motors' answers belong to this cycle's question and make sense, and how old (ns) the oldest of them is; None
        if one is missing."""
        is_asked, oldest, fresh = True, 0, list[bool]()
        for answers in self._position_answers:
            is_asked = is_asked and not answers.is_quiet(self.cycle)
        for motor, answers in enumerate(self._position_answers):
            age = answers.match(self.cycle, start_ns, until_ns, is_asked=is_asked)
            fresh.append(age is not None and self._position(motor, answers))
            if age is not None:
                oldest = max(oldest, age)
        return fresh, oldest if False not in fresh else None

    def _positions(self, fresh: list[bool]) -> tuple[float | None, ...]:
        """Angles (rad) of the joints all of whose motors have a fresh position; in plain numbers, with which the core is several
        times as fast as with those of NumPy."""
        one, two, three = [0.0 if counts is None else float(counts) for counts in self._counts]
        angles = self.robot.joint_angles((one, two, three))
        if False not in fresh:
            return angles
        return tuple([None if [m for m in _NEEDED[k] if not fresh[m]] else angle for k, angle in enumerate(angles)])

    def _doubted(self, fresh: list[bool]) -> tuple[bool, ...]:
        """By joint whether its position may be older than the cycle; empty if none is."""
        doubted = [fresh[motor] and answers.is_doubtful for motor, answers in enumerate(self._position_answers)]
        return tuple([True in [doubted[m] for m in needed] for needed in _NEEDED]) if True in doubted else ()

    def _read_force(self, start_ns: int, until_ns: int) -> None:
        """Match the force sensor's answers to its questions."""
        answers = self._force_answers
        is_asked = not answers.is_quiet(self.cycle)
        if answers.match(self.cycle, start_ns, until_ns, is_asked=is_asked) is None:
            return
        try:
            (x, y, z), status = unpack_counts(answers.data)
        except FrameError:
            self.strange_frames += 1
            return
        self._force = proficio.times(self._force_axes, (x / _NEWTONS, y / _NEWTONS, z / _NEWTONS))
        self._force_saturated = status & GAUGES != 0
        self._has_sensor = True
        if not answers.is_doubtful:  # else it may be as old as both questions are apart
            self._force_ns = start_ns

    def _position(self, motor: int, answers: Answers) -> bool:
        """Take the position of a motor; not if two nodes answer differently in its name, or it makes no sense."""
        before = self._counts[motor]
        try:
            counts = motor_counts(answers.data)
        except FrameError:
            self.strange_frames += 1
            return False
        if answers.is_contradicted:
            self.strange_frames += 1
            return False
        self._counts[motor] = counts if before is None else nearest_turn(counts, before)
        return True

    def _hear_module(self, data: bytes) -> None:
        assert self.robot.module is not None
        number, value = decode_value(data)
        if number == self.robot.module["MODE"]:
            self._module = Module(decode_mode(value))
            self._mode_silent_ns = 0
        elif number == self.robot.module["PEN"]:
            if value != self._pendant:
                pendant = decode_pendant(value)
                self._warning, self._fault = quantities(pendant, Level.WARNING), quantities(pendant, Level.FAULT)
                self._pendant = value
            self._pendant_silent_ns = 0

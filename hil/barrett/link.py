"""The frames of a session with a Barrett robot: questions, what answers say, torques."""

from collections.abc import Collection, Mapping, Sequence
from typing import Final, Protocol

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
_NEEDED: Final = [frozenset(np.flatnonzero(row).tolist()) for row in proficio.MOTOR_TO_JOINT]
# Identifiers by motor.
_POSITIONS: Final = [answer_of(k + 1, Group.POSITIONS) for k in range(proficio.JOINTS)]
_PROPERTIES: Final = [answer_of(k + 1, Group.PROPERTIES) for k in range(proficio.JOINTS)]
_FORCE: Final = answer_of(Node.FORCE_SENSOR, Group.FORCE)
_MODULE: Final = answer_of(Node.SAFETY, Group.PROPERTIES)
# What is asked for in each cycle, by identifier: the positions of each motor, then the force.
_SLOT_OF: Final = {identifier: slot for slot, identifier in enumerate((*_POSITIONS, _FORCE))}
_SLOTS: Final = proficio.JOINTS + 1
_FORCE_SLOT: Final = proficio.JOINTS


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

    def joint_angles(self, counts: Sequence[float]) -> list[float]:
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
        self._counts: list[int | None] = [None] * proficio.JOINTS
        self._force_axes: proficio.Matrix = tuple(map(tuple, force_axes.tolist()))
        self._force: tuple[float, ...] = (0.0, 0.0, 0.0)
        self._force_ns = 0
        self._force_saturated = False
        self._temperatures: list[float | None] = [None] * proficio.JOINTS
        absent = Module.WAIVED if MODULE in waived else Module.ABSENT
        self._module: Module | None = absent if robot.module is None else None
        # A sensor that has not answered yet is none: nobody knows the force with which the arm would be armed.
        self._has_sensor = robot.sensor is None and SENSOR in waived
        # Time in cycles since the module has said its mode, and what it watches; while the session stood still nobody asked it.
        self._mode_silent_ns = self._pendant_silent_ns = 0
        self._warning = self._fault = self._foreign = False
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
        robot, frames, before = self.robot, list[Frame](), [0] * _SLOTS
        for timed in arrived:
            slot = _SLOT_OF.get(timed.frame.identifier, -1)
            if slot >= 0:
                before[slot] += 1
        if not self._is_quiet(before):
            frames.append(self._ask_positions)
        if self._ask_force is not None and not self._force_answers.would_be_quiet(self.cycle, before[_FORCE_SLOT]):
            frames.append(self._ask_force)
        if robot.module is not None and self.cycle % self._module_every in (0, self._module_every // 2):
            name = "MODE" if self.cycle % self._module_every == 0 else "PEN"
            frames.append(Frame(to_node(Node.SAFETY), encode_request(robot.module[name])))
        turn, rest = divmod(self.cycle, self._temperature_every)
        if rest == self._temperature_every - 1:
            motor = turn % proficio.JOINTS + 1
            frames.append(Frame(to_node(motor), encode_request(robot.motor["TEMP"])))
        return frames

    def _is_quiet(self, arrived: list[int]) -> bool:
        """Whether positions are not asked for in this cycle, as an older question for them is open."""
        for motor, answers in enumerate(self._position_answers):
            if answers.would_be_quiet(self.cycle, arrived[motor]):
                return True
        return False

    def frames(self, outcome: Outcome, armed: bool) -> list[Frame]:
        """The frames that an outcome allows; whether motors make torque the safety module decides."""
        return self.gate.frames(outcome)

    def read(self, start_ns: int, frames: Sequence[Timed]) -> Reading:
        """Take the frames of a cycle in."""
        fresh, age = self._take(start_ns, frames)
        passed_ns = min(start_ns - self._before_ns, 2 * self.period_ns) if self._before_ns else 0
        self._mode_silent_ns += passed_ns
        self._pendant_silent_ns += passed_ns
        self._force_ns = self._force_ns or start_ns
        self._before_ns = start_ns
        self.cycle += 1
        positions: tuple[float | None, ...] = tuple(self._angles())
        if len(fresh) < proficio.JOINTS:
            positions = tuple([positions[k] if _NEEDED[k] <= fresh else None for k in range(proficio.JOINTS)])
        doubted = {motor for motor in fresh if self._position_answers[motor].is_doubtful}
        lost = self._has_module and max(self._mode_silent_ns, self._pendant_silent_ns) > MODULE_LOST_NS
        foreign, self._foreign = self._foreign, False
        return Reading(
            positions=positions,
            doubted=tuple([bool(_NEEDED[k] & doubted) for k in range(proficio.JOINTS)]) if doubted else (),
            age_ns=age if len(fresh) == proficio.JOINTS else None,
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

    def _take(self, start_ns: int, frames: Sequence[Timed]) -> tuple[set[int], int]:
        """The motors whose position answers this cycle's question, and in time; and how old (ns) the oldest of those
        answers is."""
        # By slot: how many answers came before the cycle, when the others did, and what they say.
        before, times, answers = [0] * _SLOTS, [list[int]() for _ in _SLOT_OF], [list[bytes]() for _ in _SLOT_OF]
        for timed in frames:
            at, identifier, data = timed.time_ns, timed.frame.identifier, timed.frame.data
            slot = _SLOT_OF.get(identifier, -1)
            if slot >= 0:
                if at <= start_ns:
                    before[slot] += 1
                else:
                    times[slot].append(at)
                    answers[slot].append(data)
                continue
            try:
                if identifier in _PROPERTIES:
                    number, value = decode_value(data)
                    if number == self._temperature_number:
                        self._temperatures[_PROPERTIES.index(identifier)] = float(value)
                elif identifier == _MODULE:
                    self._hear_module(data)
                elif identifier in TORQUE_IDENTIFIERS:
                    self._foreign = True
            except FrameError:
                self.strange_frames += 1
        if self._hears_force:
            self._read_force(start_ns, before[_FORCE_SLOT], times[_FORCE_SLOT], answers[_FORCE_SLOT])
        return self._read_positions(start_ns, before, times, answers)

    def _read_positions(
        self, start_ns: int, before: list[int], times: list[list[int]], answers: list[list[bytes]]
    ) -> tuple[set[int], int]:
        """Match answers to questions: those from before the cycle, or from after its time, belong to an older one."""
        until_ns, fresh, oldest = start_ns + self.listen_ns, set[int](), 0
        is_asked = not self._is_quiet(before)
        for motor, matcher in enumerate(self._position_answers):
            matcher.belated(before[motor])
            if is_asked:
                matcher.asked(self.cycle, start_ns)
            age = matcher.match(times[motor], until_ns, is_asked=is_asked)
            if age is None:
                continue
            in_time = [data for k, data in enumerate(answers[motor]) if times[motor][k] <= until_ns]
            if self._position(motor, in_time):
                fresh.add(motor)
                oldest = max(oldest, age)
        return fresh, oldest

    def _read_force(self, start_ns: int, before: int, times: list[int], answers: list[bytes]) -> None:
        """The same for the force sensor's answers."""
        matcher = self._force_answers
        is_asked = not matcher.would_be_quiet(self.cycle, before)
        matcher.belated(before)
        if is_asked:
            matcher.asked(self.cycle, start_ns)
        if matcher.match(times, start_ns + self.listen_ns, is_asked=is_asked) is None:
            return
        try:
            reading = unpack_reading(Group.FORCE, answers[0])
        except FrameError:
            self.strange_frames += 1
            return
        self._force = tuple(proficio.times(self._force_axes, reading[:3]))
        self._force_saturated = reading.status is not None and bool(reading.status.saturated_gauges)
        self._has_sensor = True
        if not matcher.is_doubtful:  # else it may be as old as both questions are apart
            self._force_ns = start_ns

    def _position(self, motor: int, answers: Sequence[bytes]) -> bool:
        """Take the position of a motor; not if two nodes answer differently in its name, or it makes no sense."""
        try:
            counts, before = motor_counts(answers[0]), self._counts[motor]
        except FrameError:
            self.strange_frames += 1
            return False
        if answers.count(answers[0]) < len(answers):
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
            levels = decode_pendant(value)[4:]
            self._warning, self._fault = Level.WARNING in levels, Level.FAULT in levels
            self._pendant_silent_ns = 0

    def _angles(self) -> list[float]:
        """As plain numbers: the core computes several times as long with those of NumPy."""
        return self.robot.joint_angles([0.0 if c is None else float(c) for c in self._counts])

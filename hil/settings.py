"""What a session needs to know beforehand, in a TOML file; one line of it says whether the robot is real."""

import json
import math
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, fields, replace
from pathlib import Path
from typing import Any

import numpy as np

from fmus.errors import MisfitError
from hil.bench_values import GAINS, JOINTS, LIMITS, PLACES, check_effect_is_seen, check_numbers, check_proof, table_of
from hil.control.controllers import Asked, Controller, Hold, Passive
from hil.control.proof import Proof
from hil.emulation.planar import Placement
from hil.emulation.settings import Learning
from hil.robots.absent import KEYS
from hil.robots.base import RobotKind
from hil.robots.known import PROFICIO, robot_kind
from hil.robots.proficio import Side
from hil.safety.limits import JointLimits, Limits, Zone, lowered
from hil.stimulation.plan import Plan, plan_of_json
from hil.trials.protocol import Protocol as ProtocolOfTrials
from hil.trials.protocol import protocol_of_json

# Until the kind of robot has said its own.
_NO_LIMITS = Limits((JointLimits(1.0, 1.0, 1.0, -1.0, 1.0),))
# A force sensor in pounds or grams-force is not off by more than this.
_MOST_STRETCH = 10.0
_AS_IT_IS = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
# A virtual robot shares the machine with the session, and stands still whenever the machine lets it: for so long it is
# waited for, and let go after three times that. Virtual machines were seen to stand still for 50 ms with all that runs on them: a session
# with a robot that can hurt nobody bears twice that.
_VIRTUAL_PATIENCE_S = 0.1


# Keys of `[robot]` that every kind of robot has; others are its own.
_OF_ALL_ROBOTS = ("kind", "side", "gravity", "shoulder", "proof", "proof_torque", "force_axes", *KEYS)


@dataclass(frozen=True)
class Settings:
    """A session's settings.

    `bus` is what python-can takes; `gravity` whether the arm's weight must be held; stiffness in N.m/rad and damping in
    N.m.s/rad by joint are those of the posture that `hold` keeps, `source` the model of a controller `fmu`. With a
    `protocol` the session runs its trials, from number `first_trial` on: `shoulder` rad says how the emulated arm lies
    on the robot, `learning` how what its model lacks is learned. With `proof` an armed arm first shows that it stands
    still and that each joint turns its way, under `proof_torque` N.m at most. `force_axes` (3, 3) turns what the force
    sensor shows into the wrist's axes, since how it is mounted, its signs and its scale are nowhere published. `waived`
    are safeguards that the bench may do without (see `hil.robots.absent`); its limits are lowered already. `robot` is
    the kind of robot, `options` the keys of `[robot]` that are its own. With a `stimulation`
    postures are held by emulated muscles.
    """

    bus: Mapping[str, Any]
    side: Side
    gravity: bool
    limits: Limits
    controller: str = "hold"
    source: str = ""
    stiffness: tuple[float, ...] = (40.0, 40.0, 20.0)
    damping: tuple[float, ...] = (2.0, 2.0, 1.0)
    shoulder: float = Placement.shoulder
    protocol: ProtocolOfTrials | None = None
    first_trial: int = 1
    learning: Learning = Learning()
    proof: bool = False
    proof_torque: tuple[float, ...] = (4.0, 4.0, 3.0)
    force_axes: tuple[tuple[float, ...], ...] = _AS_IT_IS
    waived: tuple[str, ...] = ()
    robot: str = PROFICIO
    options: Mapping[str, Any] = field(default_factory=dict)
    stimulation: Plan | None = None

    def __post_init__(self) -> None:
        """Refuse gains that drive the arm, axes of the force sensor that lose a direction, a trial that there is not."""
        for name in ("stiffness", "damping", "proof_torque"):
            for value in getattr(self, name):
                if not (math.isfinite(value) and value >= 0):
                    raise MisfitError(
                        f"{name} = {value:g}; a finite number of zero or more was expected for each joint"
                    )
        if not math.isfinite(self.shoulder):
            raise MisfitError(f"shoulder = {self.shoulder:g} rad; a finite angle was expected")
        axes = np.array(self.force_axes, dtype=float) if {len(row) for row in self.force_axes} == {3} else np.zeros(3)
        if axes.shape != (3, 3) or not np.all(np.isfinite(axes)) or abs(np.linalg.det(axes)) < 1e-6:
            raise MisfitError("force_axes need three rows of three numbers that do not lie in a plane")
        stretched = np.linalg.svd(axes, compute_uv=False)
        if stretched[0] > _MOST_STRETCH or stretched[-1] < 1 / _MOST_STRETCH:
            raise MisfitError(
                f"force_axes make a force {stretched[-1]:.3g} to {stretched[0]:.3g} times as large; {1 / _MOST_STRETCH:g} to"
                f" {_MOST_STRETCH:g} was expected, as the limit of the force would mean little"
            )
        if self.protocol is not None and not 1 <= self.first_trial <= len(self.protocol.trials):
            trials = len(self.protocol.trials)
            raise MisfitError(f"there is no trial {self.first_trial} to begin with; the protocol has 1 to {trials}")

    @property
    def kind(self) -> RobotKind:
        """The kind of robot, which knows its bus.

        Raises:
            MisfitError: if there is none of that name, or its keys do not fit.
        """
        own = {"side": self.side} if self.robot == PROFICIO else {}
        return robot_kind(self.robot, {**own, **self.options})

    def make_proof(self) -> Proof | None:
        """What the arm has to prove once it is armed; nothing if the settings do not ask for it."""
        if not self.proof:
            return None
        middles = np.array([0.5 * (joint.low + joint.high) for joint in self.limits.joints])
        return Proof(middles, np.array(self.proof_torque))

    def make_controller(self) -> Controller:
        """The controller that is named, or that of the protocol.

        Raises:
            MisfitError: if there is none of that name, or a model cannot be built.
        """
        stiffness, damping = np.array(self.stiffness), np.array(self.damping)
        if self.protocol is not None:
            from hil.trials.controller import Trials

            trials = Trials(self.protocol, Placement(self.side, self.shoulder), stiffness, damping, self.learning)
            trials.course.trial = self.first_trial
            return trials
        if self.stimulation is not None:
            from hil.stimulation.controller import Stimulation

            return Stimulation(self.stimulation, Placement(self.side, self.shoulder), stiffness, damping)
        if self.controller == "hold":
            return Hold(self.stiffness, self.damping)
        if self.controller == "asked":
            return Asked()
        if self.controller == "passive":
            return Passive()
        if self.controller == "fmu":
            if not self.source:
                raise MisfitError("the controller is an FMU, and `source` does not say which; name a file or a model")
            from hil.emulation.fmu_controller import FmuController

            return FmuController(self.source)
        raise MisfitError(f"controller {self.controller!r} is not known; there are hold, passive and fmu")

    def to_json(self) -> dict[str, Any]:
        """All of it, for a recording."""
        return {**asdict(self), "bus": dict(self.bus), "options": dict(self.options)}


def default_settings(
    side: Side = "right", rate_hz: float = 500.0, robot: str = PROFICIO, options: Mapping[str, Any] | None = None
) -> Settings:
    """Settings of a robot on a bus that is still to be named; `options` are the keys of its kind.

    Args:
        side: of the arm.
        rate_hz: cycles a second.
        robot: name of its kind.
        options: keys of that kind.

    Raises:
        MisfitError: if the rate is not between 10 and 1000 Hz, or there is no such kind.
    """
    found = Settings({}, side, True, _NO_LIMITS, robot=robot, options=options or {})
    kind = found.kind
    return replace(found, limits=kind.limits(rate_hz), **kind.gains()._asdict())


def virtual_settings(
    side: Side = "right", rate_hz: float = 500.0, robot: str = PROFICIO, options: Mapping[str, Any] | None = None
) -> Settings:
    """Settings of a virtual robot, which has no weight to hold; more patient than those of a real one.

    Drives alone have neither safety module nor force sensor: virtual ones may do without, with lower limits as always.

    Args:
        side: of the arm.
        rate_hz: cycles a second.
        robot: name of its kind.
        options: keys of that kind.

    Raises:
        MisfitError: if the rate is not between 10 and 1000 Hz.
    """
    found = default_settings(side, rate_hz, robot, options)
    waived = () if robot == PROFICIO else tuple(KEYS.values())
    limits = lowered(found.limits) if waived else found.limits
    comply = max(limits.missing_comply_s, _VIRTUAL_PATIENCE_S)
    patient = replace(
        limits,
        missing_comply_s=comply,
        missing_release_s=max(limits.missing_release_s, 3 * comply),
        late_comply_s=_VIRTUAL_PATIENCE_S,
        stall_s=_VIRTUAL_PATIENCE_S,
    )
    return replace(found, gravity=False, limits=patient, waived=waived)


def read_settings(path: Path, rate_hz: float = 500.0) -> Settings:
    """Read a bench file: tables `[bus]`, `[robot]` (side, gravity), `[limits]`, `[[joints]]`, `[controller]`.

    Raises:
        MisfitError: if the file cannot be read, or says what cannot be.
    """
    try:
        document = tomllib.loads(path.read_text())
    except OSError as error:
        raise MisfitError(f"{path} cannot be read: {error.strerror}") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise MisfitError(f"{path} is no TOML file: {error}") from error
    return _settings(document, str(path), rate_hz)


def settings_of_json(text: str) -> Settings:
    """Settings of a recording."""
    document = json.loads(text)
    limits = document.pop("limits")
    limits.pop("divergence", None)  # of a rule that older recordings had and that never applied
    joints = tuple(JointLimits(**_with_zones(joint)) for joint in limits.pop("joints"))
    document |= {name: tuple(document[name]) for name in ("stiffness", "damping", "proof_torque")}
    document["force_axes"] = tuple(map(tuple, document.get("force_axes", _AS_IT_IS)))
    document["waived"] = tuple(document.get("waived", ()))
    protocol = document.pop("protocol", None)
    trials = protocol_of_json(protocol) if protocol is not None else None
    learning = Learning(**document.pop("learning", {}))
    plan = document.pop("stimulation", None)
    stimulation = plan_of_json(plan) if plan is not None else None
    limits = Limits(joints, **limits)
    return Settings(limits=limits, protocol=trials, learning=learning, stimulation=stimulation, **document)


def _settings(document: dict[str, Any], name: str, rate_hz: float) -> Settings:
    _known(document, ("bus", "robot", "limits", "joints", "controller", "learning"), name)
    try:
        robot, controller = table_of(document, "robot"), table_of(document, "controller")
        bus, wanted, learning = (table_of(document, key) for key in ("bus", "limits", "learning"))
    except MisfitError as error:
        raise MisfitError(f"{name}: {error}") from error
    _known(controller, ("kind", "source", "stiffness", "damping"), f"{name} [controller]")
    side, kind = robot.get("side", "right"), str(robot.get("kind", PROFICIO))
    options = {key: value for key, value in robot.items() if key not in _OF_ALL_ROBOTS}
    if kind == PROFICIO:
        _known(options, _OF_ALL_ROBOTS, f"{name} [robot]")
    try:
        found = default_settings(side, rate_hz, kind, options)
        limits = found.limits
        limits = replace(limits, joints=_joints(document.get("joints", []), limits.joints))
        _known(wanted, [f.name for f in fields(Limits)[2:]], "[limits]")
        check_numbers(wanted, LIMITS)
        limits = replace(limits, **wanted)
        waived = tuple(words for key, words in KEYS.items() if _switch(robot, key, False))
        limits = lowered(limits) if waived else limits
        for number, joint in enumerate(limits.joints, start=1):
            if math.isfinite(joint.breakaway):  # a kind of robot that does not know it is told of on the screen
                check_effect_is_seen(number, joint)
        gravity = _switch(robot, "gravity", True)
        found = replace(found, bus=bus, limits=limits, gravity=gravity, waived=waived)
        given = {**controller, **robot}
        check_numbers(given, GAINS)
        check_numbers(robot, PLACES)
        lists: dict[str, Any] = {
            key: tuple(map(float, given[key])) for key in ("stiffness", "damping", "proof_torque") if key in given
        }
        if any(len(values) != len(limits.joints) for values in lists.values()):
            raise MisfitError(f"stiffness, damping and proof_torque need {len(limits.joints)} numbers each")
        found = replace(found, proof=_switch(robot, "proof", True))
        _known(learning, [f.name for f in fields(Learning)], "[learning]")
        found = replace(found, learning=Learning(**learning), shoulder=float(robot.get("shoulder", found.shoulder)))
        rows = tuple(tuple(map(float, row)) for row in robot.get("force_axes", _AS_IT_IS))
        kind, source = str(controller.get("kind", "hold")), str(controller.get("source", ""))
        if found.proof:
            check_proof(lists.get("proof_torque", ()), limits.joints)
        return replace(found, controller=kind, source=source, force_axes=rows, **lists)
    except MisfitError as error:
        raise MisfitError(f"{name}: {error}") from error
    except (TypeError, ValueError, IndexError) as error:
        raise MisfitError(f"{name} has a value of the wrong kind: {error}; see docs/bench.md") from error


def _joints(tables: Sequence[Mapping[str, Any]], usual: Sequence[JointLimits]) -> tuple[JointLimits, ...]:
    """Limits of all joints: the usual ones with what the tables say, one table a joint, or by its number `joint`."""
    joints, seen = list(usual), set[int]()
    if not isinstance(tables, list) or not all(isinstance(table, Mapping) for table in tables):
        raise MisfitError("[joints]: write one table [[joints]] for each joint, with two brackets on each side")
    for place, table in enumerate(tables, start=1):
        number = table.get("joint", place)
        if isinstance(number, bool) or not isinstance(number, int) or not 1 <= number <= len(joints):
            raise MisfitError(f"[[joints]]: joint = {number!r}; a robot with {len(joints)} joints was expected")
        if number in seen:
            raise MisfitError(f"[[joints]] has two tables for joint {number}; merge them")
        seen.add(number)
        given = {key: value for key, value in table.items() if key != "joint"}
        _known(given, [f.name for f in fields(JointLimits)], "[[joints]]")
        try:
            check_numbers(given, JOINTS)
            joints[number - 1] = replace(joints[number - 1], **_with_zones(given))
            if "breakaway" in given:
                check_effect_is_seen(number, joints[number - 1])
        except MisfitError as error:
            raise MisfitError(f"[[joints]] of joint {number}: {error}") from error
    return tuple(joints)


def _switch(table: Mapping[str, Any], key: str, otherwise: bool) -> bool:
    """A value that is true or false."""
    if not isinstance(found := table.get(key, otherwise), bool):
        raise MisfitError(f"[robot] {key} = {found!r}; true or false was expected")
    return found


def _with_zones(joint: Mapping[str, Any]) -> dict[str, Any]:
    """Arguments of a joint's limits from a table."""
    return {**joint, "zones": tuple(Zone(**zone) for zone in joint["zones"])} if "zones" in joint else dict(joint)


def _known(table: Mapping[str, Any], names: Any, where: str) -> None:
    for key in table:
        if key not in names:
            raise MisfitError(f"{where} has {key!r}, which is not known; there are {', '.join(names)}")

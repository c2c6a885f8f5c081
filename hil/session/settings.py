"""What a session needs to know beforehand, in a TOML file; one line of it says whether the robot is real."""

import json
import math
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, fields, replace
from pathlib import Path
from typing import Any

import numpy as np

from fmus.errors import MisfitError
from hil.emulation.planar import Placement
from hil.emulation.settings import Learning
from hil.robots import proficio
from hil.robots.proficio import Side
from hil.safety.limits import JointLimits, Limits, Zone, lowered
from hil.session.absent import KEYS
from hil.session.controllers import Asked, Controller, Hold, Passive
from hil.session.proof import Proof
from hil.trials.protocol import Protocol as ProtocolOfTrials
from hil.trials.protocol import protocol_of_json

# Ranges are those in which examples move a Proficio; torques are below the controllers' own limits of 31, 17, 31 N.m.
_RANGES = {
    "right": ((-1.1, 0.5), (-1.05, 1.05), (0.05, 2.9)),
    "left": ((-1.1, 0.5), (-1.05, 1.05), (-2.9, -0.05)),
}
_TORQUES, _RATE, _SPEED = (20.0, 15.0, 12.0), 2000.0, 1.5
# N.m under which the proof shows that each joint turns; more moves it for certain.
_PROOF_TORQUES = (4.0, 4.0, 3.0)
# rad/s by which a joint may speed up though nothing known pushes it: half of what it may do at all.
_UNEXPLAINED = 0.5 * _SPEED
_AS_IT_IS = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
# A virtual robot shares the machine with the session, and stands still whenever the machine lets it: for so long it is
# waited for, and let go after three times that.
_VIRTUAL_PATIENCE_S = 0.02


@dataclass(frozen=True)
class Settings:
    """A session's settings.

    `bus` is what python-can takes; `gravity` whether the arm's weight must be held; stiffness in N.m/rad and damping in
    N.m.s/rad by joint are those of the posture that `hold` keeps, `source` the model of a controller `fmu`. With a `protocol` the session runs its trials, from number `first_trial` on: `shoulder`
    rad says how the emulated arm lies on the robot, `learning` how what its model lacks is learned. With `proof` an armed arm
    first shows that it stands still and that each joint turns its way, under `proof_torque` N.m at most. `force_axes` (3, 3) turns
    what the force sensor shows into the wrist's axes, since how it is mounted, its signs and its scale are nowhere published. `waived` are safeguards that the bench
    may do without (see `hil.session.absent`); its limits are lowered already.
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
    proof_torque: tuple[float, ...] = _PROOF_TORQUES
    force_axes: tuple[tuple[float, ...], ...] = _AS_IT_IS
    waived: tuple[str, ...] = ()

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
        if self.protocol is not None and not 1 <= self.first_trial <= len(self.protocol.trials):
            trials = len(self.protocol.trials)
            raise MisfitError(f"there is no trial {self.first_trial} to begin with; the protocol has 1 to {trials}")

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
        if self.controller == "hold":
            return Hold(stiffness, damping)
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
        return {**asdict(self), "bus": dict(self.bus)}


def default_settings(side: Side = "right", rate_hz: float = 500.0) -> Settings:
    """Settings of a Proficio on a bus that is still to be named.

    Raises:
        MisfitError: if the rate is not between 10 and 1000 Hz.
    """
    if not 10 <= rate_hz <= 1000:
        raise MisfitError(f"a rate of {rate_hz:g} Hz is outside [10, 1000] Hz")
    joints = tuple(
        JointLimits(torque, _RATE, _SPEED, low, high, breakaway=breakaway)
        for torque, breakaway, (low, high) in zip(_TORQUES, _PROOF_TORQUES, _RANGES[side], strict=True)
    )
    return Settings({}, side, True, _limits(joints, rate_hz))


def _limits(joints: tuple[JointLimits, ...], rate_hz: float) -> Limits:
    """Limits whose times leave a few cycles at low rates, too: one lost answer must not stop the arm."""
    period = 1.0 / rate_hz
    usual = Limits(joints)
    return Limits(
        joints,
        period_ns=round(1e9 * period),
        missing_comply_s=max(usual.missing_comply_s, 2.5 * period),
        missing_release_s=max(usual.missing_release_s, 4.5 * period),
        late_comply_s=max(usual.late_comply_s, 5 * period),
        force_missing_s=max(usual.force_missing_s, 3.5 * period),
        unexplained=_UNEXPLAINED,
    )


def virtual_settings(side: Side = "right", rate_hz: float = 500.0) -> Settings:
    """Settings of a virtual Proficio, which has no weight to hold; more patient than those of a real one.

    Raises:
        MisfitError: if the rate is not between 10 and 1000 Hz.
    """
    found = default_settings(side, rate_hz)
    limits = found.limits
    comply = max(limits.missing_comply_s, _VIRTUAL_PATIENCE_S)
    patient = replace(limits, missing_comply_s=comply, missing_release_s=max(limits.missing_release_s, 3 * comply))
    return replace(found, gravity=False, limits=patient)


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
    joints = tuple(JointLimits(**_with_zones(joint)) for joint in limits.pop("joints"))
    document |= {name: tuple(document[name]) for name in ("stiffness", "damping", "proof_torque")}
    document["force_axes"] = tuple(map(tuple, document.get("force_axes", _AS_IT_IS)))
    document["waived"] = tuple(document.get("waived", ()))
    protocol = document.pop("protocol", None)
    trials = protocol_of_json(protocol) if protocol is not None else None
    learning = Learning(**document.pop("learning", {}))
    return Settings(limits=Limits(joints, **limits), protocol=trials, learning=learning, **document)


def _settings(document: dict[str, Any], name: str, rate_hz: float) -> Settings:
    _known(document, ("bus", "robot", "limits", "joints", "controller", "learning"), name)
    robot, controller = document.get("robot", {}), document.get("controller", {})
    _known(robot, ("side", "gravity", "shoulder", "proof", "proof_torque", "force_axes", *KEYS), f"{name} [robot]")
    _known(controller, ("kind", "source", "stiffness", "damping"), f"{name} [controller]")
    side = robot.get("side", "right")
    if side not in proficio.HOME:
        raise MisfitError(f"{name}: side = {side!r}; left or right was expected")
    found = default_settings(side, rate_hz)
    limits = found.limits
    try:
        limits = replace(limits, joints=_joints(document.get("joints", []), limits.joints, name))
        wanted = document.get("limits", {})
        _known(wanted, [f.name for f in fields(Limits)[2:]], f"{name} [limits]")
        limits = replace(limits, **wanted)
        waived = tuple(words for key, words in KEYS.items() if _switch(robot, key, False))
        limits = lowered(limits) if waived else limits
        gravity = _switch(robot, "gravity", True)
        found = replace(found, bus=document.get("bus", {}), limits=limits, gravity=gravity, waived=waived)
        given = {**controller, **robot}
        lists: dict[str, Any] = {
            key: tuple(map(float, given[key])) for key in ("stiffness", "damping", "proof_torque") if key in given
        }
        if any(len(values) != proficio.JOINTS for values in lists.values()):
            raise MisfitError(f"stiffness, damping and proof_torque need {proficio.JOINTS} numbers each")
        found = replace(found, proof=_switch(robot, "proof", True))
        wanted = document.get("learning", {})
        _known(wanted, [f.name for f in fields(Learning)], f"{name} [learning]")
        found = replace(found, learning=Learning(**wanted), shoulder=float(robot.get("shoulder", found.shoulder)))
        rows = tuple(tuple(map(float, row)) for row in robot.get("force_axes", _AS_IT_IS))
        kind, source = str(controller.get("kind", "hold")), str(controller.get("source", ""))
        return replace(found, controller=kind, source=source, force_axes=rows, **lists)
    except MisfitError as error:
        raise MisfitError(f"{name}: {error}") from error
    except (TypeError, ValueError, IndexError) as error:
        raise MisfitError(f"{name} has a value of the wrong kind: {error}; see docs/bench.md") from error


def _joints(tables: Sequence[Mapping[str, Any]], usual: Sequence[JointLimits], name: str) -> tuple[JointLimits, ...]:
    """Limits of all joints: the usual ones with what the tables say, one table a joint, or by its number `joint`."""
    joints, seen = list(usual), set[int]()
    for place, table in enumerate(tables, start=1):
        number = table.get("joint", place)
        if not isinstance(number, int) or not 1 <= number <= len(joints):
            raise MisfitError(f"[[joints]]: joint = {number!r}; a robot with {len(joints)} joints was expected")
        if number in seen:
            raise MisfitError(f"[[joints]] has two tables for joint {number}; merge them")
        seen.add(number)
        given = {key: value for key, value in table.items() if key != "joint"}
        _known(given, [f.name for f in fields(JointLimits)], f"{name} [[joints]]")
        try:
            joints[number - 1] = replace(joints[number - 1], **_with_zones(given))
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

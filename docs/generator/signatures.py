"""What an effect does to a plant: simulated with and without it, by the models that the diagnosis uses."""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import casadi as ca
import numpy as np

from docs.generator.plants import Plant
from docs.generator.scenes import Group, Scene
from fmus.catalogue import find_modelica_model
from fmus.symbolic.system import SymbolicSystem, Variable
from orchestrator.models.correction import PREFIX
from orchestrator.models.patch import Attachment, check_attached, patched_model
from orchestrator.models.smoothing import second_difference
from orchestrator.models.symbolic import SymbolicModel


@dataclass(frozen=True, eq=False)
class Motion:
    """A simulated trial without noise: what `SmoothedTrial` is for a measured one; all of shape (n, ny)."""

    time: np.ndarray
    inputs: np.ndarray
    measured: np.ndarray

    @property
    def values(self) -> np.ndarray:
        """The outputs themselves."""
        return self.measured

    @cached_property
    def speeds(self) -> np.ndarray:
        """Their derivatives."""
        return np.asarray(np.gradient(self.measured, self.time, axis=0))

    @cached_property
    def accelerations(self) -> np.ndarray:
        """Their second derivatives."""
        return second_difference(self.measured, self.time)


@dataclass(frozen=True)
class Curve:
    """Numbers (n,) with their name and unit."""

    name: str
    unit: str
    values: np.ndarray


@dataclass(frozen=True)
class Signature:
    """An effect's trace: outputs with and without it, the force that a model without it lacks, and what that depends on.

    `parameters` are those of the effect in its slot, with the values shown in `shown`.
    """

    scene: Scene
    time: np.ndarray
    with_effect: Curve
    without: Curve
    missing: Curve
    against: Curve
    parameters: tuple[Variable, ...]
    shown: dict[str, float]


def signatures(group: Group) -> Iterator[Signature]:
    """The signature of each effect of a group; the others are absent meanwhile.

    Raises:
        AssertionError: if the model with all effects absent is not the plain one, so that one must stand `alone`.
    """
    plant = group.plant
    base = find_modelica_model(plant.model)
    plain = SymbolicModel(plant.model, base.compile())
    parts = [Attachment(slot, scene.card.class_name, {}) for slot, scene in group.slots.items()]
    system = patched_model(base, "Shown", parts).compile()
    check_attached(system, parts)
    model = SymbolicModel("Shown", system, plain.signals)
    off = _absent(group, system)
    without = _run(plain, plant, plain.compiled.parameters)
    if not any(scene.alone for scene in group.slots.values()):
        left = np.abs(_run(model, plant, off).measured - without.measured).max(axis=0) / np.ptp(
            without.measured, axis=0
        )
        assert left.max() < 1e-4, f"effects of {', '.join(s.name for s in group.slots.values())} do not vanish: {left}"
    for slot, scene in group.slots.items():
        values = off.copy()
        shown = _switched_on(values, slot, scene, system)
        yield _signature(scene, slot, plain, without, _run(model, plant, values), system, shown)


def _signature(
    scene: Scene,
    slot: str,
    plain: SymbolicModel,
    without: Motion,
    motion: Motion,
    system: SymbolicSystem,
    shown: dict[str, float],
) -> Signature:
    place = plain.signals.index(scene.signal)
    output = plain.outputs[place]
    own = tuple(v for v in system.parameters if v.name.startswith(f"{slot}."))
    return Signature(
        scene,
        motion.time,
        Curve(scene.signal, output.unit, motion.measured[:, place]),
        Curve(scene.signal, output.unit, without.measured[:, place]),
        _missing(scene, plain, motion),
        _coordinate(scene, plain, motion),
        own,
        shown,
    )


def _missing(scene: Scene, plain: SymbolicModel, motion: Motion) -> Curve:
    """The correction residual of the plain model along the motion that has the effect."""
    compiled = plain.compiled_residual
    inputs = plain.residual_inputs(motion)
    start = np.array(compiled.system.start_of_states(ca.DM(compiled.parameters))).ravel()
    run = compiled.run(motion.time, inputs, compiled.parameters, start)
    correction = next(v for v in plain.inputs if v.name == PREFIX + scene.signal)
    return Curve(f"missing {scene.plant.force}", correction.unit, run.outputs[:, plain.signals.index(scene.signal)])


def _coordinate(scene: Scene, plain: SymbolicModel, motion: Motion) -> Curve:
    place = plain.signals.index(scene.signal)
    unit, name, drive = plain.outputs[place].unit, scene.against, scene.plant.drive(motion.time)
    inputs = {v.name: v.unit for v in plain.inputs}
    rate_of = name.removeprefix("rate of ")
    if name == "time":
        return Curve(name, "s", motion.time)
    if name == "twist":
        first, second = (motion.measured[:, plain.signals.index(each)] for each in ("phiMotor", "phiLoad"))
        return Curve("phiMotor - phiLoad", unit, first - second)
    if rate_of != name:
        unit = {"m3/s": "m3/s2", "N.m": "N.m/s"}.get(inputs[rate_of], f"{inputs[rate_of]}/s")
        return Curve(name, unit, np.gradient(drive[rate_of], motion.time))
    if name in drive:
        return Curve(name, inputs[name], drive[name])
    series, suffix = {
        "position": (motion.measured, ""),
        "speed": (motion.speeds, "/s"),
        "acceleration": (motion.accelerations, "/s2"),
    }[name]
    word = {"position": scene.signal}.get(name, f"{name} of {scene.signal}")
    return Curve(word, unit + suffix, series[:, place])


def _run(model: SymbolicModel, plant: Plant, parameters: np.ndarray) -> Motion:
    time = plant.time
    drive = plant.drive(time)
    inputs = np.column_stack([drive.get(v.name, np.zeros_like(time)) for v in model.inputs])
    start = _settled(np.array(model.system.start_of_states(ca.DM(parameters))).ravel(), model)
    return Motion(time, inputs, model.compiled.run(time, inputs, parameters, start, substeps=4).outputs)


def _settled(start: np.ndarray, model: SymbolicModel) -> np.ndarray:
    """Start values where sensors with a lag already read what they measure."""
    names = [v.name for v in model.system.states]
    true = [start[i] for i, name in enumerate(names) if re.fullmatch(r"q|s|level\d", name)]
    lagging = [i for i, name in enumerate(names) if re.match(r"(joint|length|level)Sensor\d\.", name)]
    for i, value in zip(lagging, true, strict=False):
        start[i] = value
    return start


def _absent(group: Group, system: SymbolicSystem) -> np.ndarray:
    """Parameters with all effects absent, as far as an absent value is within its bounds."""
    values = np.array([v.start for v in system.parameters], dtype=float)
    for slot, scene in group.slots.items():
        for parameter in scene.card.parameters:
            for i in _elements(system, slot, parameter.name):
                declared = system.parameters[i]
                low = -np.inf if declared.minimum is None else declared.minimum
                high = np.inf if declared.maximum is None else declared.maximum
                if np.isfinite(parameter.meaningful) and low <= parameter.absent <= high:
                    values[i] = parameter.absent
    return values


def _switched_on(values: np.ndarray, slot: str, scene: Scene, system: SymbolicSystem) -> dict[str, float]:
    """Set one effect to what its scene shows; return the values by name of parameter or element."""
    named = {name.split("[")[0] for name in scene.values}
    whole = {p.name: p.start for p in scene.card.parameters if p.name not in named}
    shown = {**whole, **scene.values}
    for name, value in shown.items():
        for i in _elements(system, slot, name):
            values[i] = value
    return shown


def _elements(system: SymbolicSystem, slot: str, name: str) -> list[int]:
    """Places of a parameter of an effect, of all its elements, or of the one element that is named."""
    pattern = re.compile(rf"{slot}\.{re.escape(name)}(\[.*\])?")
    found = [i for i, v in enumerate(system.parameters) if pattern.fullmatch(v.name)]
    assert found, f"{slot} has no parameter {name}"
    return found

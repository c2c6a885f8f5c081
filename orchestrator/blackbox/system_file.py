"""An FMU or a system with effects as a system: the original, one FMU for each effect, and a file that connects them."""

import math
import re
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import MappingProxyType

import numpy as np

from fmus.catalogue import ModelicaModel
from fmus.files import write_atomically
from fmus.package import build_fmu
from fmus.symbolic.system import SymbolicSystem
from orchestrator.blackbox.coupled import Mounted
from orchestrator.blackbox.extended import beside, extended
from orchestrator.blackbox.library import CLASSES, FORCE_SLOTS, INPUT_SLOTS, OUTPUT_SLOTS, PARAMETER_SLOT, Scales
from orchestrator.blackbox.sites import ForceSite
from orchestrator.blackbox.source import FmuSource, fmu_model
from orchestrator.blackbox.system_source import SystemFile
from orchestrator.cosim.fmu.description import read_description
from orchestrator.cosim.system import ComponentSpec, Connection, RunSettings, System, Value
from orchestrator.cosim.toml_file import write_toml
from orchestrator.measurements import MeasurementSet, bind
from orchestrator.models.smoothing import SmoothedTrial
from orchestrator.models.symbolic import ROUGH, enough_substeps

PLANT = "plant"
# A lag that is this share of a step has settled at its end.
SHARE_OF_STEP = 0.1


@dataclass
class _Plan:
    """Components by name, connections, and what drives and shows the system."""

    components: dict[str, str] = field(default_factory=dict)
    connections: list[tuple[str, str]] = field(default_factory=list)
    inputs: dict[str, tuple[str, ...]] = field(default_factory=dict)
    outputs: dict[str, str] = field(default_factory=dict)
    # Where the outputs of what is extended come from, and how its sensed variables begin.
    shown: dict[int, str] = field(default_factory=dict)


def write_system(
    source: FmuSource, mounted: Sequence[Mounted], values: Mapping[str, float], folder: Path, name: str, comment: str
) -> Path:
    """Write `NAME.toml` and the FMUs that it names to a folder; returns the path of the file.

    The system has the inputs and outputs of the original FMU. A parameter is named as in the coupled system, such as
    `force1.b[1]`.

    Args:
        source: the FMU with its sites.
        mounted: laws in slots around it.
        values: fitted values by parameter.
        folder: where the files go.
        name: of the system's file, without ending.
        comment: first line of the file.

    Raises:
        MisfitError: if an FMU cannot be built or written.
    """
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{name}.toml"
    if isinstance(source.fmu, SystemFile):
        seen = source.fmu.exposed
        plan = _Plan(shown=dict(enumerate(seen.outputs)))
        _place(plan, source, mounted, values, folder, {i: seen.system.inputs[n] for i, n in enumerate(seen.inputs)})
        added = {label: ComponentSpec(label, source=file) for label, file in plan.components.items()}
        whole = extended(seen.system, added, plan.connections, plan.inputs, plan.outputs, name)
        path.write_text(f"# {comment}\n\n{write_toml(beside(whole, folder))}")
        return path
    original = folder / source.file.name
    if original.resolve() != source.file.resolve():
        shutil.copyfile(source.file, original)
    plan = _Plan({PLANT: original.name}, shown={k: f"{PLANT}.{v.name}" for k, v in enumerate(source.sites.outputs)})
    _place(
        plan, source, mounted, values, folder, {i: (f"{PLANT}.{v.name}",) for i, v in enumerate(source.sites.inputs)}
    )
    components = {label: ComponentSpec(label, source=file) for label, file in plan.components.items()}
    ports = [(source.sites.parameters[k - 1], k) for _, k in _each(mounted, (PARAMETER_SLOT,))]
    wrong = {p.name: Value(float(p.variable.start or 0.0) * (1.0 + values[f"parameter.share[{k}]"])) for p, k in ports}
    components[PLANT] = replace(components[PLANT], values=wrong)
    connections = tuple(Connection(*ends) for ends in plan.connections)
    system = System(name, components, connections, plan.inputs, plan.outputs, folder=folder)
    write_with_steps(system, path, comment, source)
    return path


def _place(
    plan: _Plan,
    source: FmuSource,
    mounted: Sequence[Mounted],
    values: Mapping[str, float],
    folder: Path,
    into: dict[int, tuple[str, ...]],
) -> None:
    """Add the effects to a plan; `into` says which inputs of components each input drives."""
    sites, shown = source.sites, dict(plan.shown)
    forces: dict[int, list[str]] = {}
    for part, place in _each(mounted, FORCE_SLOTS):
        force = sites.forces[place - 1]
        label = _build(plan, part, place, sites.outputs[force.output].name, sites.force_scales, values, folder)
        plan.connections.append((_position(plan, source, force), f"{label}.q"))
        plan.connections.append((_speed(plan, source, force, folder), f"{label}.w"))
        forces.setdefault(force.input, []).append(_pushing(plan, force, f"{label}.f", folder))
    for i, found in forces.items():
        shared = found if i in sites.driven else found[:-1]
        for signal in shared:
            into[i] = _join(plan, signal, into[i], folder)
        if i not in sites.driven:
            plan.connections += [(found[-1], target) for target in into.pop(i)]
    for part, place in _each(mounted, tuple(reversed(INPUT_SLOTS))):  # from the plant outwards
        i = sites.driven[place - 1]
        label = _build(plan, part, place, sites.inputs[i].name, sites.input_scales[place - 1], values, folder)
        plan.connections += [(f"{label}.y", target) for target in into[i]]
        into[i] = (f"{label}.u",)
    for part, place in _each(mounted, OUTPUT_SLOTS):
        k = sites.measured[place - 1]
        label = _build(plan, part, place, sites.outputs[k].name, sites.output_scales[place - 1], values, folder)
        plan.connections.append((shown[k], f"{label}.u"))
        shown[k] = f"{label}.y"
    plan.inputs = {sites.inputs[i].name: at for i, at in into.items()}
    plan.outputs = {v.name: shown[k] for k, v in enumerate(sites.outputs)}


def _each(mounted: Sequence[Mounted], slots: Sequence[str]) -> list[tuple[Mounted, int]]:
    """Effects in some slots with each of their places, in the order of the slots."""
    inside = sorted((part for part in mounted if part.slot in slots), key=lambda part: slots.index(part.slot))
    return [(part, place) for part in inside for place in part.places]


def _pushing(plan: _Plan, force: ForceSite, signal: str, folder: Path) -> str:
    """The signal of a force, turned round for an input that pushes against the direction of its output."""
    if force.sign > 0:
        return signal
    label = _helper(plan, "Gain", folder, {"k": -1.0})
    plan.connections.append((signal, f"{label}.u"))
    return f"{label}.y"


def _join(plan: _Plan, force: str, targets: tuple[str, ...], folder: Path) -> tuple[str, ...]:
    """Let a force join what drives targets; returns where the other signal now goes."""
    label = _helper(plan, "Sum", folder)
    plan.connections += [(force, f"{label}.u2"), *((f"{label}.y", target) for target in targets)]
    return (f"{label}.u1",)


def _position(plan: _Plan, source: FmuSource, force: ForceSite) -> str:
    """The signal that is the position at a force, as the FMU shows it."""
    names = [v.name for v in source.sites.outputs]
    return plan.shown[names.index(source.sites.sensed_names[force.position])]


def _speed(plan: _Plan, source: FmuSource, force: ForceSite, folder: Path) -> str:
    """The signal that is the speed at a force: the FMU's own, or else made from the position."""
    name = source.sites.sensed_names[force.speed]
    if name:
        return f"{PLANT}.{name}"
    label = _helper(plan, "Rate", folder, _lag(source))
    plan.connections.append((plan.shown[force.output], f"{label}.u"))
    return f"{label}.y"


def _lag(source: FmuSource) -> dict[str, float]:
    """Parameters of a rate: of a system with a step of its own those that make it the difference over the last step."""
    step = source.fmu.exposed.system.run.step if isinstance(source.fmu, SystemFile) else None
    if step is None:
        return {}
    lag = SHARE_OF_STEP * step
    return {"T": lag, "k": (1.0 - math.exp(-step / lag)) / step}


def _helper(plan: _Plan, class_name: str, folder: Path, values: Mapping[str, float] = MappingProxyType({})) -> str:
    """Add a component of one of the small classes, with values of its parameters; returns its name."""
    short = class_name.lower()
    label = f"{short}{sum(name.startswith(short) for name in plan.components) + 1}"
    system = ModelicaModel(class_name, class_name, CLASSES).compile()
    parameters = tuple(replace(v, start=values.get(v.name, v.start)) for v in system.parameters)
    build_fmu(replace(system, parameters=parameters), folder / f"{label}.fmu")
    plan.components[label] = f"{label}.fmu"
    return label


def _build(
    plan: _Plan, part: Mounted, place: int, at: str, scales: Scales, values: Mapping[str, float], folder: Path
) -> str:
    """Build the FMU of one copy of an effect, with its values; returns the component's name."""
    label = re.sub(r"\W+", "_", f"{part.law.card.id}_{at}").strip("_")
    file = build_fmu(_valued(part, place, scales, values), folder / f"{label}.fmu")
    plan.components[label] = file.name
    return label


def _valued(part: Mounted, place: int, scales: Scales, values: Mapping[str, float]) -> SymbolicSystem:
    system = part.law.system
    parameters = []
    for variable in system.parameters:
        entry = part.law.entries[variable.name]
        fixed = scales.offset(entry["unit"]) + scales.factor(entry["unit"]) * entry["low"]
        names = (f"{part.slot}.{variable.name}", f"{part.slot}.{variable.name}[{place}]")
        value = next((values[name] for name in names if name in values), fixed)
        parameters.append(replace(variable, start=value, minimum=None, maximum=None))
    return replace(system, name=part.law.card.class_name, parameters=tuple(parameters))


def write_with_steps(system: System, path: Path, comment: str, source: FmuSource) -> None:
    """Write a system around an FMU, with a communication step so short that the system does what the diagnosis promised.

    The step is the sample interval or a fraction of it, at which halving hardly changes the run along the first learning
    trial. Between steps inputs are held, or go on along lines where that allows longer steps.

    Args:
        system: without a step.
        comment: first line of the file.
        source: the FMU, with the data that it was looked at with.
    """

    def write(settings: RunSettings) -> None:
        write_atomically(path, f"# {comment}\n\n{write_toml(replace(system, run=settings))}".encode())

    if source.measurements is None or not read_description(source.file).interface().variable_step:
        write(system.run)
        return
    record = source.measurements.learning[0] if source.measurements.learning else source.measurements.trials[0]
    interval = float(np.median(np.diff(record.time)))
    found = []
    for extrapolation in (0.0, 1.0):
        options = {"extrapolation": extrapolation} if extrapolation else {}
        settings = replace(system.run, step=float(f"{interval:.9g}"), options=options)
        write(settings)
        found.append((_parts_of_interval(path, source.measurements), extrapolation, settings))
    count, _, settings = min(found, key=lambda each: each[:2])
    write(replace(settings, step=float(f"{interval / count:.9g}")))


def _parts_of_interval(path: Path, measurements: MeasurementSet) -> int:
    """How many steps in a sample interval a system takes that is written with one."""
    whole = fmu_model(path)
    data = bind(measurements, whole.inputs, whole.outputs)
    trial = (data.learning or data.trials)[0]
    model = whole.with_held(trial.held).restricted(data.output_names)
    noise = np.array([data.noise_std[name] for name in data.output_names])
    record = model.record(SmoothedTrial(trial.time, trial.inputs, trial.outputs, noise))
    compiled = model.compiled
    compiled.has_own_steps = False
    start, values = record.start, compiled.parameters
    return enough_substeps(compiled, record.time, record.inputs, values, start, ROUGH, noise, record.measured)

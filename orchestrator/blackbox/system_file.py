"""An FMU with effects as a system of FMUs: the original, one FMU for each effect, and a file that connects them."""

import json
import re
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from fmus.catalogue import ModelicaModel
from fmus.package import build_fmu
from fmus.symbolic.system import SymbolicSystem
from orchestrator.blackbox.coupled import Mounted
from orchestrator.blackbox.library import CLASSES, FORCE_SLOTS, INPUT_SLOTS, OUTPUT_SLOTS, Scales
from orchestrator.blackbox.sites import ForceSite
from orchestrator.blackbox.source import FmuSource

PLANT = "plant"


@dataclass
class _Plan:
    """Components by name, connections, and what drives and shows the system."""

    components: dict[str, str] = field(default_factory=dict)
    connections: list[tuple[str, str]] = field(default_factory=list)
    inputs: dict[str, str] = field(default_factory=dict)
    outputs: dict[str, str] = field(default_factory=dict)


def write_system(
    source: FmuSource, mounted: Sequence[Mounted], values: Mapping[str, float], folder: Path, name: str, comment: str
) -> Path:
    """Write `NAME.toml` and the FMUs that it names to a folder; returns the path of the file.

    The system has the inputs and outputs of the original FMU. A parameter is named as in the coupled system, such as
    `force1.b[1]`.

    Raises:
        MisfitError: if an FMU cannot be built or written.
    """
    assert source.sites is not None and source.file is not None
    sites, plan = source.sites, _Plan()
    folder.mkdir(parents=True, exist_ok=True)
    original = folder / source.file.name
    if original.resolve() != source.file.resolve():
        shutil.copyfile(source.file, original)
    plan.components[PLANT] = original.name
    into = {i: f"{PLANT}.{v.name}" for i, v in enumerate(sites.inputs)}
    shown = {k: f"{PLANT}.{v.name}" for k, v in enumerate(sites.outputs)}
    forces: dict[int, list[str]] = {}
    for part, place in _each(mounted, FORCE_SLOTS):
        force = sites.forces[place - 1]
        label = _build(plan, part, place, sites.outputs[force.output].name, sites.force_scales, values, folder)
        plan.connections.append((shown[force.output], f"{label}.q"))
        plan.connections.append((_speed(plan, source, force, folder), f"{label}.w"))
        forces.setdefault(force.input, []).append(f"{label}.f")
    for i, found in forces.items():
        shared = found if i in sites.driven else found[:-1]
        for signal in shared:
            into[i] = _join(plan, signal, into[i], folder)
        if i not in sites.driven:
            plan.connections.append((found[-1], into.pop(i)))
    for part, place in _each(mounted, tuple(reversed(INPUT_SLOTS))):  # from the plant outwards
        i = sites.driven[place - 1]
        label = _build(plan, part, place, sites.inputs[i].name, sites.input_scales[place - 1], values, folder)
        plan.connections.append((f"{label}.y", into[i]))
        into[i] = f"{label}.u"
    for part, place in _each(mounted, OUTPUT_SLOTS):
        k = sites.measured[place - 1]
        label = _build(plan, part, place, sites.outputs[k].name, sites.output_scales[place - 1], values, folder)
        plan.connections.append((shown[k], f"{label}.u"))
        shown[k] = f"{label}.y"
    plan.inputs = {sites.inputs[i].name: at for i, at in into.items()}
    plan.outputs = {v.name: shown[k] for k, v in enumerate(sites.outputs)}
    path = folder / f"{name}.toml"
    path.write_text(_text(plan, comment))
    return path


def _each(mounted: Sequence[Mounted], slots: Sequence[str]) -> list[tuple[Mounted, int]]:
    """Effects in some slots with each of their places, in the order of the slots."""
    inside = sorted((part for part in mounted if part.slot in slots), key=lambda part: slots.index(part.slot))
    return [(part, place) for part in inside for place in part.places]


def _join(plan: _Plan, force: str, target: str, folder: Path) -> str:
    """Let a force join what drives a target; returns where the other signal now goes."""
    label = _helper(plan, "Sum", folder)
    plan.connections += [(force, f"{label}.u2"), (f"{label}.y", target)]
    return f"{label}.u1"


def _speed(plan: _Plan, source: FmuSource, force: ForceSite, folder: Path) -> str:
    """The signal that is the speed at a force: the FMU's own, or else made from the position."""
    assert source.sites is not None
    name = source.sites.sensed_names[force.speed]
    if name:
        return f"{PLANT}.{name}"
    label = _helper(plan, "Rate", folder)
    plan.connections.append((f"{PLANT}.{source.sites.outputs[force.output].name}", f"{label}.u"))
    return f"{label}.y"


def _helper(plan: _Plan, class_name: str, folder: Path) -> str:
    """Add a component of one of the small classes; returns its name."""
    short = class_name.lower()
    label = f"{short}{sum(name.startswith(short) for name in plan.components) + 1}"
    build_fmu(ModelicaModel(class_name, class_name, CLASSES).compile(), folder / f"{label}.fmu")
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


def _text(plan: _Plan, comment: str) -> str:
    lines = [f"# {comment}", "", "[components]"]
    lines += [f"{name} = {json.dumps(file)}" for name, file in plan.components.items()]
    lines += ["", "# Inputs and outputs of the system, and what they are inside."]
    for title, table in (("inputs", plan.inputs), ("outputs", plan.outputs)):
        lines += [f"[{title}]", *(f"{json.dumps(name)} = {json.dumps(at)}" for name, at in table.items()), ""]
    for start, end in plan.connections:
        lines += ["[[connections]]", f"from = {json.dumps(start)}", f"to = {json.dumps(end)}", ""]
    return "\n".join(lines)

"""An FMU with effects as a system of FMUs: the original, one small FMU for each effect, and a file that connects them."""

import hashlib
import re
import shutil
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from fmus.catalogue import ModelicaModel
from fmus.errors import MisfitError
from fmus.files import cache_folder, write_atomically
from fmus.package import build_fmu
from orchestrator.blackbox.model import CoupledModel
from orchestrator.blackbox.source import FmuSource
from orchestrator.blackbox.system_file import write_with_steps
from orchestrator.cosim.system import ComponentSpec, Connection, System, Value
from orchestrator.greybox.around import Placed, fmu_with
from orchestrator.greybox.candidates import fits
from orchestrator.greybox.expression import renamed
from orchestrator.greybox.fmu_front import write_with_laws
from orchestrator.greybox.laws import Law, laws
from orchestrator.greybox.places import Place, parameter_places, unscaled_places
from orchestrator.greybox.tape import Outline, can_be_taped, outline
from orchestrator.verdicts.result import NamedEffect

PLANT = "plant"
# The rate of a signal, behind a lag of 2 ms.
RATE = (
    "model Rate\n  parameter Real T = 0.002;\n  input Real u;\n  Real x(start = 0, fixed = false);\n  output Real y;\n"
    "initial equation\n  x = u;\nequation\n  der(x) = y;\n  y = (u - x)/T;\nend Rate;\n"
)
SUM = 'model Sum "Sum of two signals"\n  input Real a;\n  input Real b;\n  output Real y = a + b;\nend Sum;\n'


@dataclass
class _Plan:
    """The system so far: where each input of the whole goes, and what shows each of its outputs."""

    folder: Path
    components: dict[str, ComponentSpec] = field(default_factory=dict)
    connections: list[Connection] = field(default_factory=list)
    inputs: dict[str, tuple[str, ...]] = field(default_factory=dict)
    outputs: dict[str, str] = field(default_factory=dict)

    def add(self, label: str, text: str, class_name: str) -> str:
        """Build a component from a class; returns its name."""
        number = 1 + sum(re.fullmatch(rf"{label}\d*", known) is not None for known in self.components)
        name = label if number == 1 else f"{label}{number}"
        file = cache_folder("laws") / f"{class_name}_{hashlib.sha256(text.encode()).hexdigest()[:16]}.mo"
        write_atomically(file, text.encode())
        build_fmu(ModelicaModel(class_name, class_name, file).compile(), self.folder / f"{name}.fmu")
        self.components[name] = ComponentSpec(name, source=f"{name}.fmu")
        return name

    def join(self, signal: str, into: str) -> None:
        """Add a signal to what drives an input of the whole."""
        label = self.add("sum", SUM, "Sum")
        self.connections += [Connection(signal, f"{label}.b")]
        self.connections += [Connection(f"{label}.y", target) for target in self.inputs[into]]
        self.inputs[into] = (f"{label}.a",)


def write_fmu_system(source: FmuSource, effects: Sequence[NamedEffect], folder: Path, name: str) -> Path:
    """Write `NAME.toml` and the FMUs that it names to a folder, or `NAME.fmu` alone if all effects act at rates inside of it.

    Args:
        source: the original FMU.
        effects: the effects, each with its site and values.
        folder: where to write; it is made if it is not there.
        name: name of the file, without ending.

    Returns:
        The path of the file.

    Raises:
        MisfitError: if an effect is unknown, or acts where the FMU has no input.
    """
    folder.mkdir(parents=True, exist_ok=True)
    description, seen = source.fmu.started, outline(source)
    inside = [effect for effect in effects if _is_inside(seen, effect)]
    original = folder / (f"{name}.fmu" if inside else source.file.name)
    if inside:
        write_with_laws(source, seen, [_placed(seen, effect) for effect in inside], original)
    elif original.resolve() != source.file.resolve():
        shutil.copyfile(source.file, original)
    if inside == list(effects):
        return original
    plan = _Plan(folder)
    plan.components[PLANT] = ComponentSpec(PLANT, source=original.name, values=_values(source, effects))
    plan.inputs = {p.name: (f"{PLANT}.{p.name}",) for p in description.inputs}
    plan.outputs = {p.name: f"{PLANT}.{p.name}" for p in description.outputs}
    for effect in effects:
        if effect.id != "parameter_error" and effect not in inside:
            _place(plan, source, seen, effect)
    system = System(
        name,
        plan.components,
        tuple(plan.connections),
        {label: at for label, at in plan.inputs.items() if at},
        plan.outputs,
        folder=folder,
    )
    path = folder / f"{name}.toml"
    comment = f"{source.class_name} with {', '.join(f'{effect.id} at {effect.site}' for effect in effects)}"
    write_with_steps(system, path, comment, source)
    return path


def _values(source: FmuSource, effects: Sequence[NamedEffect]) -> dict[str, Value]:
    """Parameters of the FMU with their new values."""
    start = {p.name: float(p.variable.start or 0.0) for p in source.fmu.description.parameters}
    wrong = {e.site: e.parameters["share"].value for e in effects if e.id == "parameter_error"}
    return {site: Value(start[site] * (1.0 + share)) for site, share in wrong.items()}


def version_model(source: FmuSource, effects: Sequence[NamedEffect], signals: Sequence[str]) -> CoupledModel:
    """The FMU with effects, as a model that follows trials.

    Args:
        source: the original FMU.
        effects: the effects, each with its site and values.
        signals: outputs that the model shows.

    Raises:
        MisfitError: if the FMU has no place for one of them.
    """
    seen = outline(source)
    found = [_placed(seen, effect) for effect in effects]
    return fmu_with(source, found, seen.acting, {b.input: b.state for b in seen.balances}, signals)


def knows(source: FmuSource, effects: Sequence[NamedEffect]) -> bool:
    """Whether all effects are laws at places of an FMU."""
    if not can_be_taped(source):
        return False
    seen = outline(source)
    return all(law_at(seen, effect) is not None for effect in effects)


def law_at(seen: Outline, effect: NamedEffect) -> tuple[Law, Place] | None:
    """The law and the place that an effect stands for; None if the FMU has no such place."""
    forces = {b.input for b in seen.balances}
    inputs = [v.name for v in seen.system.inputs if v.name not in forces and not v.name.startswith("tape[")]
    whole = replace(seen.system, parameters=seen.parameters)
    places = [*unscaled_places(seen.system, seen.balances, inputs), *parameter_places(whole)]
    for place in (place for place in places if place.site == effect.site):
        for law in (law for law in laws() if fits(law, place)):
            if law.is_called(effect.id, effect.variant, effect.parameters, place.unit):
                return law, place
    return None


def _law_and_place(seen: Outline, effect: NamedEffect) -> tuple[Law, Place]:
    found = law_at(seen, effect)
    if found is None:
        raise MisfitError(f"{effect.id} at {effect.site} cannot be added: the FMU has no such place for it")
    return found


def _placed(seen: Outline, effect: NamedEffect) -> Placed:
    law, place = _law_and_place(seen, effect)
    return Placed(law, place, {p.name: effect.parameters[law.public(p.name, place.unit)].value for p in law.parameters})


def _is_inside(seen: Outline, effect: NamedEffect) -> bool:
    """Whether an effect acts on rates for which the FMU has no input."""
    if effect.id == "parameter_error":
        return False
    _, place = _law_and_place(seen, effect)
    return place.kind in ("motion", "storage") and not all(seen.acting[force] for force in place.adds)


def _place(plan: _Plan, source: FmuSource, seen: Outline, effect: NamedEffect) -> None:
    law, place = _law_and_place(seen, effect)
    label = plan.add(effect.id, law_class(law, place, effect), "Law")
    if place.kind == "input":
        plan.connections += [Connection(f"{label}.y", target) for target in plan.inputs[place.site]]
        plan.inputs[place.site] = (f"{label}.u",)
        return
    if place.kind in ("output", "response"):
        _behind(plan, place, label)
        return
    for name, text in place.coordinates.items():
        if re.search(rf"\b{name}\b", law.expression) and name != "t":
            _sense(plan, source, text, f"{label}.{name}")
    for force, factor in place.adds.items():
        signal = f"{label}.y"
        if factor < 0:
            turned = plan.add("minus", SUM.replace("a + b", "-b").replace("  input Real a;\n", ""), "Sum")
            plan.connections.append(Connection(signal, f"{turned}.b"))
            signal = f"{turned}.y"
        plan.join(signal, seen.acting[force])


def _sense(plan: _Plan, source: FmuSource, text: str, target: str) -> None:
    """Connect a coordinate of a law: a state of the plant, or the difference of two."""
    if not text.startswith("("):
        plan.connections.append(Connection(_shown(plan, source, text), target))
        return
    one, _, other = text[1:-1].partition(" - ")
    label = plan.add("difference", SUM.replace("a + b", "a - b"), "Sum")
    plan.connections += [
        Connection(_shown(plan, source, one), f"{label}.a"),
        Connection(_shown(plan, source, other), f"{label}.b"),
        Connection(f"{label}.y", target),
    ]


def _shown(plan: _Plan, source: FmuSource, state: str) -> str:
    """The signal that shows a state: an output of the FMU, or the rate of one that shows what the state is the rate of."""
    description = source.fmu.started
    outputs, states = ([p.name for p in part] for part in (description.outputs, description.states))
    if state in outputs:
        return f"{PLANT}.{state}"
    for k, position in source.fmu.positions().items():
        plain = position.slope == 1.0 or abs(position.slope - 1.0) < 1e-6 and abs(position.offset) < 1e-9
        if plain and states[position.state] == state:
            return f"{PLANT}.{outputs[k]}"
        if plain and position.speed is not None and states[position.speed] == state:
            label = plan.add("rate", RATE, "Rate")
            plan.connections.append(Connection(f"{PLANT}.{outputs[k]}", f"{label}.u"))
            return f"{label}.y"
    raise MisfitError(f"the effect depends on {state}, which no output of {source.class_name} shows; make it an output")


def _behind(plan: _Plan, place: Place, label: str) -> None:
    """Let an output be shown through a law."""
    name = place.coordinates["y"]
    plan.connections.append(Connection(plan.outputs[name], f"{label}.y_in"))
    plan.outputs[name] = f"{label}.y"
    if "u" in place.coordinates:
        given = place.coordinates["u"]
        plan.inputs[given] = (*plan.inputs[given], f"{label}.u")


def law_class(law: Law, place: Place, effect: NamedEffect) -> str:
    """A law as a Modelica class: coordinates in, its value out as `y`; what it does to an output comes in as `y_in`."""
    names = {name: name for name in place.coordinates} | {"t": "time"}
    if place.kind in ("output", "response"):
        names["y"] = "y_in"
    lines = [f'model Law "{law.title_at(place.unit)}"']
    for parameter in law.parameters:
        value = effect.parameters[law.public(parameter.name, place.unit)].value
        unit = parameter.unit(place.units)
        lines.append(f'  parameter Real {parameter.name}(unit="{unit}") = {value!r} "{parameter.description}";')
    inputs = [names[k] for k in place.coordinates if k != "t" and re.search(rf"\b{k}\b", _texts(law))]
    lines += [f"  input Real {name};" for name in dict.fromkeys(inputs)]
    lines += [f"  Real {state}{'' if state in law.starts else '(start=0, fixed=true)'};" for state in law.states]
    lines += ["  output Real y;", "equation", f"  y = {renamed(law.expression, names)};"]
    lines += [f"  der({state}) = {renamed(rate, names)};" for state, rate in law.states.items()]
    if law.starts:
        lines += ["initial equation", *(f"  {state} = {renamed(text, names)};" for state, text in law.starts.items())]
    return "\n".join([*lines, "end Law;", ""])


def _texts(law: Law) -> str:
    return " ; ".join([law.expression, *law.states.values()])

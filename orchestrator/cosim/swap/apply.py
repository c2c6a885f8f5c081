"""The system with another component in it, or the reasons why there is none."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from fmus.errors import MisfitError
from orchestrator.cosim.addresses import resolve
from orchestrator.cosim.compatible import unit_scaling
from orchestrator.cosim.component import FLOATS, Port
from orchestrator.cosim.connections import HasPorts, wire
from orchestrator.cosim.graph import Loop, plan
from orchestrator.cosim.kinds import describe
from orchestrator.cosim.swap.compare import Side, compare_interfaces
from orchestrator.cosim.swap.report import SwapReport
from orchestrator.cosim.system import ComponentSpec, Connection, System, Value, split_address

# Masters that take steps back.
_ROLLBACK = ("iterative", "adaptive")
_FIXED_STEP = "it takes steps of one size only: give another --step with care, and no --stop in the middle of a step"


@dataclass(frozen=True)
class Swap:
    """What was found, and the new system; None where it cannot work."""

    report: SwapReport
    system: System | None


def swap(
    system: System, component: str, file: Path, names: Mapping[str, str] | None = None, recorded: Iterable[str] = ()
) -> Swap:
    """Put an FMU in the place of a component.

    Connections and values keep their meaning: a value without a unit is taken in the unit of the old variable.

    Args:
        system: as it is.
        component: name of the component to replace.
        file: the FMU.
        names: new names by old ones, see `read_mapping`.
        recorded: further variables of the component that a run needs.

    Returns:
        The report, and the system if nothing stands against it; matches by similarity are used, so whoever calls asks for
        the user's word first (`report.questions`).

    Raises:
        MisfitError: if there is no such component, or one of the two cannot be read.
    """
    spec = system.component(component)
    if not file.is_file():
        raise MisfitError(f"{file} does not exist; expected an FMU to swap in for {component!r}")
    new_spec = replace(spec, kind="fmu", source=str(file.resolve()), options=spec.options if spec.kind == "fmu" else {})
    interfaces = {name: describe(each, system.folder) for name, each in system.components.items()}
    old, new = interfaces[component], describe(new_spec, system.folder)
    used = _used(system, component, recorded)
    sides = (
        Side(Path(spec.source).name or spec.kind, _with_units(old.ports, spec, system), old.feedthrough, facts(old)),
        Side(file.name, new.ports, new.feedthrough, facts(new)),
    )
    report = compare_interfaces(component, *sides, used, names)
    problems = [*report.problems, *_abilities(system, spec, new, facts(old).get("fixed step"))]
    if problems:
        return Swap(replace(report, problems=tuple(problems)), None)
    swapped = _renamed(system, new_spec, report, {p.name: p for p in sides[0].ports}, {p.name: p for p in new.ports})
    try:
        loops = _loops(swapped, {**interfaces, component: new})
    except MisfitError as error:
        return Swap(replace(report, problems=(str(error),)), None)
    fixed = [] if new.interface().variable_step else [_FIXED_STEP]  # type: ignore[attr-defined]
    closed = [f"the swap closes an algebraic loop: {loop}" for loop in loops - _loops(system, interfaces)]
    return Swap(replace(report, notes=(*report.notes, *fixed, *closed)), swapped)


def facts(described: HasPorts) -> dict[str, Any]:
    """What a component says about itself beside its ports, in words; only an FMU says more than a little."""
    if not hasattr(described, "interfaces"):
        return {"kind": getattr(described, "kind", "component")}
    found: dict[str, Any] = {
        "kind": "FMU",
        "FMI version": described.version,  # type: ignore[attr-defined]
        "interfaces": " and ".join(described.interfaces),
        "tool": described.tool or None,  # type: ignore[attr-defined]
        "step of its experiment": described.step,  # type: ignore[attr-defined]
    }
    interface = described.interface()  # type: ignore[attr-defined]
    found |= {
        "keeps its state": interface.can_save,
        "writes its state to memory": interface.can_serialize,
        "derivatives": interface.can_differentiate,
        "steps of any size": interface.variable_step,
        "fixed step": interface.fixed_step,
        "interpolates inputs": interface.interpolates_inputs,
        "events while stepping": interface.has_event_mode,
        "needs its tool": interface.needs_execution_tool,
        "one instance a process": interface.once_per_process,
    }
    return found


def _abilities(system: System, spec: ComponentSpec, new: HasPorts, before: float | None) -> Iterable[str]:
    """What the system asks of the component that the new one cannot do; `before` is the fixed step of the old one, s."""
    interface = new.interface(spec.options.get("interface") if spec.kind == "fmu" else None)  # type: ignore[attr-defined]
    if system.run.master in _ROLLBACK and not interface.can_save:
        yield f"it cannot keep its state, which the {system.run.master} master needs to take steps back"
    step = spec.step or system.run.step
    if not interface.variable_step:
        if system.run.master == "adaptive":
            yield "it takes steps of one size only, and the adaptive master chooses their size; use another master"
        length = None if system.run.stop is None else system.run.stop - (system.run.start or 0.0)
        if step and length and abs(length / step - round(length / step)) > 1e-6:
            yield (
                f"it takes steps of one size only, and the run of {length:g} s ends in the middle of a step of {step:g} s; "
                "choose a step that divides it"
            )
    fixed = interface.fixed_step
    if fixed and step and fixed != before and abs(step / fixed - round(step / fixed)) > 1e-9:
        yield f"it steps by {fixed:g} s only, and the system asks for {step:g} s"


def _with_units(ports: Iterable[Port], spec: ComponentSpec, system: System) -> list[Port]:
    """Ports with the units that the system gives to those without."""
    found = []
    for port in ports:
        unit = spec.units.get(port.name)
        found.append(port if port.unit or not unit else replace(port, unit=unit, si=system.definitions.get(unit)))
    return found


def _used(system: System, component: str, recorded: Iterable[str]) -> dict[str, str]:
    """What each variable of a component is used for."""
    uses: dict[str, list[str]] = {}

    def note(address: str, words: str) -> None:
        name, variable = split_address(address)
        if name == component:
            uses.setdefault(variable, []).append(words)

    for connection in system.connections:
        note(connection.source, f"drives {connection.target}")
        note(connection.target, f"driven by {connection.source}")
    for name, targets in system.inputs.items():
        for target in targets:
            note(target, f"driven by input {name}")
    for name, source in system.outputs.items():
        note(source, f"shown as output {name}")
    for variable in system.components[component].values:
        note(f"{component}.{variable}", "set to a value")
    for variable in recorded:
        note(f"{component}.{variable}", "recorded")
    return {variable: ", ".join(words) for variable, words in uses.items()}


def _renamed(
    system: System, spec: ComponentSpec, report: SwapReport, old: Mapping[str, Port], new: Mapping[str, Port]
) -> System:
    names = {match.old: match.new for match in report.matches}

    def variable(name: str) -> str | None:
        """New name of a variable or element; None where it was left out on purpose."""
        if name in names:
            return names[name]
        elements = resolve(old, name, spec.name)
        if len(elements) > 1:  # scalars x[1], x[2], ... together, which may be an array now
            return name
        target = names.get(elements[0].port.name)
        return None if target is None else target + name[len(elements[0].port.name) :]

    def address(text: str) -> str | None:
        component, name = split_address(text)
        found = variable(name) if component == spec.name else name
        return None if found is None else f"{component}.{found}"

    connections = []
    for connection in system.connections:
        source, target = address(connection.source), address(connection.target)
        if source is not None and target is not None:
            connections.append(replace(_kept(connection, spec.name, names, old, new), source=source, target=target))
    inputs = {
        name: tuple(a for t in targets if (a := address(t)) is not None) for name, targets in system.inputs.items()
    }
    outputs = {name: found for name, source in system.outputs.items() if (found := address(source)) is not None}
    values = {}
    for name, value in system.components[spec.name].values.items():
        found = variable(name)
        if found is not None:
            port = resolve(old, name, spec.name)[0].port
            values[found] = value if value.unit or port.type not in FLOATS else Value(value.value, port.unit, port.si)
    components = {**system.components, spec.name: replace(spec, values=values, units={})}
    return replace(
        system,
        components=components,
        connections=tuple(connections),
        inputs={name: targets for name, targets in inputs.items() if targets},
        outputs=outputs,
    )


def _kept(
    connection: Connection, component: str, names: Mapping[str, str], old: Mapping[str, Port], new: Mapping[str, Port]
) -> Connection:
    """A connection without conversion of units was made for the units of the old component: convert there and back."""
    for side in ("source", "target"):
        name, variable = split_address(getattr(connection, side))
        if connection.convert or name != component:
            continue
        port = resolve(old, variable, component)[0].port
        there = resolve(new, names.get(port.name, port.name), component)[0].port
        if not port.unit or not there.unit:
            continue
        one, other = (there, port) if side == "source" else (port, there)
        scale, shift = unit_scaling(one, other)
        if side == "source":
            offset = connection.factor * shift + connection.offset
        else:
            offset = scale * connection.offset + shift
        connection = replace(connection, factor=scale * connection.factor, offset=offset)
    return connection


def _loops(system: System, interfaces: Mapping[str, HasPorts]) -> set[str]:
    wiring = wire(system, interfaces)
    steps = plan(wiring, {name: each.feedthrough for name, each in interfaces.items()})
    return {str(step) for step in steps if isinstance(step, Loop)}

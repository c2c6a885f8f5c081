"""A coupled system seen from outside, as one FMU would be: with its free inputs, and its outputs."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

from fmus.catalogue import ModelicaModel
from fmus.errors import MisfitError
from fmus.files import cache_folder
from fmus.package import build_fmu
from fmus.symbolic.system import Variable
from orchestrator.blackbox.library import CLASSES
from orchestrator.blackbox.ports import FORCE_UNITS, Description, Port, number
from orchestrator.cosim.component import FLOATS
from orchestrator.cosim.component import Port as ComponentPort
from orchestrator.cosim.connections import wire
from orchestrator.cosim.kinds import describe
from orchestrator.cosim.system import ComponentSpec, Connection, System, split_address
from orchestrator.cosim.wiring import OUTSIDE, Wiring

JOINT = "joint_of_"
# What is only a guess for initial equations sets nothing.
SETTABLE = ("exact",)


@dataclass(frozen=True)
class Exposed:
    """A system with all free inputs as its own, and its description.

    `inputs` are names of the system's inputs in the order of the description's references; `outputs` and `starts` are
    addresses of components' outputs and of states whose start values can be set, in the order of the references that
    follow.
    """

    system: System
    description: Description
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    starts: tuple[str, ...]


def exposed(system: System, name: str, *, join_forces: bool = False) -> Exposed:
    """Look at a system from outside.

    A declared input or output keeps its name, others are named `component.variable`. Scalars of floating-point type count.

    Args:
        name: of the model, for messages.
        join_forces: make an input of each connected force as well; what it gets is added to what the connection brings.

    Raises:
        MisfitError: if the system does not fit together.
    """
    whole = _with_joints(system) if join_forces else system
    described: dict[str, Any] = {each: describe(spec, whole.folder) for each, spec in whole.components.items()}
    wiring = wire(whole, described)
    ports = {(c, port.name): port for c, each in described.items() for port in each.ports}
    given = {c: {v: value.value for v, value in spec.values.items()} for c, spec in whole.components.items()}
    inputs = {**_declared_inputs(whole, ports), **dict(_free_inputs(wiring))}
    outputs = _outputs(whole, wiring)
    starts = [address for c, each in described.items() for address in _starts(c, each)]
    units = whole.units

    def variable(label: str, address: str) -> Variable:
        component, inside = split_address(address)
        port = ports[component, inside]
        start = number(given[component].get(inside, port.start))
        return replace(_variable(port), name=label, unit=units.get(label, port.unit), start=start)

    first = [Port(variable(label, addresses[0]), k) for k, (label, addresses) in enumerate(inputs.items())]
    shown = [Port(variable(label, at), len(first) + k) for k, (label, at) in enumerate(outputs.items())]
    kept = [Port(variable(at, at), len(first) + len(shown) + k) for k, at in enumerate(starts)]
    description = Description(
        name=name,
        version=2,
        cosimulation=True,
        inputs=tuple(first),
        outputs=tuple(shown),
        states=(),
        rates=(),
        settable=tuple(kept),
        speed_of={},
        directional=False,
    )
    return Exposed(
        replace(whole, inputs=inputs, outputs=outputs),
        description,
        tuple(inputs),
        tuple(outputs.values()),
        tuple(starts),
    )


def _declared_inputs(system: System, ports: Mapping[tuple[str, str], ComponentPort]) -> dict[str, tuple[str, ...]]:
    return {name: at for name, at in system.inputs.items() if _counts(ports.get(split_address(at[0])))}


def _free_inputs(wiring: Wiring) -> Iterator[tuple[str, tuple[str, ...]]]:
    """Inputs of components that nothing drives."""
    driven = {number for link in wiring.links for number in link.targets}
    for slot in wiring.slots:
        is_input = slot.component != OUTSIDE and slot.port.causality == "input"
        if is_input and _counts(slot.port) and slot.first not in driven:
            yield slot.address, (slot.address,)


def _outputs(system: System, wiring: Wiring) -> dict[str, str]:
    """The declared outputs; all outputs of components where none is declared."""
    counted = {
        slot.address
        for slot in wiring.slots
        if slot.component != OUTSIDE and slot.port.causality == "output" and _counts(slot.port)
    }
    declared = {name: at for name, at in system.outputs.items() if at in counted}
    return declared or {at: at for at in sorted(counted) if not at.startswith(JOINT)}


def _starts(component: str, described: Any) -> Iterator[str]:
    """States of an FMU whose start values can be set."""
    known = getattr(described, "by_name", {})
    for state in getattr(described, "state_names", ()):
        port = known[state][0] if state in known else None
        if port is not None and _counts(port) and port.initial in SETTABLE:
            yield f"{component}.{state}"


def _counts(port: ComponentPort | None) -> bool:
    return port is not None and port.type in FLOATS and not port.shape


def _variable(port: ComponentPort) -> Variable:
    return Variable(
        name=port.name,
        unit=port.unit,
        description=port.description,
        start=number(port.start),
        minimum=port.minimum,
        maximum=port.maximum,
        nominal=port.nominal,
    )


def _with_joints(system: System) -> System:
    """The system with a sum in front of each connected force, whose other input is free and named as the force is."""
    described: dict[str, Any] = {each: describe(spec, system.folder) for each, spec in system.components.items()}
    ports = {(c, port.name): port for c, each in described.items() for port in each.ports}
    components, inputs, connections = dict(system.components), dict(system.inputs), []
    for connection in system.connections:
        source, target = (ports.get(split_address(at)) for at in (connection.source, connection.target))
        if not _passes_a_force(source, target):
            connections.append(connection)
            continue
        label = JOINT + connection.target.replace(".", "_")
        components[label] = ComponentSpec(label, source=str(_sum_fmu()))
        inputs[connection.target] = (f"{label}.u2",)
        connections += [
            replace(connection, target=f"{label}.u1"),
            Connection(f"{label}.y", connection.target),
        ]
    return replace(system, components=components, inputs=inputs, connections=tuple(connections))


def _passes_a_force(source: ComponentPort | None, target: ComponentPort | None) -> bool:
    """Whether a connection brings a force as it is; where units are converted a sum in between would lose them."""
    if source is None or target is None or not _counts(source) or not _counts(target):
        return False
    return target.unit in FORCE_UNITS and source.unit in ("", target.unit)


@cache
def _sum_fmu() -> Path:
    """The FMU that adds two signals, kept in the cache."""
    system = ModelicaModel("Sum", "Sum", CLASSES).compile()
    file = cache_folder("joints") / "Sum.fmu"
    return file if file.is_file() else build_fmu(system, file)


def require_components(system: System) -> None:
    """Refuse what cannot be started again and again, as a fit does: a robot on its bus.

    Raises:
        MisfitError: naming the component.
    """
    for name, spec in system.components.items():
        if spec.kind == "robot":
            raise MisfitError(f"component {name} is a robot on its bus, which cannot be run again and again for a fit")

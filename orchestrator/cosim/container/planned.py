"""A system as its master would run it: wiring and operations, worked out without loading a component."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from fmus.errors import MisfitError
from orchestrator.cosim.assembly import initial_order, recorded_values, settings_of
from orchestrator.cosim.connections import wire
from orchestrator.cosim.container.parts import ContainedPart, described
from orchestrator.cosim.graph import plan
from orchestrator.cosim.masters import TableMaster, find_master
from orchestrator.cosim.masters.operations import Operation, Schedule
from orchestrator.cosim.system import System
from orchestrator.cosim.wiring import Wiring

# Types by their numbers in system.h; an enumeration is a 64-bit number of FMI 3.
KINDS = {"Float64": 0, "Float32": 1, "Int8": 2, "UInt8": 3, "Int16": 4, "UInt16": 5, "Int32": 6, "UInt32": 7}
KINDS |= {"Enumeration": 8, "Boolean": 9, "String": 10}
NUMBERS = tuple(name for name in KINDS if name != "String")
# What a system can give a value, though no variable of the whole has that type.
GIVEN = KINDS | {"Int64": 8, "UInt64": 11}


@dataclass(frozen=True)
class PlannedSystem:
    """Everything that the table of a container is made of; `step` in s."""

    system: System
    parts: Mapping[str, ContainedPart]
    wiring: Wiring
    feedthrough: Mapping[str, Mapping[str, Sequence[str]]]
    initial: tuple[Operation, ...]
    master: TableMaster
    step: float


def plan_system(system: System, parts: Mapping[str, ContainedPart]) -> PlannedSystem:
    """Check a system and write down what its master does.

    Raises:
        MisfitError: if it does not fit together, or its master or a connection has no counterpart in C.
    """
    if any(policy != "stop" for policy in system.run.nan.values()):
        raise MisfitError(
            "nan of [run] asks to go on with values that are not finite, at which one FMU always stops; leave it out"
        )
    known = described(parts)
    wiring = wire(system, known)
    _refuse_connections(wiring)
    feedthrough = {name: part.described.feedthrough for name, part in parts.items()}
    recorded, _ = recorded_values(wiring, None)
    wanted = dict.fromkeys((slot.component, slot.port.name) for slot, _ in recorded)
    settings = settings_of(system, known, {name: part.own_step for name, part in parts.items()})
    kind = find_master(system.run.master)
    if not issubclass(kind, TableMaster):
        raise MisfitError(
            f"master {kind.name!r} goes back in time, which one FMU does not do; choose ordered, jacobi or gauss_seidel in [run]"
        )
    order = plan(wiring, feedthrough, wanted)
    return PlannedSystem(
        system=system,
        parts=parts,
        wiring=wiring,
        feedthrough=feedthrough,
        initial=Schedule(wiring).evaluation(initial_order(wiring, known, feedthrough, wanted)),
        master=kind(wiring, order, list(system.components), settings),
        step=settings.step,
    )


def _refuse_connections(wiring: Wiring) -> None:
    if wiring.ticking:
        raise MisfitError(
            f"{', '.join(wiring.ticking)}: clocks tick in misfit run, but not in one FMU of the system; say event_mode = false "
            "of the component if it runs without them"
        )
    for link in wiring.links:
        for slot in (link.source, link.target):
            if slot.port.type not in NUMBERS:
                raise MisfitError(
                    f"connection {link.source.address} -> {link.target.address} carries the type {slot.port.type}, "
                    "which one FMU does not pass on between its components; use misfit run"
                )
        if any(isinstance(value, str) for pair in link.transfer.mapping.items() for value in pair):
            raise MisfitError(
                f"connection {link.source.address} -> {link.target.address}: its mapping holds texts, which one FMU does not carry"
            )

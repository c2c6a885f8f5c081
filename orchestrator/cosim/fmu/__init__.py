"""FMUs of FMI 2.0 and 3.0 as components, called through their C functions."""

from pathlib import Path

from fmus.errors import MisfitError
from orchestrator.cosim.component import Component
from orchestrator.cosim.fmu.description import CO_SIMULATION, SCHEDULED, FmuDescription, Interface, read_description
from orchestrator.cosim.system import ComponentSpec

__all__ = ["FmuDescription", "describe_fmu", "has_events", "open_fmu", "read_description"]


def describe_fmu(spec: ComponentSpec, folder: Path) -> FmuDescription:
    """The description of a component's FMU, with arrays of the sizes that the component's values give them.

    Raises:
        FmuError: if the file is no FMU.
        MisfitError: if a size is none.
    """
    description = read_description(folder / spec.source)
    if not spec.values or not description.dimensions:
        return description
    from orchestrator.cosim.fmu.sizes import sized

    return sized(description, spec.values)


def has_events(spec: ComponentSpec, description: object) -> bool:
    """Whether a component is an FMU that is run with event mode: one whose clocks tick, or whose `event_mode` is wanted.

    An FMU in a process of its own handles its events itself.
    """
    if not isinstance(description, FmuDescription) or spec.isolate or spec.options.get("event_mode") is False:
        return False
    interface = description.interface(spec.options.get("interface"))
    wanted = spec.options.get("event_mode") or any(port.type == "Clock" for port in description.ports)
    return bool(wanted) and interface.kind == CO_SIMULATION and interface.has_event_mode


def open_fmu(spec: ComponentSpec, folder: Path) -> Component:
    """Load and instantiate the FMU of a component.

    `spec.options`: `interface` ("CoSimulation", "ModelExchange" or "ScheduledExecution"; co-simulation where there is a
    choice), `early_return` (whether an FMI 3 FMU may end a step at an event, which masters with rollback make use of),
    `ticks` (times in s of each input clock that somebody has to trigger), `event_mode` (whether events of an FMU of FMI 3
    are handled between its steps; where nobody says, those of an FMU with clocks are) and `intermediate_update` (whether an
    FMU of FMI 3 that asks for its inputs within a step gets them along the lines of a master that extrapolates).

    Raises:
        FmuError: if the file is no FMU or has no binary that can be loaded here.
        ComponentError: if it cannot be instantiated.
    """
    description = describe_fmu(spec, folder)
    interface = description.interface(spec.options.get("interface"))
    if interface.kind == CO_SIMULATION:
        return _stepping(spec, description, interface)
    for option in ("event_mode", "intermediate_update", "early_return"):
        if spec.options.get(option):
            raise MisfitError(f"{option} belongs to co-simulation, not to {interface.kind}; leave it out")
    if interface.kind == SCHEDULED:
        from orchestrator.cosim.fmu.scheduled import ScheduledFmu

        return ScheduledFmu(spec.name, description, interface, ticks=spec.options.get("ticks"))
    from orchestrator.cosim.fmu.exchange import ExchangeFmu

    return ExchangeFmu(spec.name, description, interface)


def _stepping(spec: ComponentSpec, description: FmuDescription, interface: Interface) -> Component:
    events = has_events(spec, description)
    wanted = [name for name in ("early_return", "intermediate_update") if spec.options.get(name)]
    if len(wanted) + events > 1:
        both = " and ".join([*(["event mode"] if events else []), *wanted])
        raise MisfitError(f"{both} do not go together; leave one out, event mode by event_mode = false")
    if spec.options.get("event_mode") and not events:
        raise MisfitError(f"event_mode: {description.path.name} has no event mode; leave it out")
    if events:
        from orchestrator.cosim.fmu.clocked import ClockedFmu

        return ClockedFmu(spec.name, description, interface, ticks=spec.options.get("ticks"))
    if "intermediate_update" in wanted:
        if not interface.asks_within_steps:
            raise MisfitError(
                f"intermediate_update: {description.path.name} never asks for inputs within a step; leave it out"
            )
        from orchestrator.cosim.fmu.stepping import AskingFmu

        return AskingFmu(spec.name, description, interface)
    from orchestrator.cosim.fmu.stepping import SteppingFmu

    return SteppingFmu(spec.name, description, interface, early_return="early_return" in wanted)

"""FMUs of FMI 2.0 and 3.0 as components, called through their C functions."""

from pathlib import Path

from fmus.errors import MisfitError
from orchestrator.cosim.component import Component
from orchestrator.cosim.fmu.description import CO_SIMULATION, SCHEDULED, FmuDescription, read_description
from orchestrator.cosim.system import ComponentSpec

__all__ = ["FmuDescription", "has_events", "open_fmu", "read_description"]


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
    `ticks` (times in s of each input clock that somebody has to trigger) and `event_mode` (whether events of an FMU of FMI 3
    are handled between its steps; where nobody says, those of an FMU with clocks are).

    Raises:
        FmuError: if the file is no FMU or has no binary that can be loaded here.
        ComponentError: if it cannot be instantiated.
    """
    description = read_description(folder / spec.source)
    interface = description.interface(spec.options.get("interface"))
    if has_events(spec, description):
        if spec.options.get("early_return"):
            raise MisfitError(
                "early_return and event mode do not go together; leave one out, or say event_mode = false"
            )
        from orchestrator.cosim.fmu.clocked import ClockedFmu

        return ClockedFmu(spec.name, description, interface, ticks=spec.options.get("ticks"))
    if spec.options.get("event_mode"):
        raise MisfitError(f"event_mode: {description.path.name} has no event mode in {interface.kind}; leave it out")
    if interface.kind == CO_SIMULATION:
        from orchestrator.cosim.fmu.stepping import SteppingFmu

        return SteppingFmu(spec.name, description, interface, early_return=bool(spec.options.get("early_return")))
    if interface.kind == SCHEDULED:
        from orchestrator.cosim.fmu.scheduled import ScheduledFmu

        return ScheduledFmu(spec.name, description, interface, ticks=spec.options.get("ticks"))
    from orchestrator.cosim.fmu.exchange import ExchangeFmu

    return ExchangeFmu(spec.name, description, interface)

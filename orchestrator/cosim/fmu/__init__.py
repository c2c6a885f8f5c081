"""FMUs of FMI 2.0 and 3.0 as components, called through their C functions."""

from pathlib import Path

from orchestrator.cosim.component import Component
from orchestrator.cosim.fmu.description import CO_SIMULATION, SCHEDULED, FmuDescription, read_description
from orchestrator.cosim.system import ComponentSpec

__all__ = ["FmuDescription", "open_fmu", "read_description"]


def open_fmu(spec: ComponentSpec, folder: Path) -> Component:
    """Load and instantiate the FMU of a component.

    `spec.options`: `interface` ("CoSimulation", "ModelExchange" or "ScheduledExecution"; co-simulation where there is a
    choice), `early_return` (whether an FMI 3 FMU may end a step at an event, which masters with rollback make use of)
    and `ticks` (of scheduled execution: times in s of each input clock that somebody has to trigger).

    Raises:
        FmuError: if the file is no FMU or has no binary that can be loaded here.
        ComponentError: if it cannot be instantiated.
    """
    description = read_description(folder / spec.source)
    interface = description.interface(spec.options.get("interface"))
    if interface.kind == CO_SIMULATION:
        from orchestrator.cosim.fmu.stepping import SteppingFmu

        return SteppingFmu(spec.name, description, interface, early_return=bool(spec.options.get("early_return")))
    if interface.kind == SCHEDULED:
        from orchestrator.cosim.fmu.scheduled import ScheduledFmu

        return ScheduledFmu(spec.name, description, interface, ticks=spec.options.get("ticks"))
    from orchestrator.cosim.fmu.exchange import ExchangeFmu

    return ExchangeFmu(spec.name, description, interface)

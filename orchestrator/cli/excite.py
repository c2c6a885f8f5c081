"""`--excite`: inputs that nothing drives move, so that a difference of two FMUs can show."""

import math
from dataclasses import replace
from typing import TYPE_CHECKING

from fmus.errors import MisfitError

if TYPE_CHECKING:
    from orchestrator.cosim.component import Port
    from orchestrator.cosim.system import System
    from orchestrator.results import ResultComparison

STEPS = 1000


def excited(system: "System", stop: float | None) -> tuple["System", list[str]]:
    """The system with a sine for each input that nothing drives, and the names of these inputs.

    Each moves within its declared range, or around its nominal or start value, with a frequency of its own. Inputs that are
    no numbers, arrays, and those with a value of their own stay.

    Args:
        stop: end of the run in s; None for that of the system.

    Raises:
        MisfitError: if no end is known.
    """
    from orchestrator.regress.prepare import driven
    from orchestrator.regress.wave import generated, within_ranges

    start = system.run.start or 0.0
    stop = system.run.stop if stop is None else stop
    if stop is None or not start < stop < math.inf:
        raise MisfitError("--excite needs the end of the run; give a stop time in s, such as --stop 10")
    step = system.run.step or (stop - start) / STEPS
    system = replace(system, run=replace(system.run, step=step))
    waves = within_ranges(_free_inputs(system), stop - start)
    system = driven(system, {name: (generated(wave, start, stop, step), "") for name, wave in waves.items()})
    return system, list(waves)


def without_drive(found: "ResultComparison") -> "ResultComparison":
    """The comparison without what drives the inputs, which proves nothing."""
    from orchestrator.regress.prepare import DRIVE

    return replace(found, signals=tuple(s for s in found.signals if not s.name.startswith(f"{DRIVE}.")))


def _free_inputs(system: "System") -> list["Port"]:
    """Scalar numbers that no connection ends in, by the name of the system's input or `component.variable`."""
    from orchestrator.cosim.component import FLOATS
    from orchestrator.cosim.kinds import describe

    taken = {connection.target for connection in system.connections}
    outer = {target: name for name, targets in system.inputs.items() for target in targets}
    found: dict[str, Port] = {}
    for component, spec in system.components.items():
        for port in describe(spec, system.folder).ports:
            address = f"{component}.{port.name}"
            if port.causality != "input" or port.type not in FLOATS or port.shape:
                continue
            if address not in taken and port.name not in spec.values:
                name = outer.get(address, address)
                found.setdefault(name, replace(port, name=name))
    return list(found.values())

"""What one run reaches of its model: states, branches, inputs and parameters.

A branch is a side of an event indicator, which an FMU has for each condition that makes an event. Only its model exchange
interface shows indicators, so the case runs by that one where there is one.
"""

import ctypes
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from fmus.errors import MisfitError
from orchestrator.cosim.fmu import FmuDescription, read_description
from orchestrator.cosim.fmu.description import MODEL_EXCHANGE
from orchestrator.cosim.fmu.exchange import ExchangeFmu
from orchestrator.cosim.simulation import Simulation
from orchestrator.cosim.system import System
from orchestrator.regress.case import Case
from orchestrator.regress.prepare import DRIVE, single, system_of
from orchestrator.regress.recording import Watched

_MOST_POINTS = 20_000


def reached(case: Case, progress: Watched) -> Mapping[str, Any]:
    """Lowest and highest value of each state and input, sides of each indicator, values of parameters.

    Raises:
        MisfitError: if the model is no single FMU.
        ComponentError: if it fails.
    """
    system = system_of(case)
    alone = single(system)
    if not alone or system.components[alone].kind != "fmu":
        raise MisfitError(f"{case.name}: coverage is of single FMUs; {system.name!r} is a system")
    description = read_description(system.folder / system.components[alone].source)
    if MODEL_EXCHANGE in description.interfaces:
        system = system_of(replace(case, interface=MODEL_EXCHANGE))
    progress.begin(system)
    with Simulation(system, progress=progress) as simulation:
        seen = _Seen(simulation, system, alone, description)
        seen.run()
    short = len(alone) + 1
    parameters = {
        name if name in description.by_name else name[short:]: value.value for name, value in case.parameters.items()
    }
    return {
        "model": str(system.folder / system.components[alone].source),
        "states": seen.ranges(description.state_names),
        "inputs": seen.ranges(_inputs(system)),
        "branches": [{"negative": bool(low), "positive": bool(high)} for low, high in seen.sides],
        "nearest": [float(value) for value in seen.nearest],
        "parameters": parameters,
    }


def _inputs(system: System) -> tuple[str, ...]:
    """Names of the driven inputs."""
    if DRIVE not in system.components:
        return ()
    return tuple(port.name for port in system.components[DRIVE].options["arguments"]["ports"])


class _Seen:
    """Looks at a run point by point."""

    def __init__(self, simulation: Simulation, system: System, alone: str, description: FmuDescription) -> None:
        self._simulation, self._system = simulation, system
        component = simulation.coupling.components[alone]
        self._instance = component.instance if isinstance(component, ExchangeFmu) else None
        states = [name for name in description.state_names if name in description.by_name]
        self._names = [*states, *_inputs(system)]
        self._addresses = [f"{alone}.{name}" for name in self._names]
        count = description.n_indicators if self._instance is not None else 0
        self._buffer = (ctypes.c_double * count)()
        self._rows: list[list[float]] = []
        self.sides = np.zeros((count, 2), dtype=bool)
        self.nearest = np.full(count, np.inf)
        if isinstance(component, ExchangeFmu):
            component.equations.at_event = self._look_at_indicators

    def run(self) -> None:
        """Go from point to point."""
        run = self._system.run
        assert run.stop is not None and run.step is not None
        start = run.start or 0.0
        step = max(run.step, (run.stop - start) / _MOST_POINTS)
        self._simulation.initialise()
        self._look()
        count = 0
        while not self._simulation.ended and run.stop - self._simulation.time > 1e-9 * step:
            count += 1
            self._simulation.run(min(start + count * step, run.stop))
            self._look()

    def ranges(self, names: tuple[str, ...]) -> dict[str, list[float]]:
        """Lowest and highest value of variables."""
        table = np.array(self._rows).reshape(len(self._rows), len(self._names))
        found = {}
        for name in names:
            if name in self._names:
                column = table[:, self._names.index(name)]
                found[name] = [float(column.min()), float(column.max())]
        return found

    def _look(self) -> None:
        self._rows.append([float(self._simulation.get(address)) for address in self._addresses])
        self._look_at_indicators()

    def _look_at_indicators(self) -> None:
        if self._instance is not None and len(self._buffer):
            self._instance.call("GetEventIndicators", self._buffer, ctypes.c_size_t(len(self._buffer)))
            values = np.array(self._buffer)
            self.sides |= np.column_stack([values <= 0.0, values > 0.0])
            self.nearest = np.minimum(self.nearest, np.abs(values))

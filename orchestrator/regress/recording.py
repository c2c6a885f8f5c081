"""A run of a case: the trajectories of the signals that are wanted."""

import time as clock
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from orchestrator.cosim.component import FLOATS, Port
from orchestrator.cosim.isolate.process import label
from orchestrator.cosim.kinds import describe
from orchestrator.cosim.progress import Progress
from orchestrator.cosim.simulation import Simulation
from orchestrator.cosim.system import System, split_address
from orchestrator.measurements.wording import nearest
from orchestrator.regress.comparison import Signal
from orchestrator.regress.prepare import DRIVE, single
from orchestrator.results.recorder import MemoryRecorder


def nobody(labels: Sequence[str]) -> None:
    """Tell nobody."""


class Watched(Progress):
    """Progress that announces what it is about to count; results stay in this process."""

    def __init__(self, memory: Any = None, announce: Callable[[Sequence[str]], None] = nobody) -> None:
        super().__init__(memory)
        self._announce = announce

    def begin(self, system: System) -> None:
        """Say that a system is about to be loaded."""
        word = self.word
        word.component, word.call, word.time, word.last_good, word.rows = -1, 0, 0.0, 0.0, 0
        self._announce([label(spec) for spec in system.components.values()])


_MOST_NEAREST = 20


@dataclass(frozen=True, eq=False)
class Recording:
    """What a run gave: `signals` by name, CPU seconds and simulated time at its end; `ended` says who ended it, if anybody."""

    signals: Mapping[str, Signal]
    seconds: float
    end: float
    ended: str = ""
    provenance: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Wanted:
    """Signals by name with their addresses, and those of them that only a step-by-step run can read."""

    addresses: Mapping[str, str]
    ports: Mapping[str, Port]
    inside: tuple[str, ...]

    @property
    def recorded(self) -> tuple[str, ...]:
        """Addresses of inputs and outputs."""
        return tuple(address for name, address in self.addresses.items() if name not in self.inside)


def wanted_signals(system: System, names: Sequence[str] = ()) -> tuple[Wanted, tuple[str, ...]]:
    """Find signals by name, all outputs without names; and the names that no variable has.

    A signal of a system of one component needs no component before it.
    """
    alone = single(system)
    ports = _ports(system)
    if not names:
        names = [_short(address, alone) for address, port in ports.items() if port.causality == "output"]
        names = [name for name in names if not name.startswith(f"{DRIVE}.")]
    addresses, missing = {}, []
    for name in names:
        address = next((a for a in (name, f"{alone}.{name}", system.outputs.get(name, "")) if a in ports), None)
        if address is None:
            missing.append(name)
        else:
            addresses[name] = address
    inside = tuple(n for n, a in addresses.items() if ports[a].causality not in ("input", "output"))
    return Wanted(addresses, {n: ports[a] for n, a in addresses.items()}, inside), tuple(missing)


def missing_reasons(system: System, names: Sequence[str]) -> dict[str, str]:
    """Why signals cannot be compared, by name; the nearest variables are told for the first of them, since finding them takes long."""
    alone = single(system)
    known = [_short(address, alone) for address in _ports(system)]
    near = {name: f"; {nearest(name, known)}" for name in names[:_MOST_NEAREST]}
    return {name: f"the model has no variable {name!r}{near.get(name, '')}" for name in names}


def record(
    system: System,
    wanted: Wanted,
    progress: Watched | None = None,
    open_: Callable[..., Any] = Simulation,
    **options: Any,
) -> Recording:
    """Run a system to its stop time.

    Args:
        system: with start, stop and step.
        wanted: what to keep.
        progress: where to note who is called.
        open_: what simulates.

    Raises:
        MisfitError: if the system cannot be run.
        ComponentError: if a component fails.
    """
    began = clock.process_time()
    if progress is not None:
        progress.begin(system)
        options["progress"] = progress
    recorded = wanted.recorded or None
    with open_(system, record=recorded, **options) as simulation:
        memory = MemoryRecorder()
        inside = _run_stepwise(simulation, system, wanted, memory) if wanted.inside else {}
        if not wanted.inside:
            simulation.run(system.run.stop, memory)
        memory.finish(simulation.ended)
        result = memory.result()
        end, ended, provenance = simulation.time, simulation.ended, dict(simulation.provenance())
    signals = {}
    for name, address in wanted.addresses.items():
        values = inside[name] if name in inside else result[address]
        signals[name] = _signal(name, wanted.ports[name], result.time, values)
    return Recording(signals, clock.process_time() - began, end, ended, provenance)


def _run_stepwise(simulation: Any, system: System, wanted: Wanted, memory: MemoryRecorder) -> dict[str, np.ndarray]:
    """Run point by point, since variables that are neither inputs nor outputs are not recorded on the way."""
    start, stop, step = system.run.start or 0.0, system.run.stop, system.run.step
    assert stop is not None and step is not None
    rows = []

    def read() -> None:
        rows.append([float(simulation.get(wanted.addresses[name])) for name in wanted.inside])

    simulation.initialise()
    simulation.run(simulation.time, memory)
    read()
    count = 0
    while not simulation.ended and stop - simulation.time > 1e-9 * step:
        count += 1
        simulation.run(min(start + count * step, stop), memory)
        read()
    table = np.array(rows).reshape(len(rows), len(wanted.inside))
    return {name: table[:, k] for k, name in enumerate(wanted.inside)}


def _signal(name: str, port: Port, time: np.ndarray, values: Any) -> Signal:
    smooth = port.type in FLOATS and port.variability == "continuous"
    nominal = abs(float(port.nominal)) if port.nominal else None
    return Signal(name, time, np.asarray(values, dtype=float), port.unit, "linear" if smooth else "hold", nominal)


def _ports(system: System) -> dict[str, Port]:
    """Ports by address, arrays by element; texts and clocks have no trajectory."""
    found = {}
    for name, spec in system.components.items():
        for port in describe(spec, system.folder).ports:
            if port.type in ("String", "Binary", "Clock"):
                continue
            for element in port.elements:
                found[f"{name}.{element}"] = port
    return found


def _short(address: str, alone: str) -> str:
    component, variable = split_address(address)
    return variable if component == alone else address

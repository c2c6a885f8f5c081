"""A run as a user asks for it: in a process of its own where that is wise, recorded, at the pace of the clock if wanted."""

import math
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from fmus.errors import MisfitError
from fmus.trust import is_trusted, trust
from orchestrator.cosim.assembly import Report
from orchestrator.cosim.isolate.process import Limits
from orchestrator.cosim.isolate.simulation import IsolatedSimulation
from orchestrator.cosim.realtime import Lateness, Pacer
from orchestrator.cosim.simulation import Simulation
from orchestrator.cosim.system import System
from orchestrator.results.column import Column
from orchestrator.results.recorder import Recorder

# Thirty million years: what `--stop inf` means.
ENDLESS_S = 1e15
MOST_STEPS = 1e12
Watch = Callable[[float], None]


@dataclass(frozen=True)
class RunOptions:
    """How to run: times in s, None for what the system says; a `stop` of inf goes on until somebody stops it.

    `record` are patterns of columns, all outputs without any; `every` counts communication points to a row. `isolate` is
    None for the rule of `untrusted`; `realtime` is simulated time over clock time, None for as fast as possible.
    """

    stop: float | None = None
    step: float | None = None
    master: str | None = None
    tolerance: float | None = None
    record: tuple[str, ...] | None = None
    every: int = 1
    isolate: bool | None = None
    limits: Limits = field(default_factory=Limits)
    realtime: float | None = None

    @property
    def simulation(self) -> dict[str, Any]:
        """Those that `Simulation` takes."""
        names = ("step", "master", "tolerance", "record", "every")
        return {"stop": None if self.stop == math.inf else self.stop, **{name: getattr(self, name) for name in names}}


@dataclass(frozen=True)
class RunOutcome:
    """A run that is over: simulated time from `start` to `end`, `seconds` of the clock for the run, `preparing` before it.

    `ended` says which component ended the run, "" if none did.
    """

    start: float
    end: float
    stop: float
    step: float | None
    seconds: float
    preparing: float
    isolated: bool
    report: Report
    columns: tuple[Column, ...]
    provenance: Mapping[str, Any]
    ended: str = ""
    lateness: Lateness | None = None


def untrusted(system: System) -> tuple[str, ...]:
    """Components whose FMU is neither built here nor trusted by the user: their runs belong in a process of their own."""
    from orchestrator.cosim.fmu import read_description

    return tuple(
        name
        for name, spec in system.components.items()
        if spec.kind == "fmu" and not is_trusted(read_description(system.folder / spec.source).digest)
    )


def trust_all(system: System) -> None:
    """Trust the FMUs of a system from now on."""
    from orchestrator.cosim.fmu import read_description

    for name, spec in system.components.items():
        if spec.kind == "fmu":
            path = system.folder / spec.source
            trust(read_description(path).digest, f"trusted by the user as {name}, {path.resolve()}")


def open_simulation(system: System, options: RunOptions) -> Simulation | IsolatedSimulation:
    """Load a system, in a process of its own if the options or the rule of trust say so.

    Raises:
        MisfitError: if the system cannot be run.
        ComponentError: if a component fails while it is loaded.
    """
    apart = bool(untrusted(system)) if options.isolate is None else options.isolate
    if apart:
        return IsolatedSimulation(system, options.limits, **options.simulation)
    return Simulation(system, **options.simulation)


def run_system(
    system: System, recorder: Recorder, options: RunOptions | None = None, watch: Watch | None = None
) -> RunOutcome:
    """Run a system and end the recorder, whatever happens; what was recorded until a failure is kept.

    Args:
        recorder: gets the rows.
        watch: is called now and then with the simulated time in s.

    Raises:
        MisfitError: if the system cannot be run, or nothing says for how long.
        ComponentError: if a component fails, crashes, hangs, or gives a value that is none.
    """
    options = options or RunOptions()
    failure = "interrupted"
    began = time.perf_counter()
    try:
        with open_simulation(system, options) as simulation:
            outcome = _run(simulation, system, recorder, options, watch, began)
        failure = outcome.ended
    except MisfitError as error:
        failure = str(error)
        raise
    finally:
        recorder.finish(failure)
    return outcome


def _run(
    simulation: Simulation | IsolatedSimulation,
    system: System,
    recorder: Recorder,
    options: RunOptions,
    watch: Watch | None,
    began: float,
) -> RunOutcome:
    stop = system.run.stop if options.stop is None else options.stop
    if stop is None:
        raise MisfitError(f"nothing says how long to run {system.name!r}; give a stop time in s, such as --stop 10")
    start, lateness = simulation.time, None
    if not stop > start:
        raise MisfitError(f"the run would end at {stop:g} s, but begins at {start:g} s; give a later --stop")
    step = simulation.step_size
    if step and stop < math.inf and not 0.0 < (stop - start) / step < MOST_STEPS:
        raise MisfitError(
            f"{(stop - start) / step:.2g} steps of {step:g} s from {start:g} to {stop:g} s: give another --step"
        )
    stop = min(stop, ENDLESS_S)
    simulation.initialise()
    ready = time.perf_counter()
    if options.realtime is None:
        simulation.run(stop, recorder, watch)
    else:
        lateness = _paced(simulation, stop, recorder, options.realtime, watch)
    return RunOutcome(
        start=start,
        end=simulation.time,
        stop=stop,
        step=simulation.step_size,
        seconds=time.perf_counter() - ready,
        preparing=ready - began,
        isolated=isinstance(simulation, IsolatedSimulation),
        report=simulation.report,
        columns=tuple(simulation.columns),
        provenance=simulation.provenance(),
        ended=simulation.ended,
        lateness=lateness,
    )


def _paced(
    simulation: Simulation | IsolatedSimulation, stop: float, recorder: Recorder, factor: float, watch: Watch | None
) -> Lateness:
    step = simulation.step_size
    if step is None:
        raise MisfitError("a master that chooses its steps cannot keep pace with a clock; choose ordered or jacobi")
    if not factor > 0.0:
        raise MisfitError(f"--realtime {factor:g}: expected simulated seconds for each second, such as 1")
    pacer, start, k = Pacer(factor), simulation.time, 0
    pacer.begin(start)
    while not simulation.ended and stop - simulation.time > 1e-9 * step:
        k += 1
        simulation.run(min(start + k * step, stop), recorder)
        pacer.reached(simulation.time, step)
        if watch is not None:
            watch(simulation.time)
    return pacer.report()

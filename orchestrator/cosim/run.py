"""A run as a user asks for it: in a process of its own where that is wise, recorded, at the pace of the clock if wanted."""

import math
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from fmus.errors import MisfitError
from fmus.trust import is_trusted, trust
from orchestrator.cosim.assembly import Report
from orchestrator.cosim.isolate.process import ChildLimits
from orchestrator.cosim.isolate.simulation import IsolatedSimulation
from orchestrator.cosim.load import load_system
from orchestrator.cosim.simulation import Simulation
from orchestrator.cosim.system import System
from orchestrator.results.column import Column
from orchestrator.results.recorder import MemoryRecorder, Recorder
from orchestrator.results.result import Result

# Sleeping longer than this loses to waiting actively: the system wakes a process up to about 0.1 ms late.
ACTIVE_S = 2e-4


@dataclass(frozen=True)
class Lateness:
    """How late communication points were complete, in s of the clock; `missed` counts those late by a step or more.

    `factor` is simulated time over clock time that was asked for; `points` how many communication points there were.
    """

    factor: float
    points: int
    p50: float
    p99: float
    largest: float
    missed: int

    def to_json(self) -> dict[str, Any]:
        """The report as JSON, times in us."""
        late = {
            name: round(1e6 * value, 3) for name, value in (("p50", self.p50), ("p99", self.p99), ("max", self.largest))
        }
        return {"factor": self.factor, "points": self.points, "lateness_us": late, "missed": self.missed}


class Pacer:
    """Holds a run back so that simulated time is not ahead of the clock.

    `factor` is simulated seconds for each second of the clock. A run that is late is not held back and catches up.
    """

    def __init__(
        self, factor: float, clock: Callable[[], float] = time.perf_counter, sleep: Callable[[float], None] = time.sleep
    ) -> None:
        self.factor = factor
        self._clock, self._sleep = clock, sleep
        self._began, self._first = 0.0, 0.0
        self._late: list[float] = []
        self._missed = 0

    def begin(self, simulated: float) -> None:
        """Start the clock at a simulated time in s."""
        self._began, self._first = self._clock(), simulated

    def reached(self, simulated: float, step: float) -> None:
        """Note that a communication point is complete, `step` s after the last, and wait until it is due."""
        due = self._began + (simulated - self._first) / self.factor
        late = self._clock() - due
        self._late.append(max(late, 0.0))
        self._missed += late >= step / self.factor
        if -late > ACTIVE_S:
            self._sleep(-late - ACTIVE_S)
        while self._clock() < due:
            pass

    def report(self) -> Lateness:
        """How late the points were that have been reached."""
        late = np.array(self._late or [0.0])
        p50, p99 = np.percentile(late, [50, 99])
        return Lateness(self.factor, len(self._late), float(p50), float(p99), float(late.max()), int(self._missed))


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
    limits: ChildLimits = field(default_factory=ChildLimits)
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


def simulate(model: System | str | Path, **options: Any) -> Result:
    """Run a system from beginning to end; all outputs are recorded unless `record` says otherwise.

    Args:
        model: a system, or whatever `load_system` takes.
        options: fields of `RunOptions`, such as `stop` and `step` in s.

    Raises:
        MisfitError: if the system cannot be run, or nothing says for how long.
        ComponentError: if a component fails; to keep the rows until then, use `run_system` with a recorder.
    """
    system = model if isinstance(model, System) else load_system(model)
    recorder = MemoryRecorder()
    run_system(system, recorder, RunOptions(**options))
    return recorder.result()

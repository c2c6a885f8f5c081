"""An FMU, with or without effects around it, as a model that can follow trials and be fitted."""

import hashlib
from collections.abc import Sequence
from functools import cached_property, lru_cache

import numpy as np

from fmus.symbolic.system import Variable
from orchestrator.blackbox.compiled import CoupledRuns
from orchestrator.blackbox.coupled import CoupledSystem, couple
from orchestrator.blackbox.fmu_file import FmuFile
from orchestrator.blackbox.sites import Position, Sites, plain_sites
from orchestrator.models.correction import ResidualSystem
from orchestrator.models.estimation import Record
from orchestrator.models.smoothing import SmoothedTrial
from orchestrator.models.symbolic import SymbolicModel

# Slopes come from differences of runs, whose solvers adapt; this much they may be off.
LOOSE = 0.05
SAMPLES = 3


@lru_cache(maxsize=16)
def positions_by_runs(file: FmuFile, step: float) -> dict[int, Position]:
    """Outputs that begin at one settable state, and the state that is their rate; empty where none does.

    Args:
        step: sample interval in s, at which the FMU can be stepped.

    Raises:
        ComponentError: if the FMU fails.
    """
    sites = plain_sites(file.started)
    if not file.description.cosimulation or not sites.states:
        return {}
    runs = CoupledRuns(
        couple(file.path.name, sites, ()),
        sites,
        file.description.settable,
        file.processes,
        [v.name for v in sites.outputs],
    )
    first = np.array([0.0 if v.start is None else v.start for v in sites.states])
    here, there = (_found(runs, start, step) for start in (first, first + 0.37 * (1 + np.abs(first))))
    # An output that merely happens to be linear where the FMU starts is none.
    return {k: p for k, p in here.items() if k in there and _alike(p, there[k])}


def _found(runs: CoupledRuns, start: np.ndarray, step: float) -> dict[int, Position]:
    time = step * np.arange(SAMPLES)
    idle = np.array([0.0 if v.start is None else v.start for v in runs.sites.inputs])
    run = runs.run(time, np.tile(idle, (SAMPLES, 1)), runs.parameters, start, sensitivities=True)
    assert run.sensitivities is not None
    found = {}
    for k, (begin, next_one) in enumerate(zip(run.sensitivities[0], run.sensitivities[1], strict=True)):
        largest = float(np.abs(begin).max())
        shown = np.flatnonzero(np.abs(begin) > LOOSE * max(largest, 1e-300))
        if len(shown) != 1:
            continue
        state = int(shown[0])
        slope = float(begin[state])
        rates = (next_one - begin) / step / slope
        speeds = [int(j) for j in np.flatnonzero(np.abs(rates - 1) < LOOSE) if j != state]
        speed = speeds[0] if len(speeds) == 1 else None
        found[k] = Position(state, speed, slope, float(run.outputs[0, k] - slope * start[state]))
    return found


def _alike(one: Position, other: Position) -> bool:
    same = (one.state, one.speed) == (other.state, other.speed)
    return same and abs(one.slope - other.slope) < LOOSE * abs(one.slope)


# What a sensor shows of a start value depends on the parameters of these.
READING_SLOTS = ("outputLag.", "outputScale.", "outputOffset.")


class CoupledModel(SymbolicModel):
    """A coupled system as a model; it has no residual in its equations, which are closed."""

    def __init__(
        self,
        name: str,
        system: CoupledSystem,
        file: FmuFile,
        sites: Sites,
        signals: Sequence[str] | None = None,
        free: Sequence[str] = (),
        held: Sequence[str] = (),
    ) -> None:
        self.name, self.system, self.coupled = name, system, system
        self.signals = tuple(signals if signals is not None else system.outputs)
        self.file, self.sites = file, sites
        self.is_stepped = file.description.cosimulation
        settable = file.description.settable
        self.compiled = CoupledRuns(system, sites, settable, file.processes, self.signals, free, held)

    @property
    def outputs(self) -> Sequence[Variable]:
        return self.sites.outputs

    @cached_property
    def content_hash(self) -> str:
        """SHA-256 over the FMU's file, the effects' equations and their values."""
        assert self.coupled.outer is not None
        parts = [self.file.content_hash, repr(self.system.parameters), self.coupled.rhs.serialize()]
        parts += [repr(dict(self.coupled.values))] if self.coupled.values else []
        return hashlib.sha256("".join([*parts, self.coupled.outer.serialize()]).encode()).hexdigest()

    @property
    def residual(self) -> ResidualSystem | None:  # type: ignore[override]
        return None

    @property
    def reads_through_parameters(self) -> bool:  # type: ignore[override]
        return any(name.startswith(READING_SLOTS) for name in self.compiled.free)

    def _lag(self, k: int, parameters: np.ndarray | None) -> float:
        """Time constant in s between output k and its reading, 0 without one."""
        if not any(
            m.slot == "outputLag" and self.sites.measured[p - 1] == k for m in self.coupled.mounted for p in m.places
        ):
            return 0.0
        names = [v.name for v in self.system.parameters]
        values = self.compiled.parameters if parameters is None else parameters
        return float(values[names.index("outputLag.T")])

    def _sensor(self, k: int, parameters: np.ndarray | None) -> tuple[float, float]:
        """Scale and offset between output k and its reading, as far as sensor errors are attached."""
        if k not in self.sites.measured:
            return 1.0, 0.0
        place = self.sites.measured.index(k) + 1
        names = [v.name for v in self.system.parameters]
        values = self.compiled.parameters if parameters is None else parameters
        wanted = ((f"outputScale.k[{place}]", 1.0), (f"outputOffset.c[{place}]", 0.0))
        scale, offset = (float(values[names.index(name)]) if name in names else absent for name, absent in wanted)
        return scale, offset

    @property
    def shows_jacobians(self) -> bool:
        """Whether the FMU can be asked how it answers to small changes: model exchange, with no effect around it."""
        return bool(self.sites.states) and not self.file.description.cosimulation and not self.coupled.mounted

    def jacobians(self, record: Record, start: np.ndarray, substeps: int) -> tuple[np.ndarray, ...]:
        """Along a free run, d rates/d states, d rates/d inputs, d signals/d states, d signals/d inputs, each (n, ., .)."""
        full = self.file.jacobians(record.time, record.inputs, start, substeps, self.compiled.held)
        nx, names = len(start), [v.name for v in self.sites.outputs]
        rows = [nx + names.index(name) for name in self.signals]
        return full[:, :nx, :nx], full[:, :nx, nx:], full[:, rows, :nx], full[:, rows, nx:]

    def restricted(self, signals: Sequence[str], free: Sequence[str] = ()) -> "CoupledModel":
        if tuple(signals) == self.signals and tuple(free) == self.compiled.free:
            return self
        return CoupledModel(self.name, self.coupled, self.file, self.sites, signals, free, self.compiled.held)

    def with_held(self, held: Sequence[str]) -> "CoupledModel":
        """The same model whose inputs `held` stay until the next sample."""
        if tuple(held) == self.compiled.held:
            return self
        return CoupledModel(self.name, self.coupled, self.file, self.sites, self.signals, self.compiled.free, held)

    def record(self, trial: SmoothedTrial, parameters: np.ndarray | None = None) -> Record:
        """A trial with first guesses of the start values: measured states from the smoothed record, lags where their
        signal begins, others as the FMU declares them."""
        states = self.system.states
        start = np.array([0.0 if v.start is None else v.start for v in states])
        low = np.array([-np.inf if v.minimum is None else v.minimum for v in states])
        high = np.array([np.inf if v.maximum is None else v.maximum for v in states])
        names = [v.name for v in self.sites.outputs]
        step = float(np.median(np.diff(trial.time)))
        stepped = self.file.description.cosimulation
        for k, position in (positions_by_runs(self.file, step) if stepped else self.sites.positions).items():
            if names[k] not in self.signals:
                continue
            m = self.signals.index(names[k])
            scale, offset = self._sensor(k, parameters)
            first, slope = trial.beginnings[m], scale * position.slope
            value, std = (first.value - offset - scale * position.offset) / slope, first.value_std / abs(slope)
            shown = [(position.state, value, std)]
            if position.speed is not None:
                shown.append((position.speed, first.speed / slope, first.speed_std / abs(slope)))
            late = self._lag(k, parameters)
            for state, at, far in shown:
                start[state], low[state], high[state] = at, at - 5 * far, at + 5 * far
            if late > 0:  # the reading shows where the state was
                start[position.state] += late * first.speed / slope
                for state, _, _ in shown:
                    low[state], high[state] = -np.inf, np.inf
        for j, follows in enumerate(self.coupled.follows, start=len(self.sites.states)):
            if follows is not None and follows[0] == "input":
                start[j] = trial.inputs[0, follows[1]]
            elif follows is not None:
                start[j] = trial.values[0, self.signals.index(names[follows[1]])]
        start = np.clip(start, low, high)
        return Record(trial.time, trial.inputs, trial.measured, start, np.full(len(states), np.inf), low, high)

"""What a set of effects explains: fitted on correction residuals (screening), and on free runs (refit)."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from orchestrator.diagnosis.candidates import Candidate, EffectSet
from orchestrator.measurements import BoundSet, BoundTrial
from orchestrator.models.estimation import Fit, Record, fit
from orchestrator.models.symbolic import SymbolicModel


@dataclass(frozen=True)
class LearningData:
    """Learning trials, the sensor noise and the noise floor of each signal (in the order of `data.output_names`)."""

    data: BoundSet
    trials: tuple[BoundTrial, ...]
    noise: np.ndarray
    floor: np.ndarray

    @staticmethod
    def of(data: BoundSet, floor: Mapping[str, float]) -> "LearningData":
        """Take the learning trials of a bound set."""
        noise = np.array([data.noise_std[name] for name in data.output_names])
        return LearningData(data, tuple(data.learning), noise, np.array([floor[name] for name in data.output_names]))


@dataclass(frozen=True)
class Screened:
    """A set of candidates fitted to the correction residual; `gain` is the share of its square that is explained."""

    candidates: tuple[Candidate, ...]
    values: np.ndarray
    gain: float


@dataclass(frozen=True)
class Refit:
    """A set of candidates fitted by free runs; `cost` is the mean square error over the floor's square, 1 = perfect."""

    effects: EffectSet
    fit: Fit

    @property
    def cost(self) -> float:
        """Mean over samples and signals of (error / floor)^2."""
        return self.fit.cost

    @property
    def ids(self) -> tuple[str, ...]:
        """Effect ids in the order of the set."""
        return tuple(candidate.card.id for candidate in self.effects.candidates)

    def is_meaningful(self) -> bool:
        """Tell whether each effect departs from its absence by a size that matters."""
        big: set[int] = set()
        rows = zip(self.effects.owners(), self.effects.card_parameters, self.fit.values, strict=True)
        for owner, parameter, value in rows:
            if abs(value - parameter.absent) >= parameter.meaningful:
                big.add(owner)
        return len(big) == len(self.effects.candidates)


def residual_records(model: SymbolicModel, learning: LearningData) -> list[Record]:
    """The learning trials as the residual system sees them: its outputs should be zero."""
    assert model.residual is not None
    names = [v.name for v in model.residual.system.states]
    positions = [[v.name for v in model.system.states].index(name) for name in names]
    records = []
    for trial in learning.trials:
        full = model.record(trial.time, trial.inputs, trial.outputs, learning.noise)
        inputs = model.residual_inputs(trial.time, trial.inputs, trial.outputs, learning.noise)
        zeros = np.zeros((len(trial.time), len(model.signals)))
        parts = (full.start, full.start_std, full.start_low, full.start_high)
        records.append(Record(trial.time, inputs, zeros, *(part[positions] for part in parts)))
    return records


def residual_size(model: SymbolicModel, learning: LearningData) -> np.ndarray:
    """Root mean square of the filtered correction residual of each signal, in its own unit (N.m, N, ...)."""
    compiled, squares = model.compiled_residual, []
    trial = learning.trials[0]
    smoother = model.smoother(trial.time, trial.outputs, learning.noise)
    for record in residual_records(model, learning):
        run = compiled.run(record.time, record.inputs, compiled.parameters, record.start)
        squares.append(np.mean(smoother.thin(run.outputs) ** 2, axis=0))
    return np.sqrt(np.mean(squares, axis=0))


def screen(effects: EffectSet, learning: LearningData, size: np.ndarray) -> Screened:
    """Fit a set's parameters to the correction residual; no free run is needed.

    Args:
        size: root mean square of the base model's residual (`residual_size`).
    """
    model, trial = effects.model, learning.trials[0]
    low, high = effects.bounds()
    found = fit(
        model.compiled_residual,
        residual_records(model, learning),
        size,
        np.clip(effects.first_guess(), low, high),
        low,
        high,
        substeps=1,
        reduce=model.smoother(trial.time, trial.outputs, learning.noise).thin,
        precise=False,
        threads=1,
    )
    return Screened(effects.candidates, found.values, 1.0 - found.cost)


def refit(effects: EffectSet, learning: LearningData, first: np.ndarray | None = None) -> Refit:
    """Fit a set's parameters, and the start values of all learning trials, by free runs."""
    model, low, high = effects.model, *effects.bounds()
    records = [model.record(t.time, t.inputs, t.outputs, learning.noise) for t in learning.trials]
    span = high - low
    guess = np.clip(effects.first_guess() if first is None else first, low + 0.01 * span, high - 0.01 * span)
    steps = max(model.substeps(r.time, r.inputs, r.start) for r in records[:2])
    found = fit(model.compiled, records, learning.floor, guess, low, high, substeps=steps, threads=1)
    return Refit(effects, found)

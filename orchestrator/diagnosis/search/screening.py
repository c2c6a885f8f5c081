"""Screening: how much of the correction residual each candidate explains, without a free run.

The residual is weighed so that white noise of the encoders stays nearly white in it: a double difference of a position
amplifies noise with the square of frequency, a low pass with a corner of `CORNER_HZ` takes that back.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import scipy

from orchestrator.blackbox.source import Source
from orchestrator.diagnosis.fit.candidates import EffectSet
from orchestrator.diagnosis.fit.canonical import oscillates, oscillations
from orchestrator.diagnosis.fit.evidence import LearningData, Refit
from orchestrator.diagnosis.fit.phases import with_phases
from orchestrator.diagnosis.search.thresholds import CORNER_HZ, MOST_PEAKS, WORTH_A_PEAK
from orchestrator.library.cards import Candidate
from orchestrator.models.estimation import Record, fit
from orchestrator.models.smoothing import low_pass
from orchestrator.models.symbolic import SymbolicModel


@dataclass(frozen=True)
class Screened:
    """A set of candidates with first values of its parameters; `gain` is the share of the residual's square explained.

    `others` are first values for a fit that may begin elsewhere, such as at other peaks of the residual's spectrum.
    """

    candidates: tuple[Candidate, ...]
    values: np.ndarray
    gain: float
    others: tuple[np.ndarray, ...] = ()


@dataclass(frozen=True)
class Regressors:
    """Weighed residual (m,) of a model along the learning trials, and its slopes (m, k) in k free parameters."""

    residual: np.ndarray
    slopes: np.ndarray


@dataclass(frozen=True)
class Explanation:
    """What a single candidate does to the residual: columns (m, c) that span it near its first values, none if it has none."""

    screened: Screened
    columns: np.ndarray
    linear: bool


class Screener:
    """Explains the correction residual of a model along the learning trials."""

    def __init__(self, base: Source, nominal: SymbolicModel, learning: LearningData) -> None:
        assert nominal.residual is not None
        self.base, self.nominal, self.learning = base, nominal, learning
        self._smoother = learning.trials[0].smoother
        # Only second differences need their noise taken back; those of first-order states are smoothed as they are.
        read = nominal.residual.positions
        self._positions = [name in read and read[name].speed is not None for name in nominal.signals]
        self._size = np.ones(len(nominal.signals))
        plain = self._regressors(nominal, nominal.compiled.parameters).residual
        self._size = np.sqrt(np.mean(plain.reshape(-1, len(nominal.signals)) ** 2, axis=0))
        self._nominal = self._regressors(nominal, nominal.compiled.parameters).residual

    def explain(self, group: Sequence[Candidate]) -> list[Explanation]:
        """Explain the residual by each candidate of one card; elements of one linear parameter share one model."""
        card = group[0].card
        if len(group) > 1 and len(card.parameters) == 1:
            return self._explain_elements(group)
        return [self._explain_one(candidate) for candidate in group]

    def _explain_elements(self, group: Sequence[Candidate]) -> list[Explanation]:
        effects = EffectSet(self.base, group, self.nominal.signals)
        absent = np.array([parameter.absent for parameter in effects.card_parameters])
        slopes = self._regressors(effects.model, effects.model.compiled.with_values(absent)).slopes
        low, high = effects.bounds()
        found = []
        for k, candidate in enumerate(group):
            column = slopes[:, [k]]
            change, gain = _least_squares(self._nominal, column)
            value = np.clip(absent[[k]] + change, low[[k]], high[[k]])
            found.append(Explanation(Screened((candidate,), value, gain), column, True))
        return found

    def _explain_one(self, candidate: Candidate) -> Explanation:
        effects = EffectSet(self.base, [candidate], self.nominal.signals)
        model, (low, high) = effects.model, effects.bounds()
        guess = np.clip(self._first_guess(effects), low, high)
        if model.residual is None:  # the effect hides the positions; only a free run can tell
            return Explanation(Screened((candidate,), guess, np.nan), np.zeros((0, 0)), False)
        plain, substeps = self._records(model, model.compiled.with_values(guess))
        guess, records = self._phased(effects, guess, plain, substeps)
        others = [self._phased(effects, row, plain, substeps)[0] for row in self._at_other_peaks(effects)]
        found = fit(
            model.compiled_residual,
            records,
            self._size,
            guess,
            low,
            high,
            substeps=substeps,
            reduce=self._weigh,
            tolerance=1e-3,
        )
        here = self._regressors(model, model.compiled.with_values(found.values), found.starts)
        gain = 1.0 - float(np.mean(here.residual**2) / np.mean(self._nominal**2))
        columns = np.column_stack([here.residual - self._nominal, here.slopes])
        return Explanation(Screened((candidate,), found.values, gain, tuple(others)), columns, False)

    def _phased(
        self, effects: EffectSet, guess: np.ndarray, records: list[Record], substeps: int
    ) -> tuple[np.ndarray, list[Record]]:
        """First values and records that begin with the amplitudes and phases of oscillations that the residual shows."""
        if not oscillates(effects):
            return guess, records
        compiled, parameters = effects.model.compiled_residual, effects.model.compiled.with_values(guess)

        def error_of(record: Record) -> Callable[[np.ndarray], np.ndarray]:
            def error(start: np.ndarray) -> np.ndarray:
                run = compiled.run(record.time, record.inputs, parameters, start, substeps=substeps)
                return self._weigh(run.outputs / self._size).ravel()

            return error

        places = list(oscillations(effects, compiled.system))
        errors = [error_of(record) for record in records]
        shapes = [(len(record.time), len(self._size)) for record in records]
        nothing = [np.zeros((self._weigh(np.zeros(shape)).size, 0)) for shape in shapes]
        first, starts = with_phases(places, guess, [r.start for r in records], errors, nothing)
        return first, [replace(r, start=start) for r, start in zip(records, starts, strict=True)]

    def extend(self, current: Refit, placed: Iterable[tuple[Candidate, Explanation]]) -> list[Screened]:
        """Explain what a fitted set leaves, by each further candidate; gains count from what is left."""
        here = self._regressors(current.effects.model, current.effects.model.compiled.with_values(current.values))
        _, own = _least_squares(here.residual, here.slopes)
        left = max((1.0 - own) * float(np.mean(here.residual**2)), np.finfo(float).tiny)
        found = []
        for candidate, explanation in placed:
            spans = explanation.columns.size > 0  # not where only a free run can tell
            both = np.column_stack([here.slopes, explanation.columns]) if spans else here.slopes
            change, gain = _least_squares(here.residual, both)
            value = explanation.screened.values
            if explanation.linear:
                value = np.array([parameter.absent for parameter in candidate.card.parameters]) + change[-len(value) :]
            after = (1.0 - gain) * float(np.mean(here.residual**2))
            hopeful = np.nan if np.isnan(explanation.screened.gain) else 1.0 - after / left
            others = tuple(beside(current, row) for row in explanation.screened.others)
            found.append(Screened((*current.effects.candidates, candidate), beside(current, value), hopeful, others))
        return found

    def _first_guess(self, effects: EffectSet) -> np.ndarray:
        guess = effects.first_guess()
        for k, parameter in enumerate(effects.card_parameters):
            if parameter.start_from == "residual_peak_hz":
                guess[k] = self._peaks_hz[0]
            if parameter.grid and effects.model.residual is not None:
                guess = self._scan(effects, k, parameter.grid)
        return guess

    def _at_other_peaks(self, effects: EffectSet) -> list[np.ndarray]:
        """First values (k,) with the frequency of an oscillation at each further peak of the residual's spectrum."""
        places = [k for k, p in enumerate(effects.card_parameters) if p.start_from == "residual_peak_hz"]
        rows = np.repeat(effects.first_guess()[None], len(self._peaks_hz) - 1 if places else 0, axis=0)
        rows[:, places] = np.array(self._peaks_hz[1:])[: len(rows), None]
        return list(np.clip(rows, *effects.bounds()))

    def _scan(self, effects: EffectSet, position: int, grid: Sequence[float]) -> np.ndarray:
        """Values of all parameters at the best point of a grid of one; the others enter linearly from their absence."""
        absent = np.array([parameter.absent for parameter in effects.card_parameters])
        best, most = effects.first_guess(), -np.inf
        for point in grid:
            values = absent.copy()
            values[position] = point
            here = self._regressors(effects.model, effects.model.compiled.with_values(values))
            others = np.delete(here.slopes, position, axis=1)
            change, _ = _least_squares(here.residual, others)
            left = here.residual + others @ change
            gain = -float(left @ left)
            if gain > most:
                most, best = gain, values + np.insert(change, position, 0.0)
        return best

    @cached_property
    def _peaks_hz(self) -> tuple[float, ...]:
        """Frequencies above `CORNER_HZ`/4 at which the nominal model's residual is large, over trials and signals, the
        largest first."""
        compiled, step = self.nominal.compiled_residual, self._smoother.step * self._smoother.stride
        powers, lines = [], []
        records, substeps = self._records(self.nominal, compiled.parameters)
        for record in records:
            run = compiled.run(record.time, record.inputs, compiled.parameters, record.start, substeps=substeps)
            series = self._weigh(run.outputs / self._size)
            frequency, power = scipy.signal.periodogram(series, 1 / step, "hann", nfft=2**14, axis=0)
            powers.append(power.sum(axis=1))
            lines.append(len(series) * step)
        return _peaks(frequency, np.sum(powers, axis=0), 1.0 / min(lines))

    def _regressors(
        self, model: SymbolicModel, parameters: np.ndarray, starts: Sequence[np.ndarray] | None = None
    ) -> Regressors:
        """Residual and slopes; `starts` gives the hidden states' start values of each trial, else their first guess."""
        compiled, residuals, slopes = model.compiled_residual, [], []
        records, substeps = self._records(model, parameters)
        for k, record in enumerate(records):
            start = record.start if starts is None else starts[k]
            run = compiled.run(record.time, record.inputs, parameters, start, substeps=substeps, sensitivities=True)
            assert run.sensitivities is not None
            hidden = len(compiled.system.states)
            residuals.append(self._weigh(run.outputs / self._size).ravel())
            part = self._weigh(run.sensitivities[:, :, hidden:] / self._size[None, :, None])
            slopes.append(part.reshape(len(residuals[-1]), -1))
        return Regressors(np.concatenate(residuals), np.concatenate(slopes))

    def _records(self, model: SymbolicModel, parameters: np.ndarray) -> tuple[list[Record], int]:
        """The learning trials as the residual system sees them: its outputs should be zero; and integration steps in a
        sample."""
        assert model.residual is not None
        names = [v.name for v in model.system.states]
        hidden = [names.index(v.name) for v in model.residual.system.states]
        records = []
        for trial in self.learning.trials:
            inputs = model.residual_inputs(trial)
            zeros = np.zeros((len(trial.time), len(model.signals)))
            parts = [np.zeros(0)] * 4
            if hidden:
                full = model.record(trial, parameters)
                parts = [part[hidden] for part in (full.start, full.start_std, full.start_low, full.start_high)]
            records.append(Record(trial.time, inputs, zeros, *parts))
        return records, model.residual_substeps(self.learning.trials[0], parameters, records[0].start)

    def _weigh(self, series: np.ndarray) -> np.ndarray:
        """Weigh against encoder noise, smooth and thin along the first axis; the second axis is that of the signals."""
        result, positions = series.copy(), np.flatnonzero(self._positions)
        if positions.size:
            result[:, positions] = low_pass(series[:, positions], 1, CORNER_HZ * 2 * self._smoother.step)
        return self._smoother.thin(result, CORNER_HZ if any(self._positions) else None)


def beside(current: Refit, values: np.ndarray) -> np.ndarray:
    """First values (k,) of a fitted set and those of a further effect."""
    return np.concatenate([current.values, values])


def _peaks(frequency: np.ndarray, power: np.ndarray, width: float) -> tuple[float, ...]:
    """Frequencies of the highest peaks of a spectrum above `CORNER_HZ`/4, the highest first, no two within a line's width.

    Args:
        frequency, power: (n,) in Hz, equally spaced, and in any unit.
        width: of a line of the shortest record: one over its length, in Hz.

    >>> f = np.linspace(0.0, 10.0, 1001)
    >>> _peaks(f, np.exp(-((f - 2) ** 2) / 0.01) + 0.1 * np.exp(-((f - 5) ** 2) / 0.01), 0.1)
    (2.0, 5.0)
    """
    above = np.where(frequency > CORNER_HZ / 4, power, 0.0)
    apart = max(1, round(2.0 * width / (frequency[1] - frequency[0])))
    places, _ = scipy.signal.find_peaks(above, height=WORTH_A_PEAK * above.max(), distance=apart)
    ordered = sorted({*places, int(np.argmax(above))}, key=lambda i: -above[i])
    return tuple(float(frequency[i]) for i in ordered[:MOST_PEAKS])


def _least_squares(residual: np.ndarray, columns: np.ndarray) -> tuple[np.ndarray, float]:
    """Changes that shrink residual + columns @ change, and the share of its square that goes away."""
    if columns.shape[1] == 0:
        return np.zeros(0), 0.0
    change, *_ = np.linalg.lstsq(columns, -residual, rcond=1e-10)
    left = residual + columns @ change
    return change, 1.0 - float(left @ left / (residual @ residual))

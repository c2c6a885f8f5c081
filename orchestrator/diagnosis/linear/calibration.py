"""Is something missing? Tests of a fitted model against noise records of the user's own trials.

The whole selection of sets runs on many records of noise, as it runs on the measurement; the share of them that reach
as far is the p-value. The noise has the level and the colour of what is left of the measurement when all candidates
and a flexible force are fitted to it.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy
from scipy import linalg

from orchestrator.diagnosis.fit.thresholds import NEAR_FLOOR
from orchestrator.diagnosis.linear.flexible import flexible_forces
from orchestrator.diagnosis.linear.subsets import BestSet, Library, score
from orchestrator.diagnosis.linear.tangent import Block, Tangent, orthonormal, split_by_trials
from orchestrator.diagnosis.linear.thresholds import (
    AR_ORDER,
    BEYOND_NOISE,
    NOTABLE,
    NULLS,
    PRACTICAL,
    SATURATED,
    SCATTER,
    SIGNIFICANT,
)


@dataclass(frozen=True)
class Colour:
    """Noise in the metric: autoregression `coefficients` (p,) of each signal's samples, and the `level` (rms)."""

    coefficients: np.ndarray
    level: float

    @property
    def scale(self) -> float:
        """By how much a drop of the misfit counts too much as twice a log likelihood: the noise's power at low frequency."""
        slow = self.level**2 / self._power / (1.0 - float(np.sum(self.coefficients))) ** 2
        return max(self.level**2, slow, 1e-12)

    def draw(self, rows: Sequence[int], signals: int, random: np.random.Generator) -> np.ndarray:
        """One record: trials of `rows` samples and signals each, one after the other.

        Args:
            rows: numbers (samples times signals) of each trial.
            signals: number of signals.
            random: the source of random numbers.

        Returns:
            Noise (sum of `rows`,) in the metric.
        """
        parts = []
        for count in rows:
            white = random.standard_normal((count // signals + 50, signals))
            series = scipy.signal.lfilter([1.0], np.r_[1.0, -self.coefficients], white, axis=0)[50:]
            parts.append(series.ravel())
        joined = np.concatenate(parts)
        return joined * (self.level / np.sqrt(self._power))

    @cached_property
    def _power(self) -> float:
        answer = scipy.signal.lfilter([1.0], np.r_[1.0, -self.coefficients], np.r_[1.0, np.zeros(2000)])
        return float(answer @ answer)


class Stage:
    """Tests of one fitted model: what a further effect would explain, and what a flexible force would."""

    def __init__(
        self, tangent: Tangent, blocks: Sequence[Block], further: int, seed: int, nominal: "Stage | None" = None
    ) -> None:
        first = self if nominal is None else nominal
        self.tangent, self.blocks, self.further, self.seed = tangent, tuple(blocks), further, seed
        self.library = Library([orthonormal(b.columns, 1e-3) for b in blocks], [b.candidate.label for b in blocks])
        self.nominal_rms = first.tangent.base.cost**0.5
        self.best = self.library.best(tangent.error, further)

    @cached_property
    def hidden_pair(self) -> BestSet | None:
        """The pair of which no part shows alone that explains the most."""
        return self.library.hidden_pair(self.tangent.error) if self.further > 1 and self.blocks else None

    @cached_property
    def flexible(self) -> np.ndarray:
        """Orthonormal answers to flexible forces."""
        response = self.tangent.response
        if not response.has_forces:
            return np.zeros((len(self.tangent.error), 0))
        forces = flexible_forces(response.trials)
        answers = self.tangent.in_metric([response.to_forces(k, f) for k, f in enumerate(forces)])
        return orthonormal(self.tangent.project(answers), 1e-3)

    @cached_property
    def colour(self) -> Colour:
        """Level and colour of what neither candidates nor flexible forces explain."""
        basis = self._saturated
        left = self.tangent.error - basis @ (basis.T @ self.tangent.error)
        freedom = max(self.tangent.data_rows - basis.shape[1] - self.tangent.basis.shape[1], 1)
        level = float(np.sqrt(left @ left / freedom))
        # A fit takes noise away where it is flexible, at low frequency most of all: that share of it is added again.
        taken = np.column_stack([basis, self.tangent.basis]) * level
        parts = [part for column in (left, *taken.T) for part in self._per_trial(column)]
        covariance = np.sum([_autocovariance(part) for part in parts], axis=0)
        coefficients = np.zeros(AR_ORDER)
        if covariance[0] > 0:
            covariance[0] *= 1 + 1e-6
            coefficients = linalg.solve_toeplitz(covariance[:-1], covariance[1:])
        return Colour(coefficients, level)

    @cached_property
    def _saturated(self) -> np.ndarray:
        columns = np.column_stack([self.library.stacked, self.flexible]) if self.blocks else self.flexible
        left, singular, _ = np.linalg.svd(columns, full_matrices=False)
        most = int(SATURATED * self.tangent.data_rows)
        return left[:, : min(most, int(np.sum(singular > 1e-2 * singular[:1].max(initial=0.0))))]

    def _per_trial(self, error: np.ndarray) -> list[np.ndarray]:
        signals = len(self.tangent.base.model.signals)
        return [part.reshape(-1, signals) for part in split_by_trials(error, self.tangent.rows_of_trials)]

    @cached_property
    def _nulls(self) -> tuple[np.ndarray, np.ndarray]:
        """Best score and flexible gain of each noise record, in units of the noise."""
        random = np.random.default_rng(self.seed)
        signals, rows = len(self.tangent.base.model.signals), self.tangent.rows_of_trials
        unit = Colour(self.colour.coefficients, 1.0)
        draws = np.stack([unit.draw(rows, signals, random) for _ in range(NULLS)], axis=1)
        draws = self.tangent.project(np.concatenate([draws, np.zeros((self.tangent.prior_rows, NULLS))]))
        moments = self.library.stacked.T @ draws if self.blocks else np.zeros((0, NULLS))
        scores = np.array([_highest(self.library.best_of_moments(m, self.further)) for m in moments.T])
        return scores, np.sum((self.flexible.T @ draws) ** 2, axis=0)

    @cached_property
    def observed(self) -> float:
        """Best score of the measurement, in units of the noise."""
        return _highest(self.library.best(self.tangent.error / self.colour.level, self.further))

    @property
    def p_value(self) -> float:
        """Chance that noise alone lets some set of candidates explain so much.

        Where no candidate could be linearised, the error counts as noise up to `NEAR_FLOOR`.
        """
        if not self.is_calibrated:
            return 1.0 if self.tangent.base.cost < NEAR_FLOOR**2 else 1.0 / (1 + NULLS)
        return self.p_of(self.observed)

    @property
    def is_calibrated(self) -> bool:
        """Whether there is a first order to run noise records through."""
        return bool(self.blocks)

    def p_of(self, reached: float) -> float:
        """Chance that noise alone reaches a score; without noise records by the number of sets tried (Bonferroni)."""
        if not self.is_calibrated:
            return float(np.exp(-max(reached, 0.0)))
        return float((1 + np.sum(self._nulls[0] >= reached)) / (1 + NULLS))

    def p_of_fit(self, misfit: float, parameters: int, effects: int) -> float:
        """Chance that noise alone lets further effects with so many parameters bring the misfit of a refit so low.

        Args:
            misfit: sum of squares that the refit leaves, in the metric.
            parameters: number of parameters of the further effects.
            effects: number of further effects.
        """
        gain = (self.tangent.base.fit.misfit - misfit) / self.colour.level**2
        return self.p_of(score(max(gain, 0.0), parameters, max(self.library.distinct, effects), effects))

    @cached_property
    def p_of_flexible(self) -> float:
        """Chance that noise alone lets a flexible force explain so much."""
        gain = float(np.sum((self.flexible.T @ self.tangent.error) ** 2)) / self.colour.level**2
        return float((1 + np.sum(self._nulls[1] >= gain)) / (1 + NULLS))

    @property
    def scatter(self) -> float:
        """By how much the mean square of a right model's error may exceed that of its noise, which is read from the
        same rows: as much as noise of this colour lets candidates and flexible forces explain, and two deviations of
        it."""
        freedom = self._saturated.shape[1]
        return (self.colour.scale * most_by_chance(freedom) - self.colour.level**2 * freedom) / self.tangent.data_rows

    @property
    def is_structured(self) -> bool:
        """Whether more is left than noise, and a share of the error worth mentioning.

        Either candidates or a flexible force explain part of it; or neither does, and what happens between samples
        explains it but cannot be so large, or it exceeds the noise of the sensors several times.
        """
        shows = min(self.p_value, self.p_of_flexible) <= SIGNIFICANT or not self.tangent.is_between_samples
        return (shows and self.structured_share > PRACTICAL) or self.colour.level > BEYOND_NOISE

    @property
    def may_matter(self) -> bool:
        """Whether what is left is a share of the noise worth mentioning, or a candidate of meaningful size explains it.

        The share counts in the metric, or in the outputs as they are, whichever is larger.
        """
        left = self.tangent.base.cost - self.colour.level**2
        if not self.is_calibrated or left > (NOTABLE * self.colour.level) ** 2:
            return True
        inside = {k for found in self.best for k in found.blocks}
        if any(block.is_meaningful(self.tangent.error) for k, block in enumerate(self.blocks) if k in inside):
            return True
        return bool(self.best) and self.is_notable(self._explained_by_best)

    def is_notable(self, change: np.ndarray) -> bool:
        """Whether a change (m,) of the error is a share of the noise of the outputs worth mentioning."""
        return self.tangent.over_noise(change) >= NOTABLE * self.colour.level

    @property
    def _explained_by_best(self) -> np.ndarray:
        """The part (m,) of the error that the best set explains to first order."""
        best = max(self.best, key=lambda found: found.score)
        basis = orthonormal(np.column_stack([self._bases[k] for k in best.blocks]), 1e-3)
        return np.asarray(basis @ (basis.T @ self.tangent.error))

    @property
    def structured_share(self) -> float:
        """Share of the root mean square error that candidates and flexible forces together would take away."""
        return 1.0 - min(self.colour.level / self.tangent.base.cost**0.5, 1.0)

    @cached_property
    def gains(self) -> dict[str, float]:
        """Drop of the misfit by each candidate alone, to first order."""
        found: dict[str, float] = {}
        for block, basis in zip(self.blocks, self._bases, strict=True):
            gain = float(np.sum((basis.T @ self.tangent.error) ** 2))
            found[block.candidate.label] = max(gain, found.get(block.candidate.label, 0.0))
        return found

    def nominated(self, count: int, simple: bool) -> list[str]:
        """Candidates that explain the most alone, and those of the best sets; `simple`: each effect of one parameter, too.

        Along a run that is far from the measurements slopes say little, and shapes with many parameters follow anything. An
        effect of one parameter is soon refitted; at the site where it explains the most.
        """
        singles: dict[str, float] = {}
        for block, basis in zip(self.blocks, self._bases, strict=True):
            gain = float(np.sum((basis.T @ self.tangent.error) ** 2)) / self.colour.level**2
            label, found = block.candidate.label, score(gain, basis.shape[1], self.library.distinct, 1)
            singles[label] = max(found, singles.get(label, -np.inf))
        order = sorted(singles, key=lambda label: (-singles[label], label))
        cards = {b.candidate.label: b.candidate.card for b in self.blocks if len(b.candidate.card.parameters) == 1}
        plain = {cards[label].id: label for label in reversed(order) if label in cards}
        order = [*(plain.values() if simple else ()), *order[:count]]
        inside = [self.blocks[k].candidate.label for found in self.best for k in found.blocks]
        return list(dict.fromkeys([*order, *inside]))

    @cached_property
    def _bases(self) -> list[np.ndarray]:
        edges = np.r_[0, np.cumsum(self.library.sizes)]
        return [self.library.stacked[:, a:b] for a, b in zip(edges[:-1], edges[1:], strict=True)]


def most_by_chance(freedom: int) -> float:
    """What that many orthonormal columns take of white noise of power one, and two deviations of it (chi-squared).

    >>> most_by_chance(50)
    70.0
    """
    return freedom + SCATTER * (2.0 * freedom) ** 0.5


def _autocovariance(series: np.ndarray) -> np.ndarray:
    """Sums of products of samples (n, ny) that are 0, 1, ..., `AR_ORDER` apart."""
    return np.array([np.sum(series[lag:] * series[: len(series) - lag]) for lag in range(AR_ORDER + 1)])


def _highest(found: Sequence[BestSet]) -> float:
    return max((entry.score for entry in found), default=-np.inf)

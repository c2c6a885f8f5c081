"""Intervals from the profile of the likelihood, for parameters whose curvature at the best fit misleads.

The misfit is minimised over everything else while one parameter is held; the interval ends where it has risen by
z^2 std^2 H, which for a parabola of curvature H is z standard deviations away. Standard deviations are those of the fit, so
correlated residuals widen a profile as they widen an interval from curvature.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from fmus.errors import ComponentError
from orchestrator.diagnosis.advise.thresholds import (
    CLOSE,
    FEWEST_EVALUATIONS,
    HELD,
    MISLEADING,
    MOST_PARAMETERS,
    MOST_REFITS,
)
from orchestrator.diagnosis.fit.evidence import LearningData, Refit, linearised
from orchestrator.diagnosis.linear.thresholds import BEYOND_NOISE
from orchestrator.models.estimation import Z90, Fit, Prior, affordable_evaluations, fit


@dataclass(frozen=True)
class Profiled:
    """A 90 % interval of free parameter `position` from the profile; an end that a bound cuts off is open."""

    position: int
    low: float
    high: float
    open_low: bool
    open_high: bool


def profiles(found: Refit, learning: LearningData) -> list[Profiled]:
    """Profile the effects' parameters whose interval from curvature leaves the bounds or misses a parabola's rise.

    Sets of more than six parameters are left as they are, and those that leave much more than noise: the likelihood, and so
    its profile, means something only where what is left is noise. So are those whose fits are given up before they settle.
    """
    if affordable_evaluations(found.model.compiled, found.records, found.substeps) < FEWEST_EVALUATIONS:
        return []
    if not 0 < found.size <= MOST_PARAMETERS or found.cost > BEYOND_NOISE**2:
        return []
    problem = _Problem(found, learning)
    positions = [k for k in range(found.size) if np.isfinite(found.std[k]) and found.std[k] > 0]
    return [problem.profile(k) for k in positions if problem.misleads(k)]


class _Problem:
    def __init__(self, found: Refit, learning: LearningData) -> None:
        self.found, self.learning = found, learning
        extra, variables = learning.nuisances, found.effects.variables
        self.prior = extra.prior(found.size)
        low = [-np.inf if v.minimum is None else v.minimum for v in variables]
        high = [np.inf if v.maximum is None else v.maximum for v in variables]
        self.low, self.high = np.r_[low, extra.low], np.r_[high, extra.high]
        residual, jacobian = linearised(found, learning)
        length = np.linalg.norm(jacobian, axis=0)
        scaled = jacobian / np.where(length > 0, length, 1.0)
        inverse = np.linalg.pinv(scaled.T @ scaled, hermitian=True)
        self.inverse = inverse / np.outer(np.where(length > 0, length, np.inf), np.where(length > 0, length, np.inf))
        self.best = float(residual @ residual)

    def rise_at_end(self, k: int) -> float:
        """Rise of the misfit that ends an interval."""
        return float((Z90 * self.found.std[k]) ** 2 / max(self.inverse[k, k], 1e-300))

    def misleads(self, k: int) -> bool:
        """Whether the misfit along the best straight line through parameter k is no parabola within its interval."""
        value, reach = self.found.values[k], Z90 * self.found.std[k]
        if value - reach < self.low[k] or value + reach > self.high[k]:
            return True
        wanted = self.rise_at_end(k)
        for step in (-reach, reach):
            try:
                rise = self._misfit(self._moved(k, step)) - self.best
            except ComponentError:
                return True
            if not wanted / MISLEADING < rise < wanted * MISLEADING:
                return True
        return False

    def profile(self, k: int) -> Profiled:
        """Interval of parameter k."""
        (low, open_low), (high, open_high) = self._end(k, -1.0), self._end(k, 1.0)
        return Profiled(k, low, high, open_low, open_high)

    def _end(self, k: int, side: float) -> tuple[float, bool]:
        """Where the misfit has risen enough on one side, and whether a bound comes first."""
        value, wanted = float(self.found.values[k]), self.rise_at_end(k)
        room = abs(float((self.high if side > 0 else self.low)[k]) - value)
        if room < 1e-9 * (1 + abs(value)):
            return value, True
        inside, outside = 0.0, np.inf
        distance = min(Z90 * float(self.found.std[k]), room)
        for _ in range(MOST_REFITS):
            rise = self._held(k, value + side * distance)
            if rise < wanted and distance >= room:
                return value + side * room, True
            if abs(rise / wanted - 1) < CLOSE:
                break
            inside, outside = (distance, outside) if rise < wanted else (inside, distance)
            # The root of the rise is a straight line where the misfit is a parabola.
            guess = distance * float(np.clip(np.sqrt(wanted / max(rise, 1e-3 * wanted)), 0.2, 3.0))
            middle = 0.5 * (inside + min(outside, room))
            distance = guess if inside < guess < min(outside, room) else (room if guess >= room < outside else middle)
        return value + side * distance, False

    def _held(self, k: int, value: float) -> float:
        """Rise of the misfit when parameter k is held at a value and all else is refitted."""
        mean, std = self.prior.mean.copy(), self.prior.std.copy()
        mean[k], std[k] = value, HELD * self.found.std[k]
        there = self._at(self._moved(k, value - float(self.found.values[k])))
        first = there.values.copy()
        first[k] = value
        try:
            again = fit(
                self.found.model.compiled,
                self.found.records,
                np.ones(len(self.found.model.signals)),
                np.clip(first, self.low, self.high),
                self.low,
                self.high,
                substeps=self.found.substeps,
                prior=Prior(mean, std, self.prior.shift_std),
                reduce=self.learning.metrics,
                tolerance=1e-5,
                earlier=there,
            )
        except ComponentError:
            return np.inf
        return again.misfit - self.best

    def _moved(self, k: int, step: float) -> np.ndarray:
        """All that was fitted, moved so that parameter k changes by `step` and the misfit rises least, to first order."""
        everything = np.concatenate([self.found.fit.values, *self._rest()])
        return np.asarray(everything + self.inverse[:, k] / self.inverse[k, k] * step)

    def _rest(self) -> Sequence[np.ndarray]:
        shift = [np.array([self.found.fit.shift])] if self.prior.shift_std > 0 else []
        return [*shift, *self.found.fit.starts]

    def _at(self, everything: np.ndarray) -> Fit:
        """All that was fitted, with other numbers."""
        count, shifted = len(self.found.fit.values), int(self.prior.shift_std > 0)
        values, shift = everything[:count], float(everything[count]) if shifted else 0.0
        starts = tuple(everything[count + shifted :].reshape(len(self.found.records), -1))
        return Fit(values, values, starts, 0.0, np.zeros(count, bool), self.found.fit.rows, 0.0, shift)

    def _misfit(self, everything: np.ndarray) -> float:
        residual, _ = linearised(replace(self.found, fit=self._at(everything)), self.learning)
        return float(residual @ residual)

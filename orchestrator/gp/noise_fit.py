"""Noise of data whose functions are known but for what the data themselves say: its weights alone, by marginal likelihood."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from orchestrator.gp.covariance import factor
from orchestrator.gp.noise import LearntNoise
from orchestrator.gp.triangle import inverse_from_factor, one_thread, solve_lower
from orchestrator.models.minimise import PROMISE, minimise

Array = NDArray[Any]
# Of a weight: a factor of e^8 to either side.
_WIDEST = 8.0


@dataclass(frozen=True, eq=False)
class FittedNoise:
    """Noise with the weights that make the data most probable, and -log of that probability."""

    noise: LearntNoise
    value: float


def fit_noise(
    residuals: Array, covariance: Array, noise: LearntNoise, starts: Sequence[Sequence[float]]
) -> FittedNoise:
    """Fit the weights of noise to residuals, (n, p), that have this covariance, (n, n), without it.

    Hyperparameters of the functions stay: an evaluation costs one factorisation, whatever the number of functions. `fit`
    searches both together.

    Args:
        starts: weights to begin from, each (k,).
    """
    low, high = np.full(len(noise.weights), -_WIDEST), np.full(len(noise.weights), _WIDEST)
    with one_thread():
        runs = [
            minimise(
                lambda weights: _value(weights, residuals, covariance, noise),
                np.clip(np.asarray(start, dtype=float), low, high),
                low,
                high,
                None,
                PROMISE,
            )
            for start in starts
        ]
    best = min(runs, key=lambda run: run.value)
    return FittedNoise(noise.with_weights(best.point), float(best.value))


def _value(weights: Array, residuals: Array, covariance: Array, noise: LearntNoise) -> tuple[float, Array]:
    """Negative log likelihood of the residuals and its gradient by the weights."""
    now = noise.with_weights(weights)
    lower = factor(covariance + np.diag(now.deviation**2))
    solved = solve_lower(lower, residuals)
    n, p = residuals.shape
    logarithm = p * (2.0 * np.log(np.diagonal(lower)).sum() + n * np.log(2.0 * np.pi))
    value = 0.5 * (float(np.vdot(residuals, solved)) + logarithm)
    inverse = np.diagonal(inverse_from_factor(lower.copy(order="F")))
    return value, 0.5 * (p * inverse - (solved**2).sum(axis=1)) @ now.variance_slopes

"""Which corrections to believe: those clear of the stops, settled ones, ones that are no outliers, the most informative."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from orchestrator.gp.covariance import factor
from orchestrator.study.conditioned import Conditioned
from orchestrator.study.corrections import SENSOR_N, Corrections

Array = NDArray[Any]
# A deviation that says nothing: beside it, no correction moves a prediction by more than 1e-8 of the force.
EXCLUDED_N = 1e6
SETTLED_RAD = 0.15
_FREEDOM = 3.0  # of Student's distribution
_TURNS = 30


def clear_of_stops(corrections: Corrections) -> Array:
    """Mask of corrections during which no joint touched an end: there only the hand holds the arm, (n,)."""
    return ~corrections.at_stop


def settled(corrections: Corrections) -> Array:
    """Mask of those that in addition hardly moved, (n,)."""
    return clear_of_stops(corrections) & (corrections.moved < SETTLED_RAD)


def only(deviation: Array, kept: Array) -> Array:
    """Deviations of kept corrections in the places of `kept`, (n,) mask; others are excluded."""
    whole = np.full(len(kept), EXCLUDED_N)
    whole[kept] = deviation
    return whole


def robust(given: Conditioned) -> Array:
    """Deviations of corrections whose errors have Student's distribution with 3 degrees of freedom, (n,), N.

    Expectation maximisation (Lange, Little and Taylor 1989): an error counts (3 + 2) / (3 + e^2 / s^2), where e is what the models
    leave of it and s the scale, the same for all. No stop or motion is looked at.
    """
    count = len(given.residuals)
    scale, trust = 10.0, np.ones(count)
    for _ in range(_TURNS):
        variance = scale**2 / trust + SENSOR_N**2
        lower = factor(given.covariance + np.diag(variance))
        inverse = np.linalg.inv(lower)
        solved = inverse.T @ (inverse @ given.residuals)
        # With noise N and covariance K of all: what is left of the residuals is N K^-1 r, its variance N - N K^-1 N.
        left = variance[:, None] * solved
        spread = variance - variance**2 * (inverse**2).sum(axis=0)
        squared = (left**2).sum(axis=1) + 2.0 * spread
        trust = (_FREEDOM + 2.0) / (_FREEDOM + squared / scale**2)
        scale = max(float(np.sqrt(np.mean(trust * squared) / 2.0)), SENSOR_N)
    return np.sqrt(scale**2 / trust + SENSOR_N**2)


def informative(given: Conditioned, deviation: Array, count: int) -> Array:
    """Numbers of `count` corrections, each the one that says most beyond those before it, (count,).

    A correction says log(1 + v / s^2) / 2 nats, with v the variance of its force given the ones before and s its noise. Its
    measured value does not count, so outliers are not preferred. Steps of a Cholesky factorisation with pivots.
    """
    left = np.diagonal(given.covariance).copy()
    rows = np.zeros((count, len(left)))
    chosen: list[int] = []
    for step in range(count):
        says = left / deviation**2
        says[chosen] = -1.0
        best = int(np.argmax(says))
        pivot = left[best] + deviation[best] ** 2
        rows[step] = (given.covariance[best] - rows[:step, best] @ rows[:step]) / np.sqrt(pivot)
        left = np.maximum(left - rows[step] ** 2, 0.0)
        chosen.append(best)
    return np.array(chosen)

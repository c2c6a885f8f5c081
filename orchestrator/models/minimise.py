"""The least value of a smooth function within bounds, by sequential quadratic programming with CasADi."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import casadi
import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]
Objective = Callable[[Array], tuple[float, Array]]
# A step that promises less than this is not worth an evaluation: values of hundreds have a rounding floor of 1e-10.
PROMISE = 1e-8
_LONGEST = 2.0
_SUFFICIENT = 1e-4
_MOST_ITERATIONS = 200
_MOST_CUTS = 12


@dataclass(frozen=True, eq=False)
class Found:
    """Where a search ended: the point (k,), the value there (inf if it has none anywhere), the curvature (k, k),
    evaluations."""

    point: Array
    value: float
    curvature: Array
    evaluations: int


def minimise(
    objective: Objective,
    begin: Array,
    low: Array,
    high: Array,
    curvature: Array | None = None,
    promise: float = PROMISE,
) -> Found:
    """Search from `begin` within bounds (k,); the objective gives value and gradient, NaN where it has none.

    Each step solves a quadratic program with bounds (CasADi, DAQP) whose matrix learns from the gradients (BFGS, damped
    as Powell 1978); a step that does not gain enough is cut. `curvature` is the matrix to begin with, where one is
    known. It ends where a step would gain less than `promise`.

    Args:
        objective: gives value and gradient (k,) at a point (k,).
        begin: where to begin, (k,).
        low: lower bounds, (k,).
        high: upper bounds, (k,).
        curvature: matrix (k, k) to begin with; None to learn it.
        promise: gain of a step, in the unit of the value, below which the search ends.
    """
    here = _Point(begin, *objective(begin))
    if not np.isfinite(here.value) or not np.any(high > low):
        value = here.value if np.isfinite(here.value) else np.inf
        return Found(begin, value, np.eye(len(begin)), 1)
    program = _program(len(begin))
    matrix = _first(here.slope) if curvature is None else curvature
    fresh, evaluations = curvature is None, 1
    for _ in range(_MOST_ITERATIONS):
        step = _step(program, matrix, here, low, high)
        if not -float(here.slope @ step + 0.5 * step @ matrix @ step) > promise:
            break
        there, count = _cut(objective, here, step, low, high)
        evaluations += count
        if there is None or np.array_equal(there.place, here.place):
            break
        moved, change = there.place - here.place, there.slope - here.slope
        if fresh and moved @ change > 0.0:
            matrix = np.eye(len(begin)) * (change @ change) / (moved @ change)
        fresh = False
        matrix, here = _updated(matrix, moved, change), there
    return Found(here.place, here.value, matrix, evaluations)


@dataclass(frozen=True, eq=False)
class _Point:
    place: Array
    value: float
    slope: Array


def _program(count: int) -> casadi.Function:
    options: dict[str, Any] = {"error_on_fail": False}
    return casadi.conic("step", "daqp", {"h": casadi.Sparsity.dense(count, count)}, options)


def _first(slope: Array) -> Array:
    """A curvature with which the first step is about 1 long."""
    return np.eye(len(slope)) * max(float(np.linalg.norm(slope)), 1e-3)


def _step(program: casadi.Function, matrix: Array, here: _Point, low: Array, high: Array) -> Array:
    lowest, highest = np.maximum(low - here.place, -_LONGEST), np.minimum(high - here.place, _LONGEST)
    found = np.array(program(h=matrix, g=here.slope, lbx=lowest, ubx=highest)["x"]).ravel()
    return np.clip(found, lowest, highest)


def _cut(objective: Objective, here: _Point, step: Array, low: Array, high: Array) -> tuple[_Point | None, int]:
    """The first point along the step that gains enough (Armijo), None if there is none; and evaluations."""
    share, fall = 1.0, float(here.slope @ step)
    for count in range(1, _MOST_CUTS + 1):
        place = np.clip(here.place + share * step, low, high)
        value, slope = objective(place)
        if value <= here.value + _SUFFICIENT * share * fall:
            return _Point(place, value, slope), count
        # The parabola through the value and slope here and the value there has its lowest point at:
        lowest = -0.5 * fall * share**2 / (value - here.value - fall * share)
        share = float(np.clip(lowest, 0.1 * share, 0.5 * share)) if np.isfinite(value) else 0.2 * share
    return None, _MOST_CUTS


def _updated(matrix: Array, moved: Array, change: Array) -> Array:
    """BFGS; where the change of slope shows too little curvature it is mixed with what was expected, so that the matrix
    stays positive."""
    expected = matrix @ moved
    seen, before = float(moved @ change), float(moved @ expected)
    if seen < 0.2 * before:
        share = 0.8 * before / (before - seen)
        change = share * change + (1.0 - share) * expected
    return matrix - np.outer(expected, expected) / before + np.outer(change, change) / float(moved @ change)

"""How the error of corrections grows with the force that was required: a straight line by least squares."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from orchestrator.study.corrections import Corrections
from orchestrator.study.muscles import perfect

Array = NDArray[Any]


@dataclass(frozen=True)
class Line:
    """error = intercept + slope * required, N; `r2` is the share of the error's variance that it explains."""

    n: int
    slope: float
    intercept: float
    r2: float


@dataclass(frozen=True, eq=False)
class Errors:
    """Size of the required force and of the error of each correction, (n,) N, and the line through them."""

    required: Array
    error: Array
    line: Line


def errors_at(corrections: Corrections, state: Array) -> Errors:
    """Errors against the perfect corrections at given states, (n, 4): where the arm was, or where it should be."""
    wanted = perfect(state, corrections.activation)
    required = np.linalg.norm(wanted, axis=1)
    error = np.linalg.norm(corrections.force - wanted, axis=1)
    return Errors(required, error, _line(required, error))


def _line(x: Array, y: Array) -> Line:
    slope, intercept = np.polyfit(x, y, 1)
    left = y - intercept - slope * x
    around = y - y.mean()
    r2 = 1.0 - float(left @ left) / float(around @ around) if np.any(around) else 0.0
    return Line(len(x), float(slope), float(intercept), r2)

"""Whether a posterior says the truth: what it expects of data that it has not seen, against what they are."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from orchestrator.gp.observations import Observation
from orchestrator.gp.posterior import Posterior
from orchestrator.gp.triangle import inverse_from_factor

Array = NDArray[Any]
Z90 = 1.6448536269514722


def surprises(posterior: Posterior, held_out: Observation) -> Array:
    """Distance of values that were not learned from what is expected of them, (n, p), in standard deviations with their noise.

    Of a sound model they are normal with variance 1.
    """
    expected = posterior.mean(held_out.coefficients, held_out.inputs)
    variance = posterior.variance(held_out.coefficients, held_out.inputs) + held_out.deviation**2
    return (held_out.values - expected) / np.sqrt(variance)[:, None]


def left_out(posterior: Posterior) -> Array:
    """The same of every datum that was learned, (n, p), each against what all others say of it, without conditioning again.

    With P the inverse covariance of the data and w = P r their weights it is w_i / sqrt(P_ii) (Sundararajan and Keerthi 2001).
    """
    precision = np.diagonal(inverse_from_factor(posterior.lower.copy(order="F")))
    return posterior.weights / np.sqrt(precision)[:, None]


def coverage(found: Array, deviations: float = Z90) -> float:
    """Share of surprises inside an interval of so many standard deviations to either side; of 90 % without a number."""
    return float(np.mean(np.abs(found) <= deviations))

"""Whether a posterior says the truth: what it expects of data that it has not seen, against what they are."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from orchestrator.gp.posterior import Posterior
from orchestrator.gp.triangle import inverse_from_factor

Array = NDArray[Any]
Z90 = 1.6448536269514722


def left_out(posterior: Posterior) -> Array:
    """Distance of every datum that was learned, (n, p), from what all others say of it, in standard deviations with its noise.

    Of a sound model they are normal with variance 1. Nothing is conditioned again:

    With P the inverse covariance of the data and w = P r their weights it is w_i / sqrt(P_ii) (Sundararajan and Keerthi 2001).
    """
    precision = np.diagonal(inverse_from_factor(posterior.lower.copy(order="F")))
    return posterior.weights / np.sqrt(precision)[:, None]


def coverage(found: Array, deviations: float = Z90) -> float:
    """Share of such distances inside an interval of so many standard deviations to either side; of 90 % without a number."""
    return float(np.mean(np.abs(found) <= deviations))

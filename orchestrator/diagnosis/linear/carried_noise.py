"""The metric once effects are known: noise of inputs is carried by the machine as it is, not as the model had it.

Two precise encoders see one drift of a shaft that noise of the torque causes. If one of them reads a scale too short, so
does what it reads of the drift, and the nominal metric takes the difference of both for an error.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import linalg

from orchestrator.diagnosis.fit.evidence import LearningData, Refit
from orchestrator.diagnosis.linear.noise_model import metrics_of
from orchestrator.diagnosis.linear.response import Response
from orchestrator.diagnosis.linear.thresholds import ANOTHER_METRIC
from orchestrator.diagnosis.noise.metric import Metric
from orchestrator.measurements import Noise


@dataclass(frozen=True)
class NoiseOfSignals:
    """Noise of the outputs (ny) and of the inputs (nu) of a measurement."""

    outputs: tuple[Noise, ...]
    inputs: tuple[Noise, ...]

    def carried_by(self, found: Refit, learning: LearningData) -> LearningData:
        """Trials in the metric of noise as a fitted set carries it; the same trials if that is nothing new."""
        if not any(metric.noisy_inputs for metric in learning.metrics):
            return learning
        response = Response(found, [t.smoother for t in learning.trials])
        if not response.is_formula:
            return learning
        metrics = tuple(metrics_of(response, self.outputs, self.inputs))
        return replace(learning, metrics=metrics) if differ(learning.metrics, metrics) else learning


def differ(old: Sequence[Metric], new: Sequence[Metric]) -> bool:
    """Whether metrics of the same trials weigh errors differently enough to matter.

    By the divergence of Kullback and Leibler from the noise of the new one to that of the old one, over all trials.
    """
    return sum(divergence(a.whitener, b.whitener) for a, b in zip(old, new, strict=True)) > ANOTHER_METRIC


def divergence(old: np.ndarray, new: np.ndarray) -> float:
    """Mean of log p(new)/p(old) for Gaussian noise that the lower triangular matrix `new` (m, m) makes white.

    With the squared singular values s of old new^-1 it is half the sum of s - 1 - log s. Infinite if only one is a matrix.

    >>> round(divergence(np.diag([1.0, 1.0]), np.diag([1.0, 0.5])), 4)  # (4 - 1 - log 4)/2
    0.8069
    """
    if old.ndim != new.ndim or old.shape != new.shape:
        return float("inf")
    if old.ndim == 1:
        ratio = (old / new) ** 2
        return float(0.5 * np.sum(ratio - 1 - np.log(ratio)))
    across = linalg.solve_triangular(new, old.T, lower=True, trans="T").T
    logarithms = 2 * np.sum(np.log(np.abs(np.diag(old))) - np.log(np.abs(np.diag(new))))
    return float(0.5 * (np.sum(across**2) - len(old) - logarithms))

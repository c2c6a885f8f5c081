"""How large a change of the outputs is beside the noise: as on a plot of the record, not as in the metric.

In the metric noise is white, so an effect as slow as the noise that a machine carries from its inputs spreads over all
samples as little, however large it is. Whoever looks at the record sees the ratio of both, and so does a definition of what
matters: the rms of a change over that of the noise, both beside what start values can do.
"""

import numpy as np
from scipy import linalg

from orchestrator.diagnosis.noise.metric import Metric


def over_noise(changes: np.ndarray, starts: np.ndarray, metric: Metric) -> tuple[float, int]:
    """Sum of squares of a change over the noise of each sample of a trial, and the number of samples.

    For noise L w, with white w, and an orthonormal basis Q of what start values do to the outputs, each in units of its own
    noise, start values leave (1 - Q Q') L w, whose power is the sum of squares of each row of that matrix.

    Args:
        changes: (m,) in the metric.
        starts: (m, k) what start values of the trial do, in the metric.
    """
    lower = _noise(metric.whitener, len(changes))
    own = np.linalg.norm(lower, axis=1)[:, None]
    lower = lower / own
    shapes, shown = (lower @ part for part in (starts, changes[:, None]))
    basis = linalg.orth(shapes / np.maximum(np.linalg.norm(shapes, axis=0), 1e-300)) if shapes.any() else shapes[:, :0]
    left, noise = (part - basis @ (basis.T @ part) for part in (shown, lower))
    power = np.sum(noise**2, axis=1)
    seen = power > 1e-12
    return float(np.sum(left[seen, 0] ** 2 / power[seen])), int(np.count_nonzero(seen))


def _noise(whitener: np.ndarray, count: int) -> np.ndarray:
    """The matrix (m, m) that makes the noise of the outputs of white noise."""
    if whitener.ndim == 1:
        return np.diag(np.tile(1.0 / whitener, count // len(whitener)))
    return np.asarray(linalg.lapack.dtrtri(whitener, lower=1)[0])

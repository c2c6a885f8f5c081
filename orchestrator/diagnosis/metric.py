"""The metric of a diagnosis: free-run errors, thinned and whitened by the noise that a right model would show."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import linalg

# Means over samples leave this many of a trial at most; the covariance of their noise is a full matrix.
MOST_BLOCKS = 600
# Noise of a measured input is spread over this many hat functions of time in a trial.
HATS = 200


@dataclass(frozen=True)
class Metric:
    """Linear map of one trial: means over `stride` samples, then whitened; in it the noise is white with unit variance.

    `whitener` is a lower triangular matrix over all samples and signals (sample by sample), or the scales (ny,) of
    noise that is white already.
    """

    stride: int
    whitener: np.ndarray

    def __call__(self, series: np.ndarray) -> np.ndarray:
        """Map (n, ny) or (n, ny, k) to (m,) or (m, k)."""
        thinned = thin(series, self.stride)
        if self.whitener.ndim == 1:
            scaled = thinned * self.whitener.reshape(1, -1, *[1] * (thinned.ndim - 2))
            return scaled.reshape(-1, *thinned.shape[2:])
        flat = thinned.reshape(len(self.whitener), *thinned.shape[2:])
        if flat.ndim == 1:
            return np.asarray(self.whitener @ flat)
        # Half the work of a full product; without a copy if the whitener is stored column by column.
        return np.ascontiguousarray(linalg.blas.dtrmm(1.0, self.whitener, flat, lower=1))


def thin(series: np.ndarray, stride: int) -> np.ndarray:
    """Means over `stride` samples along the first axis; a last incomplete block is dropped."""
    count = len(series) // stride
    return series[: count * stride].reshape(count, stride, *series.shape[1:]).mean(axis=1)


def stride_for(samples: int, finest: int) -> int:
    """Samples in a mean: at least `finest`, and so many that at most `MOST_BLOCKS` means are left."""
    return max(finest, -(-samples // MOST_BLOCKS))


def white_metric(std: np.ndarray, stride: int) -> Metric:
    """The metric of white noise of standard deviation `std` (ny,) in each sample."""
    return Metric(stride, np.sqrt(stride) / std)


def coloured_metric(own: Sequence[np.ndarray], stride: int, carried: np.ndarray) -> Metric:
    """The metric of each sensor's own noise and of independent contributions `carried` (n, ny, k) of unit variance.

    `own` holds, for each of the ny signals, the covariance (m, m) of the means of its noise.
    """
    thinned = thin(carried, stride)
    wide = thinned.reshape(thinned.shape[0] * thinned.shape[1], thinned.shape[2])
    covariance = wide @ wide.T
    for i, each in enumerate(own):
        covariance[i :: len(own), i :: len(own)] += each
    lower = linalg.cholesky(covariance, lower=True)
    return Metric(stride, np.asfortranarray(linalg.solve_triangular(lower, np.eye(len(lower)), lower=True)))


def hats(time: np.ndarray, count: int = HATS) -> np.ndarray:
    """Hat functions (n, k) over the samples, k <= `count`, scaled to pass white noise of unit variance on.

    Noise w of unit variance in each sample acts on a slow system as sum_j h_j v_j with independent v_j of unit variance:
    the hats add up to 1, and each stands for the mean of the samples beneath it.
    """
    knots = np.linspace(time[0], time[-1], min(count, len(time)))
    place = (time - knots[0]) / (knots[1] - knots[0])
    shape = np.clip(1 - np.abs(place[:, None] - np.arange(len(knots))[None, :]), 0, None)
    return shape / np.sqrt(shape.sum(axis=0))


def concatenate(metrics: Sequence[Metric], per_trial: Sequence[np.ndarray]) -> np.ndarray:
    """Errors of all trials in their metrics, one after the other."""
    return np.concatenate([metric(part) for metric, part in zip(metrics, per_trial, strict=True)])

"""The metric of a diagnosis: free-run errors, thinned and whitened by the noise that a right model would show."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import linalg

from orchestrator.diagnosis.noise.thresholds import MOST_BLOCKS, MOST_LIKELY, WAVES


@dataclass(frozen=True)
class NoisyInput:
    """Noise of one input: `shapes` (n, k) times independent numbers of unit variance, which show as `seen` (m, k)."""

    column: int
    shapes: np.ndarray
    seen: np.ndarray


@dataclass(frozen=True)
class Metric:
    """Linear map of one trial: means over `stride` samples, then whitened; in it the noise is white with unit variance.

    `whitener` is a lower triangular matrix over all samples and signals (sample by sample), or the scales (ny,) of
    noise that is white already. `noisy_inputs` are those of which part of the noise is carried to the outputs.
    """

    stride: int
    whitener: np.ndarray
    noisy_inputs: tuple[NoisyInput, ...] = ()

    def __call__(self, series: np.ndarray) -> np.ndarray:
        """Map (n, ny) or (n, ny, k) to (m,) or (m, k)."""
        thinned = thin(series, self.stride)
        if self.whitener.ndim == 1:
            scaled = thinned * self.whitener.reshape(1, -1, *[1] * (thinned.ndim - 2))
            return scaled.reshape(scaled.shape[0] * scaled.shape[1], *thinned.shape[2:])
        flat = thinned.reshape(len(self.whitener), *thinned.shape[2:])
        if flat.ndim == 1:
            return np.asarray(self.whitener @ flat)
        # Half the work of a full product; without a copy if the whitener is stored column by column.
        return np.ascontiguousarray(linalg.blas.dtrmm(1.0, self.whitener, flat, lower=1))

    def of_first(self, samples: int, signals: int) -> "Metric":
        """The metric of the first samples of the trial alone; it says nothing of the inputs' noise.

        A triangular whitener takes nothing from later means, so that it holds that of fewer of them.
        """
        if self.whitener.ndim == 1:
            return Metric(self.stride, self.whitener)
        rows = samples // self.stride * signals
        return Metric(self.stride, np.asfortranarray(self.whitener[:rows, :rows]))

    def input_noise(self, error: np.ndarray, inputs: int) -> np.ndarray:
        """The likeliest noise (n, inputs) of the inputs, given the errors (m,) of a run driven by what was recorded of them.

        What is left of the noise once this is taken away is independent of these errors, as for all Gaussian variables.
        Errors that are larger than noise would make them give no more noise than is likely.
        """
        if not self.noisy_inputs:
            return np.zeros((1, inputs))
        amounts = [each.seen.T @ error for each in self.noisy_inputs]
        count, power = sum(map(len, amounts)), sum(float(a @ a) for a in amounts)
        shrunk = min(1.0, np.sqrt((count + MOST_LIKELY * np.sqrt(2 * count)) / max(power, 1e-300)))
        found = np.zeros((len(self.noisy_inputs[0].shapes), inputs))
        for each, amount in zip(self.noisy_inputs, amounts, strict=True):
            found[:, each.column] += shrunk * (each.shapes @ amount)
        return found


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


def coloured_metric(
    own: Sequence[np.ndarray], stride: int, carried: np.ndarray, early: np.ndarray | None = None
) -> Metric:
    """The metric of each sensor's own noise and of independent contributions `carried` (n, ny, k) of unit variance.

    `own` holds, for each of the ny signals, the covariance (m, m) of the means of its noise. `early` (n, ny) is by how much
    the signals of each sample are off together, times an independent number of unit variance.

    Args:
        own: covariance (m, m) of the means of each signal's noise, ny of them.
        stride: samples in a mean.
        carried: independent contributions (n, ny, k) of unit variance, in the units of the outputs.
        early: joint errors (n, ny) of the signals, in their units.
    """
    thinned = thin(carried, stride)
    wide = thinned.reshape(thinned.shape[0] * thinned.shape[1], thinned.shape[2])
    covariance = wide @ wide.T
    for i, each in enumerate(own):
        covariance[i :: len(own), i :: len(own)] += each
    if early is not None and early.any():
        together = thin(early[:, :, None] * early[:, None, :], stride) / stride
        for i in range(len(own)):
            for j in range(len(own)):
                covariance[i :: len(own), j :: len(own)] += np.diag(together[:, i, j])
    lower = linalg.cholesky(covariance, lower=True)
    return Metric(stride, np.asfortranarray(linalg.lapack.dtrtri(lower, lower=1)[0]))


def waves(samples: int, count: int = WAVES) -> np.ndarray:
    """Cosines (n, k) over the samples of a record, k <= `count`, orthonormal: those of the discrete cosine transform.

    Wave k has k half periods in the record. White noise has independent amounts of unit variance of each; so, nearly, has
    coloured noise, each with the power of its spectrum there.
    """
    k = np.arange(min(count, samples))
    shape = np.cos(np.pi * (np.arange(samples)[:, None] + 0.5) * k[None, :] / samples)
    return np.asarray(shape * np.where(k == 0, 1.0, 2.0) ** 0.5 / samples**0.5)


def concatenate(metrics: Sequence[Metric], per_trial: Sequence[np.ndarray]) -> np.ndarray:
    """Errors of all trials in their metrics, one after the other."""
    return np.concatenate([metric(part) for metric, part in zip(metrics, per_trial, strict=True)])

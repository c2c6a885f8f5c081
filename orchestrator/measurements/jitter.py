"""Clocks that jitter: a sample that is taken too early or too late errs by as much as the signal moves meanwhile."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy

from orchestrator.measurements.trial import Array

# Differences of this order leave nearly nothing of a signal that is smooth from sample to sample.
ORDER = 6
BINS = 12
# A bin needs as many samples for the spread in it to be known.
FEWEST = 40
# The clock must explain as much of the misfit as one in ten thousand steady records would show, and this share of the
# noise.
SHOWN = 18.0
MATTERS = 0.2
# No clock is as bad as this, in samples; corners of a signal look like that.
MOST = 0.05
# A median's variance is 2.7 times that of the best estimate, and neighbouring differences go together.
MEDIAN_ERROR = 4.0
_MEDIAN_OF_UNIT_NORMAL = 0.6744897501960817


@dataclass(frozen=True)
class Clock:
    """A clock whose instants scatter by `jitter` samples, which adds `moved` (rms) to a signal; at rest its noise is `fast`.

    `fast` is what white noise of the same high differences has.
    """

    jitter: float
    moved: float
    fast: float


def clock_jitter(records: Sequence[Array]) -> Clock | None:
    """Estimate how far sampling instants scatter, from noise that grows with the speed of the signal.

    The spread of high differences is compared with the speed at the same place: variance = steady^2 + jitter^2 speed^2.

    Args:
        records: the same signal in several trials, or in their pieces between gaps, evenly sampled.

    Returns:
        None if the noise does not grow with speed, or not by much.
    """
    pairs = [_differences_and_speeds(r) for r in records if len(r) > ORDER + 4]
    if not pairs:
        return None
    differences, speeds = (np.concatenate(part) for part in zip(*pairs, strict=True))
    bins = np.array_split(np.argsort(speeds), min(BINS, max(len(speeds) // FEWEST, 1)))
    if len(bins) < 3:
        return None
    variance = np.array([(np.median(np.abs(differences[k])) / _MEDIAN_OF_UNIT_NORMAL) ** 2 for k in bins])
    square = np.array([np.mean(speeds[k] ** 2) for k in bins])
    if not np.all(variance > 0) or square.max() <= 0:
        return None
    weight = np.array([(len(k) / (2 * MEDIAN_ERROR)) ** 0.5 for k in bins]) / variance
    steady = float(np.sum(weight**2 * variance) / np.sum(weight**2))
    parts, left = scipy.optimize.nnls(np.column_stack([weight, weight * square]), weight * variance)
    moved = float(parts[1] * np.mean(speeds**2))
    if float(np.sum((weight * (variance - steady)) ** 2)) - left**2 < SHOWN or moved < MATTERS * parts[0]:
        return None
    return Clock(float(parts[1] ** 0.5), moved**0.5, float(parts[0] ** 0.5)) if parts[1] < MOST**2 else None


def _differences_and_speeds(record: Array) -> tuple[Array, Array]:
    """High differences, scaled to keep the variance of white noise, and the change in a sample (absolute) around each."""
    differences = np.diff(record, n=ORDER) / math.sqrt(math.comb(2 * ORDER, ORDER))
    half = ORDER // 2
    speeds = np.abs(record[half + 2 : len(record) - half + 2] - record[half - 2 : len(record) - half - 2]) / 4
    return differences, speeds

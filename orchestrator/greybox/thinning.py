"""Outputs that were filtered before they were written: neighbouring samples say the same, so that only some are used."""

import numpy as np
from scipy import signal

# By what factor the power must fall from one octave to the next, more than that of any input: a sensor's noise does not fall.
STEEP = 20.0
# Samples of a segment of the spectrum, and the least number of samples that are left of a trial.
SEGMENT, LEAST = 1024, 64


def thinned(outputs: np.ndarray, inputs: np.ndarray) -> np.ndarray:
    """Outputs (n, ny) with NaN where a sample says nothing beyond those before it; inputs are (n, nu)."""
    found = outputs.copy()
    for k, column in enumerate(outputs.T):
        skipped = np.ones(len(column), dtype=bool)
        skipped[:: stride(column, inputs)] = False
        found[skipped, k] = np.nan
    return found


def stride(column: np.ndarray, inputs: np.ndarray) -> int:
    """Every how manieth sample to use: the octaves at the end of the spectrum that hold no noise are left out.

    A signal that its input does not excite up to there is no filtered one.
    """
    count = 1
    while len(column) // (2 * count) >= LEAST:
        excited = max((fall(each, count) for each in inputs.T), default=1.0)
        if fall(column, count) < STEEP * max(excited, 1.0):
            break
        count *= 2
    return count


def fall(column: np.ndarray, count: int) -> float:
    """Power in the octave below the highest one that every `count`-th sample shows, over the power in that one; 1 if unknown."""
    if not np.isfinite(column).all() or np.ptp(column) == 0:
        return 1.0
    frequency, power = signal.welch(
        column, nperseg=min(len(column) // 2, SEGMENT), window="blackmanharris", detrend="linear"
    )
    top = 0.5 / count
    upper, lower = (power[(frequency >= a * top) & (frequency < b * top)] for a, b in ((0.5, 0.98), (0.25, 0.5)))
    return float(np.median(lower) / max(np.median(upper), 1e-300))

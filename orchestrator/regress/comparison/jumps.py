"""Where a signal jumps."""

import numpy as np

from orchestrator.regress.comparison.signal import Signal

# A step from sample to sample is a jump when it is this share of the whole range ...
RANGE_SHARE = 0.05
# ... and this many times the median step; ordinary curves, sampled well, have no such steps.
MEDIAN_STEPS = 20.0
MEDIAN_SAMPLES = 4096
# A small step is a jump, too, when it is this many times its neighbours.
STANDS_OUT = 3.0
# Share of a record's length up to which a step is short: the moment of a jump within it does not count.
SHORT_STEP = 0.01


def sampled_jumps(signal: Signal) -> np.ndarray:
    """Return the indices k where the signal jumps at an unknown moment between the samples k and k + 1.

    All changes of a "hold" signal between different stamps; of a "linear" one the steps that stand out.
    """
    steps = np.abs(np.diff(signal.values))
    apart = np.diff(signal.time) > 0
    if signal.interpolation == "hold":
        return np.flatnonzero((steps > 0) & apart)
    if not len(steps):
        return np.zeros(0, dtype=int)
    large = max(RANGE_SHARE * float(np.ptp(signal.values)), MEDIAN_STEPS * _median(steps))
    return np.flatnonzero((steps >= large) & (steps > 0) & apart)


def isolated_steps(values: np.ndarray) -> np.ndarray:
    """Return the indices k where the step from sample k to k + 1 is several times that before and that after it.

    On a curve that is sampled well neighbouring steps are alike, also around an extreme, where at most one is small.
    """
    steps = np.abs(np.diff(values))
    if len(steps) < 3:
        return np.zeros(0, dtype=int)
    around = np.maximum(steps[:-2], steps[2:])
    return np.flatnonzero(steps[1:-1] > STANDS_OUT * around) + 1


def bends(values: np.ndarray) -> np.ndarray:
    """Return what a curve may leave the straight line between two samples by, at each of them, shape (n,).

    Half the second difference: what a kink between two samples leaves the line by, and four times what a parabola does.
    """
    found = np.zeros(len(values))
    if len(values) > 2:
        found[1:-1] = np.abs(values[:-2] - 2 * values[1:-1] + values[2:]) / 2
    return found


def exact_jumps(signal: Signal) -> np.ndarray:
    """Return the indices k where the samples k and k + 1 share a stamp and differ."""
    shared = np.flatnonzero(signal.time[1:] == signal.time[:-1])
    return shared[signal.values[shared + 1] != signal.values[shared]]


def jump_times(signal: Signal, smallest: float = 0.0, direction: str = "any") -> np.ndarray:
    """Return when the signal jumps, s, rising; of a linear one the middle of the two samples around a jump.

    A "hold" signal changes at the second of the two samples. Changes up to `smallest`, in the signal's unit, do not
    count; `direction` is "any", "rising" or "falling".
    """
    k = np.sort(np.concatenate([sampled_jumps(signal), exact_jumps(signal)]))
    heights = signal.values[k + 1] - signal.values[k]
    if direction != "any":
        heights = heights if direction == "rising" else -heights
        k, heights = k[heights > 0], heights[heights > 0]
    k = k[np.abs(heights) > smallest]
    if signal.interpolation == "hold":
        return signal.time[k + 1]
    return (signal.time[k] + signal.time[k + 1]) / 2


def _median(steps: np.ndarray) -> float:
    """The median, of evenly spread samples where there are many: it is only a yardstick."""
    return float(np.median(steps[:: 1 + len(steps) // MEDIAN_SAMPLES]))

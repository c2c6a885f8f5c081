"""Mean and spread of a signal over time, whatever its steps."""

import numpy as np

from orchestrator.regress.comparison.signal import Signal


def mean_and_spread(signal: Signal) -> tuple[float, float]:
    """Return the mean over time of a signal and its standard deviation about it, both in its unit.

    The curve between samples counts, straight or held, so that the sampling does not matter: exact integrals, for a
    straight piece from a to b of (a + b) / 2 and of (a^2 + a b + b^2) / 3. Of a single moment the plain figures.

    Example:
        >>> mean_and_spread(Signal("x", [0.0, 1.0, 3.0], [0.0, 3.0, 3.0], interpolation="hold"))
        (2.0, 1.4142135623730951)
    """
    duration = signal.time[-1] - signal.time[0]
    # Numbers around their middle, so that the spread of a small range far from zero keeps its digits.
    middle = float((signal.values.min() + signal.values.max()) / 2)
    values = signal.values - middle
    if duration <= 0:
        return float(values.mean() + middle), float(values.std())
    steps = np.diff(signal.time) / duration
    left, right = values[:-1], values[:-1] if signal.interpolation == "hold" else values[1:]
    mean = float(steps @ (left + right)) / 2
    square = float(steps @ (left * left + left * right + right * right)) / 3
    return mean + middle, float(np.sqrt(max(0.0, square - mean * mean)))

"""Mean and spread of a signal over time, whatever its steps."""

import numpy as np

from orchestrator.regress.comparison.signal import Signal


def mean_and_spread(signal: Signal) -> tuple[float, float]:
    """Return the mean over time of a signal and its standard deviation about it, both in its unit.

    The curve between samples counts, straight or held, so that the sampling does not matter: exact integrals, for a
    straight piece from a to b of (a + b) / 2 and of (a^2 + a b + b^2) / 3. Of a single moment the plain figures.

    Example:
        >>> mean, spread = mean_and_spread(Signal("x", [0.0, 1.0, 3.0], [0.0, 3.0, 3.0], interpolation="hold"))
        >>> mean, round(spread**2, 9)
        (2.0, 2.0)
    """
    duration = signal.time[-1] - signal.time[0]
    low, high = float(signal.values.min()), float(signal.values.max())
    # Shares of the range around its middle keep the digits of a small range far from zero, and squares in bounds.
    middle, half = low / 2 + high / 2, (high / 2 - low / 2) or 1.0
    values = (signal.values - middle) / half
    if duration <= 0:
        return float(values.mean() * half + middle), float(values.std() * half)
    steps = np.diff(signal.time) / duration
    left, right = values[:-1], values[:-1] if signal.interpolation == "hold" else values[1:]
    mean = float(steps @ (left + right)) / 2
    square = float(steps @ (left * left + left * right + right * right)) / 3
    return mean * half + middle, float(np.sqrt(max(0.0, square - mean * mean))) * half

"""Whether a recorded input was held from sample to sample, seen from its record."""

import numpy as np

from orchestrator.measurements.trial import Array

# A held signal repeats more samples than this share, and its steps are larger than the last digit of a slow one.
REPEATS = 0.5
LAST_DIGIT = 2.5
LARGE = 0.05
# Rounding that makes a signal repeat itself lets it jump by a few digits at most; larger steps that differ are commands.
MANY_DIGITS = 20.0


def proposed_interpolation(values: Array) -> str:
    """Propose "hold" if a signal stays for several samples and then jumps, else "linear".

    A slow signal with few digits also repeats samples, but then changes by one digit at a time. Commands that are updated
    every few samples may change little each time, but by many digits, and stand still between any two changes.

    Example:
        >>> proposed_interpolation(np.repeat([0.0, 1.0, 0.3, 0.8], 10))
        'hold'
        >>> proposed_interpolation(np.repeat(np.sin(np.linspace(0, 6, 100)), 5))
        'hold'
        >>> proposed_interpolation(np.clip(np.sin(np.linspace(0, 30, 300)), -0.3, 0.3))
        'linear'
        >>> proposed_interpolation(np.round(np.sin(np.linspace(0, 3, 200)), 1))
        'linear'
    """
    known = values[~np.isnan(values)]
    if len(known) < 3 or np.ptp(known) == 0.0:
        return "linear"
    steps = np.abs(np.diff(known))
    moves = np.flatnonzero(steps > 1e-12 * np.ptp(known))
    jumps = steps[moves]
    if len(jumps) > (1.0 - REPEATS) * len(steps):
        return "linear"
    if len(jumps) > 1 and float(np.median(np.diff(moves))) <= 1.0:
        return "linear"  # it runs and rests
    digit = float(jumps.min())
    if float(np.median(jumps)) > MANY_DIGITS * digit:
        return "hold"
    jumping = float(np.median(jumps)) > LAST_DIGIT * digit or digit > 2 * LARGE * float(np.ptp(known))
    return "hold" if jumping and float(np.median(jumps)) > LARGE * float(np.ptp(known)) else "linear"

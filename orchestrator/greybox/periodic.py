"""A frequency of its own in what disturbs a balance: the strongest line above its surroundings in the spectrum of all trials."""

import numpy as np
from scipy.ndimage import median_filter
from scipy.special import gammaincc, gammainccinv

from orchestrator.greybox.fit import Fit

# A trial shows a frequency in two periods, and a period in four samples.
LEAST_PERIODS, LEAST_SAMPLES = 2.0, 4.0
# Points of the spectrum in the width of a line, and lines on either side of one that are its surroundings.
POINTS, SURROUNDINGS = 4, 12


def frequency_of_its_own(fit: Fit, state: str, by_chance: float) -> float:
    """The frequency (Hz) at which what disturbs the rate of a state is far stronger than around it; 0 if there is none.

    The filter moves the state at each sample by what has disturbed it. Phases count for nothing: powers of the trials are added,
    and twice their sum over its expectation has a chi squared distribution with two degrees of freedom for each trial.

    Args:
        by_chance: how probable so strong a line may be anywhere in a spectrum without one.
    """
    column = [v.name for v in fit.box.system.states].index(state)
    time = [trial.time for trial in fit.trials]
    longest = max(float(np.ptp(t)) for t in time)
    fastest = 1.0 / (LEAST_SAMPLES * max(float(np.median(np.diff(t))) for t in time))
    hertz = np.arange(LEAST_PERIODS / longest, fastest, 1.0 / (POINTS * longest))
    if len(hertz) < 2 * POINTS * SURROUNDINGS:
        return 0.0
    total = np.zeros(len(hertz))
    for t, run in zip(time, fit.runs, strict=True):
        even = np.linspace(t[0], t[-1], len(t))
        moved = np.interp(even, t, run.mean[:, column] - run.ahead[:, column])
        moved[: len(moved) // 20] = 0.0  # the filter finds the states
        spectrum = np.abs(np.fft.rfft((moved - moved.mean()) * np.hanning(len(moved)), 8 * len(moved))) ** 2
        own = np.interp(hertz, np.fft.rfftfreq(8 * len(moved), even[1] - even[0]), spectrum)
        total += own / np.median(own)
    trials = len(time)
    around = median_filter(total, 2 * POINTS * SURROUNDINGS + 1, mode="nearest")
    middle = gammainccinv(trials, 0.5)  # median of half a chi squared sum
    line = total / around * middle
    best = int(np.argmax(line))
    return float(hertz[best]) if gammaincc(trials, line[best]) * len(hertz) / POINTS < by_chance else 0.0

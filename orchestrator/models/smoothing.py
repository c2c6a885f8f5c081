"""Smoothed measurements: values, speeds and accelerations of sampled signals without a lag."""

from dataclasses import dataclass

import numpy as np
from scipy import signal

ORDER = 4


@dataclass(frozen=True)
class Smoother:
    """Zero-phase low pass (Butterworth, forwards and backwards) for signals sampled every `step` seconds."""

    step: float
    cutoff_hz: float

    def __call__(self, series: np.ndarray) -> np.ndarray:
        """Filter along the first axis."""
        nyquist = 0.5 / self.step
        if self.cutoff_hz >= 0.9 * nyquist or len(series) < 30:
            return series
        sections = signal.butter(ORDER, self.cutoff_hz / nyquist, output="sos")
        return signal.sosfiltfilt(sections, series, axis=0)

    def thin(self, series: np.ndarray, lowest_hz: float | None = None) -> np.ndarray:
        """Filter, drop the ends that a filter has spoiled, and keep about four samples for each cutoff period.

        Args:
            lowest_hz: corner of a filter that was applied before, if it is lower than this one's cutoff.
        """
        edge = min(int(0.5 / ((lowest_hz or self.cutoff_hz) * self.step)), len(series) // 8)
        stride = max(1, int(0.25 / (self.cutoff_hz * self.step)))
        return self(series)[edge : len(series) - edge : stride]


def second_difference(series: np.ndarray, step: float) -> np.ndarray:
    """Central second derivative along the first axis; the end values repeat their neighbours."""
    inner = (series[2:] - 2 * series[1:-1] + series[:-2]) / step**2
    return np.concatenate([inner[:1], inner, inner[-1:]])


def cutoff_frequency(series: np.ndarray, noise_std: float, step: float) -> float:
    """Highest frequency (Hz) at which a signal stands out of its white measurement noise.

    The spectrum (Welch, Hann window of 2 s) is compared with the noise's, 2 step std^2, or with the spectrum's own level
    above a quarter of the sampling rate if that is higher. The cutoff is where the signal falls below four times the
    noise for good, at least 2 Hz and at most a quarter of the sampling rate.
    """
    window = min(len(series), max(512, round(2.0 / step)))
    frequency, power = signal.welch(series, 1 / step, nperseg=window, detrend="linear")
    noise = max(2 * step * noise_std**2, float(np.median(power[frequency > 0.25 / step])))
    above = np.flatnonzero(power > 4 * noise)
    highest = frequency[above[-1]] if above.size else 0.0
    # A single line far above the rest is not signal: take the last of a run of at least two neighbours.
    runs = above[1:][np.diff(above) == 1]
    highest = frequency[runs[-1]] if runs.size else highest
    return float(np.clip(highest, 2.0, 0.25 / step))

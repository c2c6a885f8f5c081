"""Smoothed measurements: values, speeds and accelerations of sampled signals without a lag."""

from dataclasses import dataclass
from functools import cache, cached_property

import numpy as np
import scipy

from orchestrator.models.beginning import Beginning, beginning

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
        return low_pass(series, ORDER, self.cutoff_hz / nyquist)

    def thin(self, series: np.ndarray, lowest_hz: float | None = None) -> np.ndarray:
        """Filter, drop the ends that a filter has spoiled, and keep about four samples for each cutoff period.

        Args:
            lowest_hz: corner of a filter that was applied before, if it is lower than this one's cutoff.
        """
        edge = min(int(0.5 / ((lowest_hz or self.cutoff_hz) * self.step)), len(series) // 8)
        return self(series)[edge : len(series) - edge : self.stride]

    @property
    def stride(self) -> int:
        """Samples from one kept sample to the next in `thin`."""
        return max(1, int(0.25 / (self.cutoff_hz * self.step)))


@dataclass(frozen=True, eq=False)
class SmoothedTrial:
    """A trial with what its measurements show of motion: `inputs` (n, nu), `measured` (n, ny), `noise` (ny,) std.

    `input_noise` (nu,) is the standard deviation of the noise of measured inputs, None if all are exact.

    Values and speeds are smoothed, accelerations are not (they are linear in the noise and are filtered later);
    all have shape (n, ny).
    """

    time: np.ndarray
    inputs: np.ndarray
    measured: np.ndarray
    noise: np.ndarray
    input_noise: np.ndarray | None = None

    @cached_property
    def quiet_inputs(self) -> np.ndarray:
        """Inputs (n, nu) without what of their noise is faster than they are."""
        quiet = self.inputs.copy()
        for i, std in enumerate(() if self.input_noise is None else self.input_noise):
            if std > 0:
                step = self.smoother.step
                quiet[:, i] = Smoother(step, cutoff_frequency(quiet[:, i], float(std), step))(quiet[:, i])
        return quiet

    @cached_property
    def smoother(self) -> Smoother:
        """Low pass at the highest frequency at which some signal stands out of its noise."""
        step = float(np.median(np.diff(self.time)))
        columns = zip(self.measured.T, self.noise, strict=True)
        return Smoother(step, max(cutoff_frequency(column, float(std), step) for column, std in columns))

    @cached_property
    def values(self) -> np.ndarray:
        """Smoothed measurements."""
        return self.smoother(self.measured)

    @cached_property
    def speeds(self) -> np.ndarray:
        """Derivatives of the smoothed measurements."""
        return np.gradient(self.values, self.time, axis=0)

    @cached_property
    def beginnings(self) -> tuple[Beginning, ...]:
        """Value and speed of each measurement at the first sample.

        They count as no more certain than smoothed values are near the end of a record: a model that is not quite right
        follows the rest of the record best from a start that is not quite right either.
        """
        near = max(4, round(0.25 / (self.smoother.cutoff_hz * self.smoother.step)))
        distance = np.sqrt(np.mean((self.values - self.measured)[:near] ** 2, axis=0))
        columns = zip(self.measured.T, self.noise, distance, strict=True)
        return tuple(
            beginning(self.time, column, float(std)).within(
                max(float(std), float(far)), 2 * np.pi * self.smoother.cutoff_hz * max(float(std), float(far))
            )
            for column, std, far in columns
        )

    @cached_property
    def accelerations(self) -> np.ndarray:
        """Second differences of the raw measurements."""
        return second_difference(self.measured, self.time)


def low_pass(series: np.ndarray, order: int, cutoff: float) -> np.ndarray:
    """Butterworth low pass along the first axis, forwards and backwards; `cutoff` is a share of half the sampling rate.

    The same as `scipy.signal.sosfiltfilt`, with what depends on the filter alone kept from call to call, and one pass over
    samples that lie side by side for all columns.

    Args:
        series: (n, ...), equally spaced.
        order: order of the filter, which is applied twice.
        cutoff: corner, as a share of half the sampling rate.

    Raises:
        ValueError: if there are fewer samples than a filter needs to settle.
    """
    sections, settled, edge = _sections(order, cutoff)
    if len(series) <= edge:
        raise ValueError(f"{len(series)} samples are too few for a filter that takes {edge} to settle")
    rows = np.ascontiguousarray(series.reshape(len(series), -1).T)
    # Odd extension at both ends, so that the filter has settled where the record begins and ends.
    first, last = 2 * rows[:, :1] - rows[:, edge:0:-1], 2 * rows[:, -1:] - rows[:, -2 : -edge - 2 : -1]
    result = np.concatenate([first, rows, last], axis=1)
    for _ in range(2):
        state = settled[:, None, :] * result[None, :, :1]
        result = scipy.signal.sosfilt(sections, result, axis=1, zi=state)[0][:, ::-1]
    return np.ascontiguousarray(result[:, edge:-edge].T).reshape(series.shape)


@cache
def _sections(order: int, cutoff: float) -> tuple[np.ndarray, np.ndarray, int]:
    """A filter's sections, their states once settled at 1, and how many samples to extend a record by."""
    sections = scipy.signal.butter(order, cutoff, output="sos")
    taps = 2 * len(sections) + 1 - min(np.count_nonzero(sections[:, k] == 0) for k in (2, 5))
    return sections, scipy.signal.sosfilt_zi(sections), 3 * int(taps)


def second_difference(series: np.ndarray, time: np.ndarray) -> np.ndarray:
    """Second derivative of the parabola through three neighbours along the first axis, at times (n,) as even as they are.

    The end values repeat their neighbours.
    """
    slopes = np.diff(series, axis=0) / np.diff(time)[:, None]
    inner = 2 * np.diff(slopes, axis=0) / (time[2:] - time[:-2])[:, None]
    return np.concatenate([inner[:1], inner, inner[-1:]])


def cutoff_frequency(series: np.ndarray, noise_std: float, step: float) -> float:
    """Highest frequency (Hz) at which a signal stands out of its white measurement noise.

    The spectrum (Welch, Hann window of 2 s) is compared with the noise's, 2 step std^2, or with the spectrum's own level
    above a quarter of the sampling rate if that is higher. The cutoff is where the signal falls below four times the
    noise for good, at least 2 Hz (or a fiftieth of the sampling rate, for slow plants) and at most a quarter of that rate.

    Args:
        series: (n,), equally spaced.
        noise_std: standard deviation of its noise, in its unit.
        step: time between samples, in s.
    """
    window = min(len(series), max(512, round(2.0 / step)))
    frequency, power = scipy.signal.welch(series, 1 / step, nperseg=window, detrend="linear")
    noise = max(2 * step * noise_std**2, float(np.median(power[frequency > 0.25 / step])))
    above = np.flatnonzero(power > 4 * noise)
    highest = frequency[above[-1]] if above.size else 0.0
    # A single line far above the rest is not signal: take the last of a run of at least two neighbours.
    runs = above[1:][np.diff(above) == 1]
    highest = frequency[runs[-1]] if runs.size else highest
    return float(np.clip(highest, min(2.0, 0.02 / step), 0.25 / step))

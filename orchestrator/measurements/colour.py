"""Noise with a colour: what a sensor adds is white, or keeps part of itself from sample to sample, or both."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy

from orchestrator.measurements.trial import Array

# Windows of the spectrum in samples, halved until there are enough of them without a gap.
LONGEST_WINDOW, SHORTEST_WINDOW, FEWEST = 512, 64, 12
BANDS = 24
MEMORIES = np.r_[np.arange(0.1, 0.9, 0.05), np.arange(0.9, 0.985, 0.01)]
# The model of the noise holds if its misfit is below this quantile of what sampling errors, and this relative one, give.
MODEL_ERROR = 0.05
HOLDS = 0.999
# Bands left out where the motion begins; and the corner of slow noise, at least this share of the lowest frequency.
MARGIN = 2
LOWEST_CORNER = 0.5
# Relative error of the power that is stated.
STATED_ERROR = 0.2
# A slow part must improve the misfit by as much as one in ten thousand white records would show by two parameters.
SHOWN = 18.0
# Ratio of the median to the mean of an exponential distribution, which the power in a bin has.
_MEDIAN_OF_POWER = float(np.log(2.0))


@dataclass(frozen=True)
class Noise:
    """Noise of a sampled signal: standard deviations of a white part and of a slow one, in the signal's unit.

    The slow part is autoregressive of first order: each sample keeps `memory` of the one before. Of the white part, `moved`
    comes on average from sampling instants that scatter by `jitter` samples: more while the signal moves, nothing at rest.
    """

    white: float
    slow: float = 0.0
    memory: float = 0.0
    jitter: float = 0.0
    moved: float = 0.0

    @property
    def std(self) -> float:
        """Standard deviation of a sample."""
        return float(np.hypot(self.white, self.slow))

    @property
    def fast(self) -> float:
        """Standard deviation of white noise with as much power above a quarter of the sampling rate."""
        share = 2 / np.pi * np.arctan((1 - self.memory) / (1 + self.memory))  # of the slow part's power
        return float(np.hypot(self.white, self.slow * np.sqrt(2 * share)))

    @property
    def steady(self) -> "Noise":
        """The noise of the same signal at rest."""
        return Noise(float(np.sqrt(max(self.white**2 - self.moved**2, 0.0))), self.slow, self.memory)

    def with_jitter(self, jitter: float, moved: float) -> "Noise":
        """The same and what a clock adds that jitters."""
        return replace(self, white=float(np.hypot(self.white, moved)), jitter=jitter, moved=moved)

    def density(self, frequency: Array) -> Array:
        """Power at frequencies in cycles a sample, scaled so that white noise has its variance at each."""
        turn = np.cos(2 * np.pi * np.asarray(frequency))
        return np.asarray(
            self.white**2 + self.slow**2 * (1 - self.memory**2) / (1 + self.memory**2 - 2 * self.memory * turn)
        )

    def scaled(self, std: float) -> "Noise":
        """Noise of the same colour with another standard deviation."""
        factor = std / self.std if self.std > 0 else 0.0
        return replace(self.steady, white=factor * self.white, slow=factor * self.slow) if factor else Noise(std)

    def draw(self, shape: tuple[int, ...], random: np.random.Generator) -> Array:
        """Noise along the first axis, independent along the others."""
        series = self.white * random.standard_normal(shape)
        if self.slow > 0:
            drive = random.standard_normal(shape)
            drive[1:] *= np.sqrt(1 - self.memory**2)
            series = series + self.slow * scipy.signal.lfilter([1.0], [1.0, -self.memory], drive, axis=0)
        return np.asarray(series)

    def covariance(self, count: int, size: int) -> Array:
        """Covariance (count, count) of means over `size` neighbouring samples each, one after the other."""
        matrix = np.eye(count) * self.white**2 / size
        if self.slow > 0:
            keep = self.memory
            inside = (size + 2 * sum((size - k) * keep**k for k in range(1, size))) / size**2
            between = keep * ((1 - keep**size) / ((1 - keep) * size)) ** 2
            lags = np.abs(np.subtract.outer(np.arange(count), np.arange(count)))
            matrix += self.slow**2 * np.where(lags == 0, inside, between * keep ** (size * np.maximum(lags - 1, 0.0)))
        return matrix


def noise_of_records(records: Sequence[Array], stated: float | None = None, shown: float = SHOWN) -> Noise | None:
    """Estimate noise from the band of frequencies above the motion, extrapolated to the frequencies of the motion.

    The power spectrum of the records (Welch's method on second differences with Hann windows; the median over windows,
    so that impacts in some of them do not count) is fitted by white noise and autoregressive noise of first order,
    above a lowest frequency that falls from a quarter of the sampling rate until the motion shows.

    Args:
        records: the same signal in several trials, or in their pieces between gaps, evenly sampled.
        stated: what is said of the standard deviation, which counts as one more band: what does not show at high
            frequencies must then be slow.
        shown: by how much a slow part must improve the misfit to count.

    Returns:
        None if the records are too short, or no frequency is free of motion.
    """
    spectrum = _spectrum(records)
    if spectrum is None:
        return None
    frequency, power, error = spectrum
    top, lowest = int(np.searchsorted(frequency, 0.25)), -1
    for first in range(top, -1, -1):
        if _fitted(frequency[first:], power[first:], error[first:], stated, shown) is None:
            break
        lowest = first
    if lowest < 0:
        return None
    # A band that only just agrees may hold some motion already.
    lowest = min(lowest + MARGIN, top) if lowest > 0 else 0
    seen = frequency[lowest:], power[lowest:], error[lowest:]
    # A statement says how much goes on below all bands.
    return (_fitted(*seen, None, shown, LOWEST_CORNER) if stated is None else None) or _fitted(*seen, stated, shown)


def _spectrum(records: Sequence[Array]) -> tuple[Array, Array, Array] | None:
    """Frequencies (cycles a sample), power densities and relative errors in bands of equal width of logarithm."""
    series, window = [np.diff(record, n=2) for record in records], LONGEST_WINDOW
    while window >= SHORTEST_WINDOW:
        whole = [part for part in series if len(part) >= window]
        count = sum(2 * len(part) // window - 1 for part in whole)
        if count >= FEWEST:
            break
        window //= 2
    else:
        return None
    taper = scipy.signal.windows.hann(window, sym=False)
    pieces = [np.lib.stride_tricks.sliding_window_view(part, window)[:: window // 2] for part in whole]
    powers = np.abs(np.fft.rfft(np.concatenate(pieces) * taper, axis=1)) ** 2 / np.sum(taper**2)
    frequency = np.fft.rfftfreq(window)[1:]
    density = np.median(powers, axis=0)[1:] / _MEDIAN_OF_POWER / (2 * np.sin(np.pi * frequency)) ** 4
    edges = np.geomspace(4 / window, 0.49, BANDS + 1)
    rows = []
    for low, high in zip(edges[:-1], edges[1:], strict=True):
        inside = (frequency >= low) & (frequency < high)
        if inside.any():
            # A Hann window correlates neighbouring bins and overlapping windows; a median scatters more than a mean.
            effective = inside.sum() / 1.5 * len(powers) / 1.4 * _MEDIAN_OF_POWER
            rows.append((np.mean(frequency[inside]), np.mean(density[inside]), effective**-0.5))
    centre, level, error = (np.array(column) for column in zip(*rows, strict=True))
    return None if not np.all(level > 0) else (centre, level, np.hypot(error, MODEL_ERROR))


def _fitted(
    frequency: Array, power: Array, error: Array, stated: float | None, shown: float, lowest_corner: float = 0.0
) -> Noise | None:
    """Noise whose spectrum agrees with the given one, and with what is stated; None if there is none.

    Slow noise has its corner above `lowest_corner` times the lowest frequency.
    """
    # A band in which any noise has the power of all of it, whatever its colour.
    in_all = np.zeros(0) if stated is None else np.ones(1)
    power = np.r_[power, in_all * (stated or 0.0) ** 2]
    weight = 1 / (power * np.r_[error, in_all * STATED_ERROR])
    flat = np.sum(weight**2 * power) / np.sum(weight**2)
    white = float(np.sum((weight * (power - flat)) ** 2))
    best, chosen = white, Noise(float(np.sqrt(flat)))
    for memory in MEMORIES:
        if 1 - memory < lowest_corner * 2 * np.pi * frequency[0]:
            break  # what goes on below all bands is not seen
        shape = np.r_[(1 - memory**2) / (1 + memory**2 - 2 * memory * np.cos(2 * np.pi * frequency)), in_all]
        parts, left = scipy.optimize.nnls(np.column_stack([weight, weight * shape]), weight * power)
        if left**2 < best:
            best, chosen = float(left**2), Noise(float(parts[0] ** 0.5), float(parts[1] ** 0.5), float(memory))
    most = float(scipy.special.chdtri(max(len(power) - 2, 1), 1 - HOLDS))
    if white < min(most, best + shown):
        return Noise(float(np.sqrt(flat)))
    return chosen if best < most else None

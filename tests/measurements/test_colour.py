"""Noise with a colour: what is drawn, what means over samples scatter by, and what a record shows of it."""

import numpy as np
import pytest

from orchestrator.measurements.colour import Noise, noise_of_records
from orchestrator.measurements.noise import measurement_noise

COUNT, TRIALS = 2500, 4
COLOURS = [Noise(1.0), Noise(0.0, 1.0, 0.285), Noise(0.3, 1.0, 0.9), Noise(0.0, 2.0, 0.6)]


@pytest.mark.parametrize("noise", COLOURS)
def test_means_of_drawn_noise_have_the_stated_covariance(noise: Noise) -> None:
    draws = noise.draw((12, 40_000), np.random.default_rng(1))
    means = draws.reshape(3, 4, -1).mean(axis=1)

    # A covariance from 40 000 draws scatters by at most sqrt(2 / 40 000) of the variance; five of these.
    np.testing.assert_allclose(np.cov(means), noise.covariance(3, 4), atol=0.035 * noise.std**2)


@pytest.mark.parametrize("noise", COLOURS)
def test_fast_noise_is_that_above_a_quarter_of_the_sampling_rate(noise: Noise) -> None:
    """Second computation: the power of a long record there, by its periodogram; white noise has half its power there."""
    power = np.abs(np.fft.rfft(noise.draw((2**17,), np.random.default_rng(2)))) ** 2 / 2**17

    assert noise.fast == pytest.approx(np.sqrt(np.mean(power[2**15 :])), rel=0.02)


@pytest.mark.parametrize("noise", COLOURS)
@pytest.mark.parametrize("motion", [0.0, 5000.0])
def test_the_density_of_slow_noise_is_seen_beneath_a_motion(noise: Noise, motion: float) -> None:
    """What a slow system integrates is the density at low frequency, the sum of the covariance over all lags."""
    random, time = np.random.default_rng(3), np.arange(COUNT)
    records = [noise.draw((COUNT,), random) + motion * np.sin(0.03 * time + k) for k in range(TRIALS)]

    found = noise_of_records(records)

    assert found is not None
    density = [float(np.sum(each.covariance(400, 1)[200])) for each in (found, noise)]
    assert density[0] == pytest.approx(density[1], rel=0.5)
    assert found.std == pytest.approx(noise.std, rel=0.25)


def test_impacts_in_some_windows_are_hardly_noise() -> None:
    """A step of 500 fills two of eight windows of each record: their median is the two-thirds quantile of the others.

    For the powers of noise, exponentially distributed, that is ln 3 / ln 2 of the median; for its size the root, 1.26.
    """
    records = [Noise(1.0).draw((COUNT,), np.random.default_rng(k)) for k in range(TRIALS)]
    for record in records:
        record[700:] += 500.0

    found = noise_of_records(records)

    assert found is not None
    assert found.std == pytest.approx(np.sqrt(np.log(3) / np.log(2)), rel=0.1)


def test_a_short_record_has_no_spectrum() -> None:
    assert noise_of_records([np.zeros(100)]) is None


def test_scaled_noise_keeps_its_colour() -> None:
    assert Noise(3.0, 4.0, 0.5).scaled(10.0) == Noise(6.0, 8.0, 0.5)


@pytest.mark.parametrize("noise", [Noise(1.0), Noise(0.0, 1.0, 0.9)])
def test_a_stated_size_tells_how_much_goes_on_beneath_the_motion(noise: Noise) -> None:
    """Corners of plateaus hide all but the highest frequencies, where slow noise shows a fifteenth of its power."""
    random = np.random.default_rng(8)
    records = []
    for _ in range(TRIALS):
        plateaus = np.cumsum(random.normal(0, 40, COUNT) * (random.random(COUNT) < 0.02))
        smooth = np.convolve(plateaus, np.hanning(15) / np.hanning(15).sum(), "same")
        records.append(smooth + noise.draw((COUNT,), random))

    found = noise_of_records(records, stated=1.0)

    assert found is not None
    density = [float(np.sum(each.covariance(400, 1)[200])) for each in (found, noise)]
    assert density[0] == pytest.approx(density[1], rel=0.6)


def test_colour_of_noise_is_seen_though_ramps_fill_every_window_of_the_spectrum() -> None:
    """A pump that goes to another level every 60 samples, within 5: bends of the signal are not noise, and not white."""
    records = []
    for k in range(TRIALS):
        random = np.random.default_rng(k)
        levels = np.interp(np.arange(600), np.arange(0, 660, 5), np.repeat(random.uniform(30, 160, 11), 12))
        records.append(levels + 2.0 * Noise(0.0, 1.0, 0.285).draw((600,), random))

    found = measurement_noise("inflow", "m3/s", records, {"inflow_noise_std_m3_per_s": 2.0}, drives=True).noise

    # The power of autoregressive noise at rest is (1 + m) / (1 - m) of its variance.
    slow = float(found.density(np.array(0.0)))
    assert slow == pytest.approx(4.0 * 1.285 / 0.715, rel=0.25)
    assert found.std == pytest.approx(2.0)

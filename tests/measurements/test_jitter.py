"""Clocks that jitter: noise that grows with speed, and nothing else, is taken for one."""

import numpy as np
import pytest

from orchestrator.measurements.jitter import clock_jitter
from orchestrator.measurements.noise import measurement_noise

COUNT, TRIALS = 2500, 4
RANDOM = np.random.default_rng(6)


def records(jitter: float, noise: float) -> list[np.ndarray]:
    """A signal of two slow sines of size 1, at instants that scatter by `jitter` samples."""
    found = []
    for k in range(TRIALS):
        at = np.arange(COUNT) + jitter * RANDOM.standard_normal(COUNT)
        found.append(np.sin(0.05 * at + k) + 0.5 * np.sin(0.013 * at) + noise * RANDOM.standard_normal(COUNT))
    return found


@pytest.mark.parametrize("jitter", [0.003, 0.01, 0.03])
@pytest.mark.parametrize("noise", [1e-5, 1e-4])
def test_jitter_and_the_noise_at_rest_are_told_apart(jitter: float, noise: float) -> None:
    """What jitter adds is jitter times the rms of the speed: of the two sines, their amplitudes times frequencies."""
    found = clock_jitter(records(jitter, noise))

    assert found is not None
    assert found.jitter == pytest.approx(jitter, rel=0.2)
    assert found.moved == pytest.approx(jitter * np.hypot(0.05, 0.5 * 0.013) / np.sqrt(2), rel=0.25)
    # Where the signal turns, the clock still moves what it bends.
    assert found.fast < noise + 0.1 * found.moved


def test_steady_noise_and_corners_are_no_jitter() -> None:
    steady = records(0.0, 1e-4)
    corners = [
        np.interp(np.arange(COUNT), np.arange(0, COUNT + 60, 60), RANDOM.uniform(0, 1, 43)) for _ in range(TRIALS)
    ]

    assert clock_jitter(steady) is None
    assert clock_jitter([each + 1e-4 * RANDOM.standard_normal(COUNT) for each in corners]) is None


def test_a_jittering_clock_does_not_contradict_a_declared_sensor() -> None:
    found = measurement_noise("q", "rad", records(0.01, 1e-5), {"encoder_noise_std_rad": 1e-5})

    assert found.noise.steady.std == pytest.approx(1e-5)
    assert found.noise.jitter == pytest.approx(0.01, rel=0.1)
    assert "the clock of 'q' jitters by 0.0" in found.warning

"""First value and speed of a noisy signal."""

import numpy as np
import pytest

from orchestrator.models.beginning import beginning

STEP, SIZE = 0.004, 0.3
TIME = np.arange(1000) * STEP


@pytest.mark.parametrize("hertz", [0.2, 2.0, 11.0])
@pytest.mark.parametrize("noise", [1e-5, 1e-3])
def test_errors_of_the_first_value_and_speed_are_as_large_as_it_says(hertz: float, noise: float) -> None:
    """y = a sin(w t + p) begins at a sin(p) with speed a w cos(p); a hundred phases and records."""
    random, rate = np.random.default_rng(1), 2 * np.pi * hertz
    scores = []
    for _ in range(100):
        phase = random.uniform(0, 2 * np.pi)
        found = beginning(TIME, SIZE * np.sin(rate * TIME + phase) + noise * random.normal(size=TIME.size), noise)
        scores.append((found.value - SIZE * np.sin(phase)) / found.value_std)
        scores.append((found.speed - SIZE * rate * np.cos(phase)) / found.speed_std)

    # The bounds of start values lie five of these away. Errors are noise and what a polynomial misses of a sine, which
    # no window tells from noise as long as it is of its size; each would give a root mean square of up to 1.
    assert np.abs(scores).max() < 5.0
    assert 0.3 < np.sqrt(np.mean(np.square(scores))) < 1.5


def test_a_longer_quiet_beginning_tells_the_speed_better() -> None:
    random = np.random.default_rng(2)
    noise = 1e-3 * random.normal(size=TIME.size)
    slow = beginning(TIME, 0.1 * TIME + noise, 1e-3)
    fast = beginning(TIME, SIZE * np.sin(40.0 * TIME) + noise, 1e-3)

    assert slow.speed_std < 0.1 * fast.speed_std


def test_noise_that_is_understated_widens_the_standard_deviations() -> None:
    series = 0.2 * TIME + 1e-2 * np.random.default_rng(3).normal(size=TIME.size)

    assert beginning(TIME, series, 1e-6).value_std > 1e-3


@pytest.mark.parametrize("count", [2, 3, 5])
def test_records_of_a_few_samples_have_a_beginning(count: int) -> None:
    found = beginning(TIME[:count], 1.0 + 0.5 * TIME[:count], 1e-3)

    assert found.value == pytest.approx(1.0)
    assert found.speed == pytest.approx(0.5)

"""Where the spectrum of what disturbs a balance shows a frequency of its own."""

from types import SimpleNamespace
from typing import Any

import numpy as np

from orchestrator.greybox.periodic import frequency_of_its_own

BY_CHANCE = 1e-3


def _moved(random: np.random.Generator, size: float) -> Any:
    """What the filter of a fit moved its only state by: white, and a line of 3.7 Hz with a phase for each trial."""
    trials, runs = [], []
    for length in (600, 900, 750):
        time = np.arange(length) * 0.01
        line = size * np.sin(2 * np.pi * 3.7 * time + random.uniform(0, 2 * np.pi))
        trials.append(SimpleNamespace(time=time))
        mean = (line + random.normal(size=length))[:, None]
        runs.append(SimpleNamespace(mean=mean, ahead=np.zeros((length, 1))))
    system = SimpleNamespace(states=[SimpleNamespace(name="v")])
    return SimpleNamespace(trials=trials, runs=runs, box=SimpleNamespace(system=system))


def test_a_line_far_below_the_noise_is_found_whatever_its_phases() -> None:
    random = np.random.default_rng(2)
    found = [frequency_of_its_own(_moved(random, 0.35), "v", BY_CHANCE) for _ in range(20)]
    np.testing.assert_allclose(found, 3.7, atol=0.03)


def test_white_disturbances_have_no_frequency_of_their_own() -> None:
    random = np.random.default_rng(3)
    assert sum(frequency_of_its_own(_moved(random, 0.0), "v", BY_CHANCE) > 0 for _ in range(200)) <= 2

"""The noise floor's estimates: which is used, and why."""

import numpy as np
import pytest

from orchestrator.compare.estimates import estimate_floor, floor_sentence, noise_of_repeats
from orchestrator.measurements import BoundSet, BoundTrial, Noise
from orchestrator.measurements.noise import NoiseLevel

STEP, COUNT, NOISE, FORCE_NOISE = 0.01, 2000, 1e-3, 0.02
TIME = np.arange(COUNT) * STEP


def trial(seed: int, late: int = 0, rate: float = 2.0, extra: float = 0.0) -> BoundTrial:
    """A force and a motion whose clock is `late` samples late; `extra` is process noise of the motion."""
    random, time = np.random.default_rng(seed), TIME - late * STEP
    force = np.sin(rate * time) + FORCE_NOISE * random.normal(size=COUNT)
    motion = 0.3 * np.cos(rate * time) + np.hypot(NOISE, extra) * random.normal(size=COUNT)
    return BoundTrial(f"{seed}.csv", "learning", TIME, force[:, None], motion[:, None])


def bound(trials: list[BoundTrial], level: NoiseLevel) -> BoundSet:
    noise = {"f": FORCE_NOISE, "x": level.std}
    return BoundSet(tuple(trials), ("f",), ("x",), (), (), noise, (), {"x": level})


DECLARED = NoiseLevel(Noise(NOISE), "", declared=NOISE, record=0.9 * NOISE)


@pytest.mark.parametrize("late", [0, 3])
def test_repeats_differ_by_the_noise_of_both_whenever_their_clocks_began(late: int) -> None:
    trials = [trial(1), trial(2, late)]

    # A standard deviation of 2000 differences scatters by 1/sqrt(4000).
    assert noise_of_repeats(bound(trials, DECLARED), trials)["x"] == pytest.approx(NOISE, rel=4 / np.sqrt(4000))


def test_trials_with_other_inputs_are_no_repeats() -> None:
    trials = [trial(1), trial(2, rate=2.1)]

    assert noise_of_repeats(bound(trials, DECLARED), trials) == {}


def test_trials_without_moving_inputs_are_no_repeats() -> None:
    still = [BoundTrial(t.name, t.subset, t.time, 0 * t.inputs, t.outputs) for t in (trial(1), trial(2))]

    assert noise_of_repeats(bound(still, DECLARED), still) == {}


def test_the_largest_consistent_estimate_is_used() -> None:
    trials = [trial(1, extra=3 * NOISE), trial(2, extra=3 * NOISE)]

    found = estimate_floor(bound(trials, DECLARED), {"x": NOISE})["x"]

    assert found.source == "repeats"
    assert found.used == found.repeats == pytest.approx(np.sqrt(10) * NOISE, rel=0.1)
    assert "from repeats, because it is the largest (declared 0.001, record 0.0009" in floor_sentence("x", "m", found)


def test_repeats_that_differ_by_far_more_are_reported_but_not_used() -> None:
    trials = [trial(1, extra=50 * NOISE), trial(2, extra=50 * NOISE)]

    found = estimate_floor(bound(trials, DECLARED), {"x": NOISE})["x"]

    assert (found.used, found.source) == (NOISE, "declared")
    assert "something else changed between them" in found.reason


def test_a_contradicted_declaration_says_that_the_record_is_used() -> None:
    level = NoiseLevel(Noise(2 * NOISE), "", declared=NOISE, record=2 * NOISE, warning="warning: ...")

    found = estimate_floor(bound([trial(1)], level), {"x": 2.5 * NOISE})["x"]

    assert found.source == "record"
    assert found.carried == pytest.approx(1.5 * NOISE)  # 2.5^2 = 2^2 + 1.5^2

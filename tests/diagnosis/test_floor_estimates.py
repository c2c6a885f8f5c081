"""The noise floor's estimates: which is used, and why."""

from pathlib import Path

import numpy as np
import pytest

from orchestrator.compare.comparison import compare
from orchestrator.compare.estimates import estimate_floor, floor_sentence, noise_of_repeats
from orchestrator.measurements import BoundSet, BoundTrial, Noise, load_measurements
from orchestrator.measurements.noise import NoiseLevel
from orchestrator.model_argument import load_model
from tests.shaft import SHAFT

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


def test_fast_commands_that_all_act_are_no_noise_of_the_input(tmp_path: Path) -> None:
    """Taken for noise they would move a shaft by hundreds of times what its sensor errs by, and hide as much."""
    (tmp_path / "shaft.mo").write_text(SHAFT)
    random, step = np.random.default_rng(4), 0.002
    for name in ("a", "b", "c"):
        torque = 0.05 * random.standard_normal(2000)
        speed = np.concatenate([[0.0], np.cumsum(torque[:-1] * step / 0.02)])
        angle = np.concatenate([[0.0], np.cumsum(speed[:-1] * step + torque[:-1] * step**2 / 0.04)])
        rows = np.column_stack([step * np.arange(2000), torque, angle + 1e-4 * random.standard_normal(2000)])
        np.savetxt(tmp_path / f"{name}.csv", rows, delimiter=",", header="time,torque,phi", comments="", fmt="%.9g")
    case = """files = ["a.csv", "b.csv", "c.csv"]
[columns]
time = "s"
torque = "N.m"
phi = "rad"
[interpolation]
torque = "hold"
"""
    (tmp_path / "case.toml").write_text(case)
    measurements = load_measurements(str(tmp_path))

    found = compare(load_model(f"{tmp_path / 'shaft.mo'}:Shaft"), measurements)

    assert 1e-4 < found.noise_floor["phi"] < 1.5e-4
    assert found.noise_estimates["phi"].carried > 1e-3
    assert "from free runs, because free runs leave far less" in found.noise_sentences[0]

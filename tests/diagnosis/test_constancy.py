"""A law of the machine has the same parameters in every trial; one that imitates another law follows each trial with others.

Straight lines through the origin stand for the effects: y = a x along trials of different x, with noise of variance one.
"""

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from orchestrator.diagnosis.decide.constancy import Change, beyond_noise, changes
from orchestrator.diagnosis.fit.evidence import Refit
from orchestrator.diagnosis.linear.tangent import Tangent, orthonormal

TRIALS, ROWS, SCALE = 4, 1000, 1.0
SLOPE = 0.3


def fitted(slopes: np.ndarray, random: np.random.Generator) -> tuple[Tangent, Refit]:
    """Trials of these slopes (4,) with a fit of one slope for all of them, and a fit of none."""
    x = random.normal(size=TRIALS * ROWS)
    y = np.repeat(slopes, ROWS) * x + random.normal(size=len(x))
    basis = orthonormal(x[:, None])

    def project(columns: np.ndarray) -> np.ndarray:
        return columns - basis @ (basis.T @ columns)

    effect = SimpleNamespace(card=SimpleNamespace(id="passive_stiffness"))
    error = project(y)
    base = SimpleNamespace(
        effects=SimpleNamespace(candidates=(effect,), owners=lambda: (0,)), fit=SimpleNamespace(misfit=error @ error)
    )
    tangent = SimpleNamespace(
        base=base, slopes=x[:, None], rows_of_trials=[ROWS] * TRIALS, project=project, error=error
    )
    return cast(Any, tangent), cast(Any, SimpleNamespace(fit=SimpleNamespace(misfit=y @ y)))


def changing(slopes: np.ndarray, seed: int = 0, most: float = 0.04) -> tuple[Change, ...]:
    tangent, without = fitted(slopes, np.random.default_rng(seed))
    return changes(tangent, SCALE, lambda effect: without, 0.005, most)


def test_effect_of_one_size_changes_in_no_more_trials_than_by_chance() -> None:
    found = [changing(np.full(TRIALS, SLOPE), seed, most=0.0) for seed in range(200)]

    assert sum(map(bool, found)) <= 5, "200 times a chance of 0.005: more than five once in 1700"


def test_effect_of_another_size_in_each_trial_imitates_another_law() -> None:
    """Slopes of 0.3 that are off by 0.15 (rms): a share of a half of what the effect does."""
    (found,) = changing(SLOPE + 0.15 * np.array([1.0, -1.0, 1.0, -1.0]))

    assert found.share == pytest.approx(0.5, abs=0.2)
    assert "passive_stiffness follows each trial with other values" in str(found)


def test_changes_that_a_right_law_may_show_do_not_count() -> None:
    slopes = 100 * SLOPE + 0.3 * np.array([1.0, -1.0, 1.0, -1.0])

    assert not changing(slopes), "clear beside noise, and 1 % of what the effect does"
    assert changing(slopes, most=0.0)


def test_effect_without_which_nothing_can_be_fitted_is_left_alone() -> None:
    tangent, _ = fitted(SLOPE + 0.15 * np.array([1.0, -1.0, 1.0, -1.0]), np.random.default_rng(0))

    assert not changes(tangent, SCALE, lambda effect: None, 0.005, 0.04)


def test_noise_of_more_power_explains_more() -> None:
    basis, error = np.eye(6)[:, :3], np.array([4.0, 4.0, 4.0, 1.0, 1.0, 1.0])

    (gain, p), (less, greater_p) = beyond_noise(basis, error, 1.0), beyond_noise(basis, error, 4.0)

    assert gain == pytest.approx(48.0 - 3.0 - 2.0 * 6.0**0.5)
    assert less < gain
    assert p < greater_p
    assert beyond_noise(basis[:, :0], error, 1.0) == (0.0, 1.0)

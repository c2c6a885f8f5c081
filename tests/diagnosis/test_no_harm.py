"""Nothing is named that makes held-out trials worse."""

import sys
from dataclasses import replace
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "report"))
from builders import COULOMB, PAYLOAD, diagnosis

from orchestrator.verdicts.gate import without_harm
from orchestrator.verdicts.result import Diagnosis


def _with_held_out(after: float) -> Diagnosis:
    found = diagnosis("named")
    held_out = replace(found.held_out, rmse_before={"q1": 0.01, "q2": 0.01}, rmse_after={"q1": after, "q2": after})
    return replace(found, held_out=held_out)


@pytest.mark.parametrize("after", [0.011, 0.5])
def test_a_set_that_makes_held_out_trials_worse_is_the_best_one_and_not_named(after: float) -> None:
    found = without_harm(_with_held_out(after))
    assert found.verdict == "unknown" and not found.effects and found.best == (COULOMB, PAYLOAD)
    assert len(found.steps) == 1 and found.held_out.rmse_after == found.held_out.rmse_before
    assert "held-out trials become" in found.warnings[0]


@pytest.mark.parametrize("after", [0.001, 0.0101])
def test_a_set_that_makes_them_no_worse_stays_named(after: float) -> None:
    assert without_harm(_with_held_out(after)).verdict == "named"


def _given(learning: float, held_out: float, after: float) -> Diagnosis:
    """A diagnosis whose model as given leaves these errors, in noise floors, and the named one `after` along held-out trials."""
    found = diagnosis("named")
    first, floor = found.steps[0], found.noise_floor
    sides = {
        name: {s: times * floor[s] for s in floor} for name, times in (("learning", learning), ("held_out", held_out))
    }
    errors = {name: replace(getattr(first.comparison, name), rmse=rmse) for name, rmse in sides.items()}
    held = replace(found.held_out, rmse_before=sides["held_out"], rmse_after={s: after * floor[s] for s in floor})
    steps = (replace(first, comparison=replace(first.comparison, **errors)), *found.steps[1:])
    return replace(found, steps=steps, held_out=held)


@pytest.mark.parametrize(
    ("learning", "held_out", "after", "verdict"),
    [
        (0.8, 0.8, 0.8, "adequate"),
        (0.8, 0.8, 0.7, "named"),  # held-out trials become better
        (0.8, 0.8, 0.9, "unknown"),  # or worse
        (8.0, 0.8, 0.8, "named"),  # learning trials show what held-out ones do not reach, such as a stop
    ],
)
def test_nothing_is_named_beside_a_model_within_the_noise_that_held_out_trials_do_not_bear_out(
    learning: float, held_out: float, after: float, verdict: str
) -> None:
    found = without_harm(_given(learning, held_out, after))
    assert (found.verdict, bool(found.effects)) == (verdict, verdict == "named")

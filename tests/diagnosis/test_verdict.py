"""The verdict's figures."""

import math
from dataclasses import replace

import numpy as np
import pytest

from orchestrator.diagnosis.referee import confirmed
from orchestrator.diagnosis.verdict import Left, decide, reducible_removed
from orchestrator.models.estimation import Fit


def left(
    before: float, after: float, held_out: float | None = None, *, structured: bool, declared: bool = True
) -> Left:
    """Mean squares of learning trials before and after, of held-out trials after (as in learning if left out)."""
    return Left(
        (before, after, 2000), (before, after if held_out is None else held_out, 1000), 1.0, structured, declared
    )


@pytest.mark.parametrize(
    ("named", "what_is_left", "verdict"),
    [
        (0, left(1.0, 1.0, structured=False), "adequate"),
        (0, left(1.4, 1.4, structured=True), "unknown"),  # little, but not noise, and nothing in the library helps
        (0, left(1.0, 1.0, 3.0, structured=False), "cannot_tell"),  # learning trials lack what held-out trials show
        (1, left(100.0, 1.02, structured=False), "named"),
        (1, left(1000.0, 1.2, structured=True), "named"),  # 1.4 % of the error may be the integration
        (1, left(200.0, 7.7, structured=True), "unknown"),  # a neighbour of the effect explains most of it
        (1, left(30.0, 1.05, 4.0, structured=False), "unknown"),  # held-out trials betray what learning trials hide
        (1, left(200.0, 7.7, structured=True, declared=False), "named"),  # noise nobody declared may be slow
        (1, left(200.0, 30.0, structured=True, declared=False), "unknown"),
    ],
)
def test_verdict_follows_from_what_is_left_of_learning_and_held_out_errors(
    named: int, what_is_left: Left, verdict: str
) -> None:
    assert decide(named, what_is_left) == verdict


def test_rivals_make_a_named_effect_ambiguous_and_blind_sites_withhold_adequate() -> None:
    noise = left(1.0, 1.0, structured=False)
    assert decide(1, noise, ambiguous=True) == "ambiguous"
    assert decide(1, noise, ambiguous=True, missing=["reversals"]) == "cannot_tell"
    assert decide(0, noise, blind=["muscle4"]) == "cannot_tell"
    assert decide(1, noise, blind=["muscle4"]) == "named"


def test_removing_everything_above_the_floor_counts_as_one() -> None:
    assert reducible_removed(16.0, 1.0) == pytest.approx(1.0)
    assert reducible_removed(16.0, 16.0) == 0.0
    assert reducible_removed(0.9, 0.1) == 0.0, "nothing was above the floor"


def fit(cost: float, rows: int) -> Fit:
    return Fit(np.zeros(0), np.zeros(0), (), cost, np.zeros(0, bool), rows)


def test_held_out_trials_confirm_an_effect_by_odds_of_twenty() -> None:
    """Twice the logarithm of 20 is 5.99: in 1000 rows a fall of the mean square by 0.006 confirms, by 0.005 does not."""
    learned, found = fit(2.0, 2000), fit(1.0, 2000)

    assert confirmed(learned, found, fit(1.006, 1000), fit(1.0, 1000), 1.0)
    assert not confirmed(fit(1.01, 2000), fit(1.0, 2000), fit(1.005, 1000), fit(1.0, 1000), 1.0)
    assert not confirmed(learned, found, fit(1.0, 1000), fit(1.5, 1000), 1.0)


def test_held_out_trials_that_do_not_show_an_effect_leave_it_to_the_learning_trials() -> None:
    """A force limit that only the learning trials reach takes 1 off their mean square and nothing off the others'."""
    assert confirmed(fit(2.0, 2000), fit(1.0, 2000), fit(1.0, 1000), fit(1.0, 1000), 1.0)
    assert not confirmed(fit(2.0, 2000), fit(1.0, 2000), fit(1.0, 1000), fit(1.2, 1000), 1.0)


@pytest.mark.parametrize(("mean_square", "left"), [(1.04, False), (1.5, True)])
def test_only_what_the_scatter_of_noise_does_not_explain_is_left(mean_square: float, left: bool) -> None:
    rows = 4000  # mean squares of so many noise rows scatter by 0.022
    after = Left((10.0, mean_square, rows), (10.0, 1.0, rows), noise=1.0, structured=True)

    assert (after.share > 0) == left
    assert decide(1, after) == ("unknown" if left else "named")


def test_scatter_that_noise_and_error_share_hides_nothing_structured() -> None:
    """Of 4000 rows, 100 columns explain 100 +- 14 times the noise of one: an excess of 140, or 0.035, is none by chance, though
    two mean squares of other rows may differ by that."""
    cubic = Left((1.4, 1.035, 4000), (1.4, 1.0, 2000), 1.0, structured=True, within=2 * 200**0.5 / 4000)

    assert decide(1, cubic) == "unknown"
    assert decide(1, replace(cubic, within=math.inf)) == "named"
    assert decide(1, replace(cubic, structured=False)) == "named"

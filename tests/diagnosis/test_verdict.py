"""The verdict's figures."""

import math
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from fmus.errors import MisfitError
from orchestrator.diagnosis.decide.verdict import Left, decide
from orchestrator.diagnosis.referee.conclude import _left
from orchestrator.diagnosis.referee.referee import confirmed
from orchestrator.library.cards import SHIPPED, effect_library, read_card
from orchestrator.models.estimation import Fit
from orchestrator.verdicts.result import reducible_removed


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


def test_learning_trials_that_show_what_a_set_leaves_allow_it_less_than_held_out_trials_alone() -> None:
    """Friction that grows with another joint's speed was named viscous friction, which leaves 2.8 % (encoders of 1e-5 rad)."""
    coupled = Left((3282.0, 3.68, 4000), (6392.0, 6.27, 2000), 1.09, structured=True)

    assert coupled.share == pytest.approx(0.028, abs=0.001)
    assert decide(1, coupled) == "unknown"
    assert decide(1, replace(coupled, structured=False)) == "named"
    assert decide(1, replace(coupled, declared=False)) == "named"


def test_elastic_tendons_may_leave_what_their_card_lacks_of_the_law() -> None:
    tendons = Left((8717.0, 14.59, 4000), (10837.0, 20.47, 2000), 1.5, structured=True, imperfect=0.06)

    assert tendons.share == pytest.approx(0.04, abs=0.001)
    assert decide(1, tendons) == "named"
    assert decide(1, replace(tendons, imperfect=0.0)) == "unknown"
    assert {card.id: card.imperfect for card in effect_library() if card.imperfect} == {"series_elasticity": 0.06}


def test_what_is_left_is_judged_by_the_cards_of_the_set_that_leaves_it() -> None:
    fit, effects = SimpleNamespace(rows=4000), SimpleNamespace(imperfect=0.06)
    given, tendons = (
        SimpleNamespace(cost=cost, fit=fit, ids=("series_elasticity",), effects=effects) for cost in (8717.0, 14.59)
    )
    noise = {"colour": SimpleNamespace(level=2.0), "scatter": 0.1, "is_structured": True}
    first, stage = (
        cast(Any, SimpleNamespace(tangent=SimpleNamespace(base=base), p_value=0.005, p_of_flexible=0.005, **noise))
        for base in (given, tendons)
    )

    found = _left(first, stage, cast(Any, SimpleNamespace(rows=2000, held_out=(10837.0, 20.47))), declared=True)

    assert found == Left((8717.0, 14.59, 4000), (10837.0, 20.47, 2000), 1.5, True, True, 0.1, 0.06)


def test_a_card_is_imperfect_by_a_share(tmp_path: Path) -> None:
    text = (SHIPPED / "series_elasticity.toml").read_text()
    (tmp_path / "card.toml").write_text(text.replace("imperfect = 0.06", "imperfect = 6"))

    with pytest.raises(MisfitError, match="'imperfect' = 6, expected a share, from 0 to less than 1"):
        read_card(tmp_path / "card.toml")


def test_scatter_that_noise_and_error_share_hides_nothing_structured() -> None:
    """Of 4000 rows, 100 columns explain 100 +- 14 times the noise of one: an excess of 140, or 0.035, is none by chance, though
    two mean squares of other rows may differ by that."""
    cubic = Left((1.4, 1.035, 4000), (1.4, 1.0, 2000), 1.0, structured=True, within=2 * 200**0.5 / 4000)

    assert decide(1, cubic) == "unknown"
    assert decide(1, replace(cubic, within=math.inf)) == "named"
    assert decide(1, replace(cubic, structured=False)) == "named"

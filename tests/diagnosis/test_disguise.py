"""Sets beside the best one: another law in disguise, and those that may be rivals in another metric.

A cubic spring is followed by cogging of the fewest waves that it has, and less well by other effects of the library.
"""

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from fmus.catalogue import find_modelica_model
from orchestrator.diagnosis.decide.confusion import disguise, near_in_either, reach
from orchestrator.diagnosis.decide.thresholds import HOPELESS, MOST_RIVALS
from orchestrator.diagnosis.fit.candidates import EffectSet
from orchestrator.diagnosis.fit.evidence import Refit
from orchestrator.diagnosis.fit.extensible import find_candidates
from orchestrator.diagnosis.search.search import Searcher
from orchestrator.library.cards import effect_library
from orchestrator.models.estimation import Fit

ROWS = 1000
BASE = find_modelica_model("drive")


def fitted(names: tuple[str, ...], misfit: float, at_limit: str = "") -> Refit:
    """Effects of a drive whose values, all one, the data pin; one of their parameters at its upper bound."""
    cards = [card for card in effect_library() if card.id in names]
    effects = EffectSet(BASE, find_candidates(BASE, BASE.compile(), cards)[0], ("phi",))
    _, high = effects.bounds()
    pressed = np.array([v.name.endswith(f".{at_limit}") for v in effects.variables])
    values = np.where(pressed, high, 1.0)
    k = len(values)
    fit = Fit(values, 0.01 * values, (), misfit / ROWS, pressed, ROWS, correlation=np.eye(k))
    return Refit(effects, cast(Any, None), (), fit, 1)


BEST = fitted(("passive_stiffness",), ROWS)
# By how much the misfit must be lower for odds of 1000; cogging has one parameter more.
DECISIVE = 2 * np.log(HOPELESS) + np.log(ROWS)


@pytest.mark.parametrize(
    ("names", "at_limit", "lower", "is_one"),
    [
        (("cogging",), "periods", DECISIVE + 1, True),
        (("cogging",), "periods", DECISIVE - 1, False),
        (("cogging",), "", DECISIVE + 1, False),  # not at a limit: a rival, or a better set
        (("cogging", "sensor_lag"), "periods", 10 * DECISIVE, False),  # it has more effects
    ],
)
def test_another_law_is_one_that_is_decisively_likelier_at_the_limit_of_an_effect(
    names: tuple[str, ...], at_limit: str, lower: float, is_one: bool
) -> None:
    other = fitted(names, ROWS - lower, at_limit)

    assert disguise(BEST, [BEST, other], 1.0, 20) is (other if is_one else None)


@pytest.mark.parametrize(("share", "is_near"), [(0.98, True), (1.02, False)])
def test_a_set_as_far_behind_as_another_metric_moves_the_best_one_may_be_its_rival(share: float, is_near: bool) -> None:
    """Noise that is not carried yet counts for an effect that imitates it: a true offset was behind a stiffness by that."""
    moved = 0.4 * ROWS
    same = fitted(("passive_stiffness",), ROWS - moved)
    behind = share * (moved + 2 * reach(BEST, 1.0))
    # A lag has one parameter less.
    other = fitted(("sensor_lag",), ROWS + behind + np.log(ROWS))

    assert near_in_either(BEST, same, [BEST, other], 1.0, 20) == ([1] if is_near else [])
    assert len(near_in_either(BEST, same, [BEST, *9 * [other]], 1.0, 20)) == (MOST_RIVALS if is_near else 0)


IN_DISGUISE = fitted(("cogging", "sensor_lag"), 1.1 * ROWS, "periods")
PLAINER = fitted(("saturation", "sensor_lag"), 1.4 * ROWS)
WHOLE = fitted(("cogging", "saturation", "sensor_lag"), ROWS)


@pytest.fixture
def search(monkeypatch: pytest.MonkeyPatch) -> Searcher:
    """A search in which nothing speaks against a set but that it is another law in disguise."""
    made = Searcher(BASE, cast(Any, None), (), (), cast(Any, None), 1, print)
    monkeypatch.setattr(made.trace, "p_value", lambda found: 0.0)
    monkeypatch.setattr(made.trace, "objection", lambda found: "in disguise" if found.pressed() else "")
    return made


def test_set_that_is_a_disguise_without_what_it_does_not_need_is_passed_over(
    search: Searcher, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(search, "simplified", lambda found, noise: IN_DISGUISE if found is WHOLE else found)
    stage = cast(Any, SimpleNamespace(colour=SimpleNamespace(level=1.0)))

    assert search._best([WHOLE, PLAINER], fitted(("tremor",), 3 * ROWS), stage) is PLAINER
    assert any(known is IN_DISGUISE for known in search.trace.refitted)


def test_no_step_of_a_path_is_a_law_in_disguise(search: Searcher) -> None:
    search.trace.refitted += [IN_DISGUISE, PLAINER, fitted(("sensor_lag",), 2 * ROWS)]

    assert [entry.refit.ids for entry in search._nested(WHOLE)] == [("sensor_lag",), PLAINER.ids, WHOLE.ids]

"""A cubic spring is followed by cogging of the fewest waves that it has, and less well by other effects of the library."""

from typing import Any, cast

import numpy as np
import pytest

from fmus.catalogue import find_modelica_model
from orchestrator.diagnosis.candidates import EffectSet, find_candidates
from orchestrator.diagnosis.cards import effect_library
from orchestrator.diagnosis.confusion import HOPELESS, disguise
from orchestrator.diagnosis.evidence import Refit
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

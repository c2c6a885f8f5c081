"""Which set a search goes on from where its first path has ended far from noise."""

from dataclasses import replace

import numpy as np
import pytest

from orchestrator.diagnosis.fit.candidates import EffectSet
from orchestrator.diagnosis.fit.evidence import Refit
from orchestrator.diagnosis.search.other_paths import leaves_another, other_path
from tests.diagnosis.test_disguise import BASE, ROWS, fitted

SPRING, LAGGED = fitted(("passive_stiffness",), 60 * ROWS), fitted(("passive_stiffness", "sensor_lag"), 40 * ROWS)
SLOW, FAST = fitted(("sensor_lag",), 50 * ROWS), fitted(("sensor_lag", "viscous_friction"), 45 * ROWS)
DISGUISED = fitted(("cogging", "sensor_lag"), 30 * ROWS, "periods")


@pytest.mark.parametrize(
    ("tried", "tested", "wanted", "in_disguise"),
    [
        ([SPRING, SLOW, FAST], [LAGGED, SPRING], FAST, ""),  # the likeliest that was not extended
        ([SPRING, SLOW], [LAGGED, SPRING, SLOW], None, ""),
        ([SPRING, SLOW, DISGUISED], [LAGGED, SPRING], DISGUISED, "cogging"),
        ([SPRING, FAST, DISGUISED], [LAGGED, SPRING, SLOW], FAST, ""),  # what is beside cogging was extended
    ],
)
def test_search_goes_on_beside_a_law_in_disguise_or_from_the_likeliest_set_it_has_not_extended(
    tried: list[Refit], tested: list[Refit], wanted: Refit | None, in_disguise: str
) -> None:
    found = other_path(LAGGED, [LAGGED, *tried], {r.labels for r in tested}, 1.0, 20)

    if wanted is None:
        assert found is None
        return
    assert found is not None and found.refit is wanted
    assert (found.in_disguise.card.id if found.in_disguise else "") == in_disguise


def test_law_in_disguise_that_explains_less_than_the_last_set_says_nothing() -> None:
    poor = fitted(("cogging", "sensor_lag"), 41 * ROWS, "periods")

    assert other_path(LAGGED, [LAGGED, poor], {LAGGED.labels}, 1.0, 20) is None
    assert poor.half_bic == pytest.approx(0.5 * (41 * ROWS + 4 * np.log(ROWS)))


@pytest.mark.parametrize(
    ("first", "last", "is_so"),
    [
        (9000.0, 4.0, False),  # less than 2 % of the rms
        (9000.0, 6.0, True),
        (9000.0, 1.2, False),  # noise
        (5.0, 1.3, True),
    ],
)
def test_other_paths_are_followed_where_what_is_left_is_neither_noise_nor_an_imperfection(
    first: float, last: float, is_so: bool
) -> None:
    """A right set may leave 2 % of the rms above the noise (docs/decisions/010-what-is-left-decides.md)."""
    given, found = (fitted(("passive_stiffness",), cost * ROWS) for cost in (first, last))

    assert leaves_another(given, found, 1.0) is is_so
    assert not leaves_another(given, found, 2.0 * last)


def test_no_other_path_is_followed_where_no_more_is_left_than_a_card_admits() -> None:
    """Elastic tendons left 15 of 8700."""
    given, found = (fitted(("passive_stiffness",), cost * ROWS) for cost in (8700.0, 15.0))
    assert leaves_another(given, found, 1.0)

    (own,) = found.effects.candidates
    soft = replace(own, card=replace(own.card, imperfect=0.06))
    admitted = replace(found, effects=EffectSet(BASE, [soft], ("phi",)))

    assert not leaves_another(given, admitted, 1.0)


def test_largest_set_that_leaves_more_than_noise_has_grown_along_a_wrong_path() -> None:
    given, whole = fitted(("passive_stiffness",), 1e4 * ROWS), ("cogging", "saturation", "sensor_lag")

    assert leaves_another(given, fitted(whole, 1.5 * ROWS), 1.0)
    assert not leaves_another(given, fitted(whole, 1.2 * ROWS), 1.0)
    assert not leaves_another(given, fitted(whole[1:], 1.5 * ROWS), 1.0)

"""Stribeck friction holds Coulomb friction: when the data rule out its rest, and what it costs where they do not."""

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from fmus.catalogue import find_modelica_model
from orchestrator.diagnosis.decide.confusion import least_odds, rivals
from orchestrator.diagnosis.decide.nested import at_least, holds, rest_share, starts, unpinned, with_simpler
from orchestrator.diagnosis.fit.candidates import EffectSet
from orchestrator.diagnosis.fit.evidence import Refit
from orchestrator.diagnosis.fit.extensible import find_candidates
from orchestrator.diagnosis.referee.ranking import rank
from orchestrator.diagnosis.search.trace import Trace
from orchestrator.library.cards import effect_library
from orchestrator.models.estimation import Fit

CARDS = {(card.id, card.variant): card for card in effect_library()}
COULOMB, STRIBECK = CARDS["coulomb_friction", ""], CARDS["stribeck_friction", ""]
ROWS = 1000


def fitted(effect: str, values: list[float], std: list[float], misfit: float = ROWS) -> Refit:
    base = find_modelica_model("drive")
    candidates = find_candidates(base, base.compile(), [CARDS[effect, ""]])[0]
    effects = EffectSet(base, candidates, ("phi",))
    k = len(values)
    fit = Fit(np.array(values), np.array(std), (), misfit / ROWS, np.zeros(k, bool), ROWS, correlation=np.eye(k))
    return Refit(effects, cast(Any, None), (), fit, 1)


def test_laws_that_hold_another_one_are_found_by_their_parameters() -> None:
    found = {
        (larger.id, smaller.id) for larger in CARDS.values() for smaller in CARDS.values() if holds(larger, smaller)
    }

    # A spring about some angle is a steady torque where it has no stiffness.
    assert found == {("stribeck_friction", "coulomb_friction"), ("passive_stiffness", "constant_force")}


@pytest.mark.parametrize(
    ("extra", "std", "share"),
    [(0.0, 0.01, 0.5 * 1.6449 * 0.01), (0.25, 0.001, 0.5 * (0.25 + 1.6449e-3)), (-0.001, np.inf, np.inf)],
)
def test_the_rest_is_as_large_as_its_interval_reaches_against_the_friction(
    extra: float, std: float, share: float
) -> None:
    found = fitted("stribeck_friction", [2.0, extra, 0.2], [0.01, std, 0.1])

    assert rest_share(found, found.effects.candidates[0], COULOMB) == pytest.approx(share)


def test_stiffness_has_no_share_of_a_torque() -> None:
    found = fitted("passive_stiffness", [0.5, 1.0], [0.1, 0.1])

    assert np.isnan(rest_share(found, found.effects.candidates[0], CARDS["constant_force", "joint"]))


def test_parameters_of_the_rest_that_could_be_anything_are_free() -> None:
    found = fitted("stribeck_friction", [1.0, 0.5, 0.2], [0.5, 0.4, 0.01])

    assert unpinned(found, found.effects.candidates[0], COULOMB) == 1


@pytest.mark.parametrize(
    ("extra", "lower", "odds"),
    [
        ([0.5, 2.0, 0.4], 1.0, 1.0),  # it explains more, and is no likelier for that
        ([0.5, 2.0, 0.4], -4.0, np.exp(2.0)),
        ([0.5, 2.0, 0.4], -8.0, None),  # odds of 55
        ([0.0, 0.01, 0.4], 1.0, None),  # ruled out
        ([0.1, 0.001, 0.001], 100.0, None),  # it is there, and too small to matter
        ([0.5, 0.1, 0.4], 1.0, np.exp(-0.5) * ROWS**0.5),  # only vS is free; odds of 19.2
    ],
)
def test_friction_that_may_be_larger_near_rest_is_listed_beside_coulomb_friction(
    extra: list[float], lower: float, odds: float | None
) -> None:
    """`extra` is tauExtra, its standard deviation, and that of vS = 0.2; `lower` by how much the misfit is lower."""
    plain = fitted("coulomb_friction", [1.0], [0.01])
    other = fitted("stribeck_friction", [1.0, extra[0], 0.2], [0.01, extra[1], extra[2]], ROWS - lower)

    found = rivals(plain, [plain, other], 1.0)

    assert [(r.by, r.holds_it) for r in found] == ([] if odds is None else [("stribeck_friction", True)])
    assert [r.odds for r in found] == ([] if odds is None else [pytest.approx(odds)])


@pytest.mark.parametrize(
    ("room", "extra", "lower", "odds"),
    [
        (0.01, 2.0, 1.0, None),  # the fit does not rule the rest out, and it could hide in next to no samples only
        (0.25, 2.0, 1.0, 4.0),
        (0.25, 0.01, 1.0, 4.0),  # its fit leaves no rest that matters: the nearest of several minima
        (0.25, 2.0, -20.0, 4.0),  # its fit is behind by odds of e^10
        (30.0, 2.0, 1.0, 1.0),  # no likelier than the simpler law
    ],
)
def test_larger_law_is_a_rival_where_the_record_has_room_for_its_rest_whatever_its_fit_found(
    room: float, extra: float, lower: float, odds: float | None
) -> None:
    plain = fitted("coulomb_friction", [1.0], [0.01])
    other = fitted("stribeck_friction", [1.0, 0.0, 0.2], [0.01, extra, 0.4], ROWS - lower)

    found = rivals(plain, [plain, other], 1.0, lambda *_: room)

    assert [r.odds for r in found] == ([] if odds is None else [pytest.approx(odds)])


@pytest.mark.parametrize(
    ("slowest", "share", "creeps"),
    [
        (True, 0.015, True),
        (False, 0.015, False),  # it acts at speeds where friction is no longer smooth
        (True, 0.03, False),  # more than a right law may leave
    ],
)
def test_rest_that_only_keeps_a_machine_from_creeping_is_no_law_of_it(
    slowest: bool, share: float, creeps: bool
) -> None:
    """Smooth friction creeps where a machine stands still: a pendulum followed that better with a rest below 0.01 rad/s."""
    missing, left = 1000.0, 1.0 + share**2 * 999.0
    plain = fitted("coulomb_friction", [1.0], [0.01], left * ROWS)
    other = fitted("stribeck_friction", [1.0, 0.1, 0.01], [0.01, 0.1, 0.006])
    other.fit.at_bound[2] = slowest

    found = rivals(other, [plain, other], 1.0, missing=missing)
    back = rivals(plain, [plain, other], 1.0, missing=missing)

    assert [r.odds for r in found] == ([0.0] if creeps else [])
    assert [r.by for r in back] == ([] if creeps else ["stribeck_friction"])


def test_larger_law_that_is_ruled_out_ranks_behind_the_one_that_is_named() -> None:
    """Whatever its rest imitates: it is less likely than the simpler law by odds of 20."""
    plain = fitted("coulomb_friction", [1.0], [0.01], 1.2 * ROWS)
    other = fitted("stribeck_friction", [1.0, 0.1, 0.01], [0.01, 0.1, 0.006])
    effects = EffectSet(plain.effects.base, [], ("phi",))
    base = Refit(effects, cast(Any, None), (), Fit(np.zeros(0), np.zeros(0), (), 9.0, np.zeros(0, bool), ROWS), 1)
    stage = cast(Any, SimpleNamespace(tangent=SimpleNamespace(base=base), gains={}, colour=SimpleNamespace(scale=1.0)))
    trace = Trace(2, refitted=[plain, other], stages=[stage])

    odds = least_odds(plain, trace.refitted, [])
    found = rank(trace, stage, [*plain.effects.candidates, *other.effects.candidates], plain, odds)

    assert odds == {other.labels: 20.0}
    assert [r.effects for r in found] == [("coulomb_friction",), ("stribeck_friction",)]
    assert found[0].probability == pytest.approx(20.0 * found[1].probability)


def test_simpler_law_in_a_larger_one_keeps_its_values_and_gives_the_rest_its_size() -> None:
    """Element by element: of two joints, one has no friction."""
    base = find_modelica_model("two-mass")
    both = find_candidates(base, base.compile(), [COULOMB, STRIBECK])[0]
    fits = []
    for card, values in ((COULOMB, [0.0, 3.0]), (STRIBECK, [1.0, 1.0, 2.0, 2.0, 0.4])):
        effects = EffectSet(base, [c for c in both if c.card.id == card.id][:1], ("phi1", "phi2"))
        std = np.ones(len(values))
        fit = Fit(np.array(values), std, (), 1.0, std > 2, ROWS, correlation=np.diag(std))
        fits.append(Refit(effects, cast(Any, None), (), fit, 1))
    best, other = fits

    values, sizes = with_simpler(best, other, best.effects.candidates[0], other.effects.candidates[0])

    assert [v.name.split(".")[1] for v in other.effects.variables] == [
        "tauC[1]",
        "tauC[2]",
        "tauExtra[1]",
        "tauExtra[2]",
        "vS",
    ]
    np.testing.assert_array_equal(values, [0.0, 3.0, 0.0, 0.0, 0.4])
    np.testing.assert_array_equal(sizes, [0.0, 0.0, 0.0, 3.0, 0.0])


def test_fits_of_the_larger_law_begin_about_the_simpler_one() -> None:
    alone = fitted("stribeck_friction", [1.0, 0.0, 0.2], [1.0] * 3).effects

    rows = list(starts(alone, {"tauC[1]": 0.04}))

    expected = [(0.04, extra, vs) for extra in (0.012, 0.04) for vs in (0.06, 0.2, 0.6)]
    np.testing.assert_allclose(rows, expected, rtol=1e-12)


@pytest.mark.parametrize(
    ("extra", "shape", "expected"),
    [(0.0, 2.9, (0.2, 0.2)), (-1e-9, 2.9, (0.2, 0.2)), (0.1, 2.9, (0.2, 0.2)), (0.5, 2.9, (0.5, 2.9))],
)
def test_rest_that_is_planned_for_is_as_large_as_matters(
    extra: float, shape: float, expected: tuple[float, float]
) -> None:
    """A fit of the larger law to a record of the simpler one has no rest to speak of, and no experiment would show it."""
    found = fitted("stribeck_friction", [1.0, extra, shape], [0.01, 0.5, 9.0])

    values = at_least(found, found.effects.candidates[0], COULOMB)

    np.testing.assert_allclose(values, [1.0, *expected], rtol=1e-12)

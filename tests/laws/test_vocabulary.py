"""Every term of the vocabulary: its text can be evaluated, its gain has a unit, and the slopes of its force are the filter's."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from oscillator import recorded

from orchestrator.greybox.candidates import Candidate
from orchestrator.greybox.diagnose import decided
from orchestrator.greybox.evidence import case_of
from orchestrator.greybox.expression import evaluate_numbers
from orchestrator.greybox.memory import force, remembered
from orchestrator.greybox.places import Place
from orchestrator.greybox.search import fit_set
from orchestrator.greybox.thresholds import Thresholds
from orchestrator.laws.find import FoundLaw
from orchestrator.laws.proposal import sentence_of
from orchestrator.laws.regression import all_columns, table_of
from orchestrator.laws.response import responses
from orchestrator.laws.terms import Term, law_of, terms_at, variants
from orchestrator.laws.vocabulary import factors
from orchestrator.laws.wide_places import further_of, wide_places
from orchestrator.measurements import load_measurements
from orchestrator.verdicts.result import Estimate

UNITS = {"force": "N", "speed": "m/s", "position": "m", "centre": "m", "time": "s", "of_u": "V", "state": "K"}
SCALES = dict.fromkeys(UNITS, 1.0)
MOTION = Place("motion", "x", "N", {"q": "x", "v": "v", "t": "time", "of_u": "u"}, {}, UNITS, SCALES, (0.0, 1.0))
STORE = Place("storage", "T", "W", {"x": "T", "t": "time", "of_u": "u"}, {}, UNITS, SCALES, (0.0, 1.0))


ALONE = {name: unit for name, unit in UNITS.items() if name not in ("position", "centre", "state")}
SPEED = Place(
    "motion",
    "v",
    "N",
    {"v": "v", "t": "time", "of_u": "u"},
    {},
    ALONE,
    {name: SCALES[name] for name in ALONE},
    (0.0, 1.0),
)


BASE = Place(
    "motion",
    "x-u",
    "N",
    {"q": "(x - u)", "t": "time", "of_u": "u"},
    {},
    *({name: d[name] for name in UNITS if name != "speed"} for d in (UNITS, SCALES)),
    (0.0, 1.0),
)
HEAVY = replace(MOTION, storage=2.0)


@pytest.mark.parametrize(
    "place", [MOTION, SPEED, STORE, BASE, HEAVY], ids=["motion", "speed alone", "storage", "base", "known mass"]
)
def test_every_term_is_a_number_for_every_state_and_each_constant_has_a_unit(place: Place) -> None:
    time = np.linspace(0.0, 1.0, 20)
    wave = np.sin(9 * time)
    coordinates = dict.fromkeys([*place.coordinates, "net"], wave) | {"t": time, "storage": np.full(20, 2.0)}
    for term in terms_at(place, further_of(place)):
        law = law_of([term], place)
        for candidate in variants(law, place):
            assert np.isfinite(force(candidate, coordinates, time)).all(), law.expression
        assert all(p.unit(place.units) for p in law.parameters)


def test_the_unit_of_a_gain_makes_a_force_of_its_term() -> None:
    drag, warmth = factors("speed")[2], factors("by_memory")[0]
    law = law_of([Term(drag, warmth)], MOTION)
    assert law.expression == "-k*v*abs(v)*z"
    assert law.parameters[0].unit(UNITS) == "N.s4/m4"


def test_a_sentence_says_which_terms_have_the_opposite_sign() -> None:
    viscous, drag = (Term(factors("speed")[k]) for k in (0, 2))
    law = law_of([viscous, drag], MOTION)

    def sentence(k1: float, k2: float) -> str:
        values = {name: Estimate(k, "", (k, k)) for name, k in (("k1", k1), ("k2", k2))}
        return sentence_of([viscous, drag], law, values, {})

    assert sentence(1.0, 2.0) == "viscous friction, and quadratic damping"
    assert sentence(1.0, -2.0) == "viscous friction, less quadratic damping"
    assert sentence(-1.0, 2.0) == "viscous friction (with the opposite sign), and quadratic damping"


def test_a_spring_that_builds_up_is_no_rival_of_the_spring_but_one_that_grows_with_an_input_is() -> None:
    spring, growing = factors("position")[0], factors("by_time")[2]

    def found(*terms: Term) -> FoundLaw:
        return FoundLaw(terms, Candidate(law_of(terms, MOTION), MOTION, {}), Any, ())  # type: ignore[arg-type]

    assert found(Term(spring, growing)).extends(found(Term(spring)))
    assert not found(Term(spring, factors("by_further")[0], "of_u")).extends(found(Term(spring)))


def test_a_mass_that_is_picked_up_shares_all_that_pushes_with_the_own_mass() -> None:
    viscous, load, after = factors("speed")[0], factors("inertia")[0], factors("by_time")[0]
    law = law_of([Term(viscous), Term(load, after)], HEAVY)
    at = {"k1": 0.7, "k2": 0.5, "v": 3.0, "t": 4.0, "tFrom2": 1.0, "tWidth2": 0.1, "net": 11.0, "storage": 2.0}
    rate = (at["net"] + evaluate_numbers(law.expression, at)) / at["storage"]
    assert rate == pytest.approx((11.0 - 0.7 * 3.0) / (2.0 + 0.5))
    assert law.written == "-k1*v - k2*der(v)*(0.5 + 0.5*tanh((t - tFrom2)/tWidth2))"
    assert next(p for p in law.parameters if p.name == "k2").unit(UNITS) == "N.s2/m"


def test_two_losses_that_fade_alike_have_one_time_constant() -> None:
    loss, cube, fading = (
        factors("state")[0],
        factors("state")[2],
        next(f for f in factors("by_time") if f.id == "fading"),
    )
    terms = [Term(loss, fading), Term(cube, fading)]
    apart, shared = law_of(terms, STORE), law_of(terms, STORE, shared=True)
    assert [p.name for p in apart.parameters] == ["k1", "T1", "k2", "T2"]
    assert [p.name for p in shared.parameters] == ["k1", "T", "k2"]
    at = {"k1": 2.0, "k2": 3.0, "x": 4.0, "t": 1.0}
    both = [evaluate_numbers(law.expression, at | dict.fromkeys(("T", "T1", "T2"), 5.0)) for law in (apart, shared)]
    assert both[0] == both[1] == pytest.approx(-(2.0 * 4.0 + 3.0 * 64.0) * np.exp(-0.2))


def test_a_memory_with_constant_input_rises_as_the_exponential_does() -> None:
    time = np.linspace(0.0, 2.0, 41)
    found = remembered("(3 - z)/0.5", "z", {}, time)
    np.testing.assert_allclose(found, 3.0 * (1.0 - np.exp(-time / 0.5)), rtol=1e-12)


def test_the_response_to_a_term_is_what_the_filter_of_the_model_with_it_says(tmp_path: Path) -> None:
    source = recorded(tmp_path, lambda t, x, v: -1.5 * v)
    outcome = decided(case_of(source, load_measurements(str(tmp_path))), Thresholds(), lambda message: None)
    about = outcome.nominal
    (place,) = wide_places(outcome.case, about.fit)
    term = Term(factors("speed")[0])
    table = table_of(about.fit, responses(about.fit, place), all_columns([term], place))
    fitted = fit_set(outcome.setting, (table.columns[0].candidate,), about.fit.noise).fit
    work = [
        fitted.box.run(t, np.zeros(1), n.intensity, n.sensors, slopes=True)
        for t, n in zip(fitted.trials, about.fit.noise, strict=True)
    ]
    compiled = np.concatenate([(run.slope[:, :, 0] / np.sqrt(run.variance)).ravel() for run in work])
    error = np.sqrt(np.mean((table.slopes[:, 0] - compiled) ** 2) / np.mean(compiled**2))
    assert error < 0.02

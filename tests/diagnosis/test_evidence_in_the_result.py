"""A diagnosis carries its evidence: what was tried, where the model fails, and curves, in the page and in JSON alike."""

import re
from html import escape
from pathlib import Path

import numpy as np
import pytest

from fmus.catalogue import find_modelica_model
from orchestrator.diagnose import diagnose
from orchestrator.library.cards import effect_library
from orchestrator.measurements import load_measurements
from orchestrator.report.answer.rivals import plain_reason
from orchestrator.report.answer.witness import shape_words, witnesses_of
from orchestrator.report.html import diagnosis_report
from orchestrator.verdicts.result import Diagnosis

PENDULUM = Path(__file__).parents[1] / "cases" / "pendulum"
IDS = ("viscous_friction", "coulomb_friction", "passive_stiffness")


@pytest.fixture(scope="module")
def found(tmp_path_factory: pytest.TempPathFactory) -> Diagnosis:
    """The real pendulum, thinned to 100 Hz, with a library of three effects."""
    folder = tmp_path_factory.mktemp("swings")
    rows = np.genfromtxt(next(PENDULUM.glob("*.csv")), delimiter=",", names=True)
    table = np.column_stack([rows["time_s"], rows["theta_rad"]])[::10]
    np.savetxt(folder / "swing.csv", table, delimiter=",", header="time_s,theta", comments="")
    cards = [card for card in effect_library() if card.id in IDS]
    return diagnose(find_modelica_model("pendulum"), load_measurements(folder), cards=cards)


def test_every_set_that_was_tried_has_its_outcome_in_words(found: Diagnosis) -> None:
    outcomes = {entry.effects: entry.outcome for entry in found.tried}

    assert [entry.effects for entry in found.tried] == [entry.effects for entry in found.ranking]
    assert outcomes[("viscous_friction",)] == "named: held-out trials confirm it"
    assert "BIC/2 behind by" in outcomes[("coulomb_friction",)]
    assert all(outcome for outcome in outcomes.values())


def test_missing_force_of_the_pendulum_falls_with_its_speed_in_the_findings_as_on_the_first_screen(
    found: Diagnosis,
) -> None:
    """Its friction is viscous, so the missing torque opposes speed; that it flips with the sign would say dry friction."""
    (sentence,) = found.findings

    assert re.match("missing force on theta: falls (with|in proportion to) speed of theta", sentence)
    assert shape_words(witnesses_of(found.to_json())).startswith("the missing torque opposes speed of theta")
    rows = [row for row in found.where if row["against"] == "speed of theta"]
    middles = [0.5 * (row["from"] + row["to"]) for row in rows]
    assert np.corrcoef(middles, [row["bias"] for row in rows])[0, 1] < -0.95


def test_law_drawn_through_the_missing_force_is_that_of_the_named_friction(found: Diagnosis) -> None:
    """Viscous friction b supplies -b w in each bin of speed w, whatever else is missing."""
    rows = [row for row in found.where if row["against"] == "speed of theta"]
    b = found.effects[0].parameters["b[1]"].value
    middles = np.array([0.5 * (row["from"] + row["to"]) for row in rows])

    law = np.array([row["law"] for row in rows])
    assert np.polyfit(middles, law, 1)[0] == pytest.approx(-b, rel=0.1)
    assert witnesses_of(found.to_json())[0].law == pytest.approx(tuple(law))
    assert "a-law" in diagnosis_report(found)


def test_probabilities_of_the_ranking_and_of_none_of_them_sum_to_one(found: Diagnosis) -> None:
    document = found.to_json()

    assert sum(row["probability"] for row in document["ranking"]) + document["none_of_these"] == pytest.approx(1.0)
    assert document["none_of_these"] >= 0.1 - 1e-9


def test_json_holds_curves_before_and_after_on_held_out_data_and_their_floor(found: Diagnosis) -> None:
    (curve,) = found.to_json()["curves"]
    theta = curve["signals"]["theta"]

    measured, before, after = (np.array(theta[key]) for key in ("measured", "before", "after"))
    assert len(curve["time_s"]) == len(measured) <= 400
    assert np.std(measured - after) < 0.3 * np.std(measured - before)
    assert theta["noise_floor"] == found.noise_floor["theta"]


def test_page_tells_verdict_first_then_where_it_fails_then_what_was_tried(found: Diagnosis) -> None:
    page = diagnosis_report(found)

    places = [page.index(text) for text in ('class="answer"', "Where the missing force is", "What was tried")]
    assert places == sorted(places)
    for entry in found.tried:
        assert escape(plain_reason(entry.outcome)) in page
    assert found.findings[0] in page

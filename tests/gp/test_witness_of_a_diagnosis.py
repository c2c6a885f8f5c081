"""What a diagnosis hears from the learned functions of a record: which input what is missing goes with."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from orchestrator.gp.trials.functions import Verdict
from orchestrator.gp.trials.witness import Heard, document, sentences, witness_functions
from orchestrator.measurements import load_measurements
from orchestrator.model_argument import load_modelica
from orchestrator.models.symbolic import SymbolicModel

CASES = Path(__file__).parents[1] / "cases"


def test_a_weak_muscle_is_named_by_its_own_function() -> None:
    model = SymbolicModel("arm", load_modelica("arm").compile())
    heard = witness_functions(model, load_measurements(CASES / "arm/case_007"))
    found = heard.functions
    assert [(each.output, each.factor) for each in found if each.needed] == [("q1", "alpha_1")]
    (said,) = sentences(heard)
    assert "depends on alpha_1, times a function of position and speed; as if alpha_1 acted 34.9 % less" in said
    assert sum(row["needed"] for row in document(heard)) == 1
    # The muscle's strength is what the case hides.
    hidden = json.loads((CASES / "arm/answers.json").read_text())["cases"]["case_007"]["parameters"][0]
    (share,) = heard.shares
    assert (share.output, share.factor) == ("q1", "alpha_1")
    assert share.share == pytest.approx(hidden["fmax_factor"] - 1.0, rel=0.02)
    assert share.explained > 0.99
    (row,) = [row for row in document(heard) if row["needed"]]
    assert row["share"] == share.share
    (picture,) = heard.pictures
    assert (picture["balance"], picture["unit"]) == ("q1, times alpha_1", "N.m")
    x, force, band = (np.array(picture[key]) for key in ("x", "force", "band"))
    # A share of the muscle's torque is missing at each posture: it keeps its sign.
    assert np.all(np.diff(x) > 0)
    assert np.all(np.sign(force) == np.sign(force[0]))
    assert np.all(np.abs(force) > 2 * band)


def test_a_model_whose_inputs_do_not_move_has_no_witness() -> None:
    model = SymbolicModel("pendulum", load_modelica("pendulum").compile())
    assert witness_functions(model, load_measurements(CASES / "pendulum")) == Heard()


def test_inputs_are_named_by_how_much_they_count_and_what_is_not_needed_is_not_said() -> None:
    one = Verdict("q1:a", "q1", "a", 0.5, 20.0, 10.0)
    said = sentences(Heard((one, replace(one, factor="b", size=2.0), replace(one, factor="c", gain=1.0))))
    assert [each.split(" depends on ")[1] for each in said] == ["b and a, each times a function of position and speed"]


def test_a_function_without_an_input_depends_on_position_and_speed_alone() -> None:
    alone = Verdict("q1:", "q1", "", 0.5, 20.0, 10.0)
    assert sentences(Heard((alone,))) == ("what is missing at q1 depends on position and speed alone",)
    (both,) = sentences(Heard((alone, Verdict("q1:a", "q1", "a", 0.5, 20.0, 10.0))))
    assert both.endswith("depends on a, times a function of position and speed, and on position and speed alone")

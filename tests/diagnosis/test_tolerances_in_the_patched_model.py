"""What was fitted within tolerances is part of the patched model, so that it errs as the diagnosis says."""

import json
from dataclasses import replace
from pathlib import Path

import pytest

from fmus.catalogue import find_modelica_model
from fmus.errors import MisfitError, ModelicaError
from orchestrator.cli.improve import add
from orchestrator.compare.comparison import compare
from orchestrator.diagnosis.referee.adjusted import with_neighbours
from orchestrator.discover import discover
from orchestrator.measurements import load_measurements
from orchestrator.model_argument import load_model
from orchestrator.models.patch import check_adjusted, patched_model
from orchestrator.verdicts.result import Adjusted, Estimate
from tests.benchmarks.diagnosis.truth.families import Wish, draw_case
from tests.benchmarks.diagnosis.truth.write import write_case


def adjusted(name: str, nominal: float, value: float) -> Adjusted:
    return Adjusted(name, nominal, Estimate(value, "", (value, value)))


def test_patched_model_errs_as_the_diagnosis_reported(tmp_path: Path) -> None:
    wish = Wish("S", "drive", 0, 5, enr=30.0, noise="lo", seconds=5.0, effects=("viscous_friction",))
    truth = write_case(replace(draw_case(wish), changed={"J": 0.02 * 1.04}), tmp_path / "data")
    data = load_measurements(tmp_path / "data")

    found = discover(find_modelica_model("drive"), data, tmp_path / "out", workers=1)

    said = found.diagnosis
    assert [e.id for e in said.effects] == ["viscous_friction"]
    assert said.adjusted[0].fitted.value == pytest.approx(0.0208, rel=2e-3)
    file = tmp_path / "out" / "Drive_1.mo"
    again = compare(load_model(f"{file}:Drive_1"), data, workers=1, floor=said.noise_floor)
    assert again.held_out is not None
    # Both fit start values, to a share of 1e-7 of the misfit.
    assert again.held_out.rmse == pytest.approx(said.held_out.rmse_after, rel=1e-6)
    # It follows the data as the true model does, whose free speed at the start leaves a little more.
    assert again.held_out.rmse["phi"] < truth["true_model_rmse_heldout"]["phi"]
    assert said.held_out.rmse_before["phi"] > 5 * again.held_out.rmse["phi"]
    stepped = compare(load_model(str(tmp_path / "out" / "Drive_1.fmu")), data, workers=1, floor=said.noise_floor)
    assert stepped.held_out is not None
    assert stepped.held_out.rmse == pytest.approx(said.held_out.rmse_after, rel=1e-3)
    assert "adjusted within" in file.read_text()
    document = said.to_json()
    assert document["nuisances"]["in_patched_model"] is True
    # A model added from the written diagnosis is the same class again.
    (tmp_path / "diagnosis.json").write_text(json.dumps(document))
    add.main([str(tmp_path / "diagnosis.json"), "--out", str(tmp_path / "added"), "--quiet"], standalone_mode=False)
    assert (tmp_path / "added" / "Drive_1.mo").read_text() == file.read_text()


def test_element_of_an_array_is_adjusted_and_its_neighbours_stay() -> None:
    arm = find_modelica_model("arm")
    values = with_neighbours(arm.compile(), [adjusted("linkage.m[2]", 1.52, 1.5), adjusted("Kp", 7500, 7600)])

    system = patched_model(arm, "Adjusted", [], adjusted=values).compile()

    check_adjusted(system, values)
    given = {v.name: v.start for v in arm.compile().parameters}
    now = {v.name: v.start for v in system.parameters}
    assert {k for k in given if given[k] != now[k]} == {"linkage.m[2]", "Kp"}
    assert (now["linkage.m[2]"], now["Kp"]) == (1.5, 7600)


def test_adjusted_parameter_that_the_model_lacks_is_refused() -> None:
    with pytest.raises(
        MisfitError, match="J was adjusted within its tolerance, but .*TwoMassDrive has no such parameter"
    ):
        with_neighbours(find_modelica_model("two-mass").compile(), [adjusted("J", 3, 3.1)])


def test_value_that_does_not_arrive_is_reported() -> None:
    with pytest.raises(ModelicaError, match="J = 0.03 did not arrive in .*Drive, which has 0.02"):
        check_adjusted(find_modelica_model("drive").compile(), {"J": 0.03})

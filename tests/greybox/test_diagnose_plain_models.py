"""Models without slots are diagnosed as they are: what is missing is named, nothing is named where nothing is missing."""

import re
import shutil
from pathlib import Path

import numpy as np
import pytest
from plants import diagnosed, slide_record

from fmus.catalogue import find_modelica_model
from orchestrator.discover import discover
from orchestrator.measurements import load_measurements
from orchestrator.verdicts.result import Diagnosis


@pytest.fixture(scope="module")
def viscous(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Diagnosis]:
    """Records of the slide with viscous friction of 1.5 N.s/m, and their diagnosis."""
    folder = slide_record(tmp_path_factory.mktemp("viscous"), lambda x, v: -1.5 * v, seed=7)
    return folder, diagnosed(folder)


def test_dry_and_viscous_friction_are_named_with_their_values(tmp_path: Path) -> None:
    found = diagnosed(slide_record(tmp_path, lambda x, v: -1.5 * v - 0.8 * np.tanh(v / 1e-3), seed=3))
    assert found.verdict == "named"
    values = {effect.id: effect.parameters for effect in found.effects}
    assert set(values) == {"viscous_friction", "coulomb_friction"}
    assert values["viscous_friction"]["b"].value == pytest.approx(1.5, rel=0.1)
    assert values["coulomb_friction"]["fC"].value == pytest.approx(0.8, rel=0.1)


def test_an_input_that_is_constant_in_one_trial_is_no_failure(tmp_path: Path) -> None:
    found = diagnosed(slide_record(tmp_path, lambda x, v: -1.5 * v, seed=6, constant=2))
    assert found.verdict == "named" and [effect.id for effect in found.effects] == ["viscous_friction"]


def test_nothing_is_missing_where_nothing_is(tmp_path: Path) -> None:
    found = diagnosed(slide_record(tmp_path, lambda x, v: 0.0, seed=4))
    assert found.verdict == "adequate" and not found.effects and not found.best


def test_a_discovery_writes_the_users_own_equation_with_the_effect_and_the_error_falls(tmp_path: Path) -> None:
    folder = slide_record(tmp_path / "data", lambda x, v: -400.0 * x**3, seed=5)
    source = find_modelica_model(f"{folder / 'Slide.mo'}:Slide")
    found = discover(source, load_measurements(str(folder)), tmp_path / "out", workers=1)
    assert [effect.id for effect in found.diagnosis.effects] == ["cubic_stiffness"]
    written = (tmp_path / "out" / "Slide_1.mo").read_text()
    assert re.search(r"m\*der\(v\) = F - k\*x - cubic1_k3\*x\^3;", written)
    before, after = (entry.held_out for entry in found.entries)
    assert before is not None and after is not None and after.over_floor < 0.1 * before.over_floor


def test_the_witness_is_the_missing_force_with_the_law_through_it(viscous: tuple[Path, Diagnosis]) -> None:
    _, found = viscous
    picture = found.to_json()["witness"][0]
    x, force, law = (np.array(picture[key]) for key in ("x", "force", "law"))
    assert picture["coordinate"] == "v" and picture["unit"] == "N"
    np.testing.assert_allclose(force, -1.5 * x, atol=0.2)
    np.testing.assert_allclose(law, force, atol=0.2)
    # One definition of what a set explains: in the ranking as in what is left of it.
    assert found.unexplained_share is not None
    assert found.ranking[0].score == pytest.approx(1.0 - found.unexplained_share)


def test_held_out_trials_choose_nothing(viscous: tuple[Path, Diagnosis], tmp_path: Path) -> None:
    one, first = viscous
    other = Path(shutil.copytree(one, tmp_path / "other"))
    table = np.loadtxt(one / "trial_3.csv", delimiter=",", skiprows=1)
    table[:, 2] *= 3.0  # a held-out record that contradicts everything
    np.savetxt(other / "trial_3.csv", table, delimiter=",", header="t,F,x", comments="", fmt="%.9g")
    second = diagnosed(other)
    assert first.effects[0].parameters == (second.effects or second.best)[0].parameters
    assert [entry.score for entry in first.ranking] == [entry.score for entry in second.ranking]

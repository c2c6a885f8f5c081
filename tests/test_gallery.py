"""The gallery: models in the styles of eight people, each with data of a machine that does more than its model."""

import json
from pathlib import Path

import numpy as np
import pytest

from fmus.catalogue import ModelicaModel
from orchestrator.diagnose import diagnose
from orchestrator.discover import discover
from orchestrator.measurements import load_measurements
from orchestrator.verdicts.result import Diagnosis
from tests.cases.gallery.generate import MACHINES
from tests.thinned import thinned

GALLERY = Path(__file__).parent / "cases" / "gallery"
ANSWERS = json.loads((GALLERY / "answers.json").read_text())


@pytest.mark.parametrize("name", ANSWERS)
def test_the_null_machine_moves_as_its_model_says(name: str) -> None:
    """The rates of two programs that share nothing agree at random points."""
    machine = MACHINES[name]
    system = ModelicaModel(name, machine.class_name, GALLERY / name / "Model.mo").compile()
    right = machine.right(False)
    if machine.follow is not None:
        pytest.skip("moves by time stepping")
    random = np.random.default_rng(0)
    for _ in range(3):
        u, x = machine.command(random, 10)[5], machine.start(random)
        x = x + 0.1 * np.abs(x) * random.uniform(-1, 1, len(x))
        expected = right(0.0, x, u)
        inner = ORDER.get(name, range(len(system.states)))
        rates, _ = system.rhs(0.0, x[inner], u, [], [v.start for v in system.parameters])
        assert np.array(rates).ravel() == pytest.approx(expected[inner], rel=1e-6, abs=1e-9)


# Where the states of the program stand in the model; the battery's program has one more.
ORDER = {"battery": [0, 1], "quarter_car": [0, 1, 2, 3]}


@pytest.mark.parametrize("name", [case for answer in ANSWERS for case in (answer, f"{answer}_null")])
def test_each_case_is_a_measurement_set_of_five_trials(name: str) -> None:
    measurements = load_measurements(GALLERY / name)
    assert [trial.subset for trial in measurements.trials] == ["learning"] * 3 + ["held_out"] * 2


def _diagnosed(name: str, data: Path) -> Diagnosis:
    source = ModelicaModel(name, MACHINES[name].class_name, GALLERY / name / "Model.mo")
    return diagnose(source, load_measurements(data), workers=1)


@pytest.mark.parametrize("name", ANSWERS)
def test_the_hidden_effect_is_named_and_sized_within_three_percent_and_the_written_model_has_the_error_that_was_told(
    name: str, tmp_path: Path
) -> None:
    source = ModelicaModel(name, MACHINES[name].class_name, GALLERY / name / "Model.mo")
    discovery = discover(source, load_measurements(GALLERY / name), tmp_path, workers=1, laws=False)
    _expect_the_answer(name, discovery.diagnosis)
    for step, entry in zip(discovery.diagnosis.steps, discovery.entries, strict=True):
        assert step.comparison.held_out is not None and entry.held_out is not None
        assert entry.held_out.rmse == pytest.approx(step.comparison.held_out.rmse, rel=1e-6)


def test_half_the_samples_of_a_converter_show_the_same_effect(tmp_path: Path) -> None:
    _expect_the_answer("buck", _diagnosed("buck", thinned(GALLERY / "buck", tmp_path, 2)))


def _expect_the_answer(name: str, found: Diagnosis) -> None:
    answer = ANSWERS[name]
    assert found.verdict == "named"
    assert [(effect.id, effect.site) for effect in found.effects] == [(answer["effect"], answer["site"])]
    values = {key: estimate.value for key, estimate in found.effects[0].parameters.items() if key in answer["values"]}
    assert values == pytest.approx(answer["values"], rel=0.03)
    assert found.held_out.reducible_removed > 0.9


@pytest.mark.parametrize("name", ANSWERS)
def test_nothing_is_named_where_the_machine_moves_as_its_model_says(name: str) -> None:
    found = _diagnosed(name, GALLERY / f"{name}_null")
    assert found.verdict == "adequate" and not found.effects

"""Cases that look like the world are what they say they are."""

import json
from pathlib import Path

import numpy as np
import pytest

from orchestrator.compare.comparison import compare
from orchestrator.measurements import load_measurements
from orchestrator.model_argument import load_model
from tests.benchmarks.diagnosis.baselines.regression import Regression
from tests.benchmarks.diagnosis.truth.families import Wish, draw_case
from tests.benchmarks.diagnosis.truth.machines import MACHINES
from tests.benchmarks.diagnosis.truth.run import run_trial
from tests.benchmarks.diagnosis.truth.write import write_case
from tests.benchmarks.diagnosis.world.baselines import _best_size, forward_path
from tests.benchmarks.diagnosis.world.families import WorldWish, make_case
from tests.benchmarks.diagnosis.world.files import read_columns, trials_of
from tests.benchmarks.diagnosis.world.loop import close_loop
from tests.benchmarks.diagnosis.world.run import table
from tests.benchmarks.diagnosis.world.scale import scale_case


@pytest.mark.parametrize(("machine", "scale"), [("drive", "milli"), ("tanks", "kilo")])
def test_an_image_is_as_far_from_its_model_as_the_plant_is_from_its_own(
    tmp_path: Path, machine: str, scale: str
) -> None:
    wish = Wish("N0", machine, 0, 3, seconds=2.0)
    for name in ("plant", "image"):
        write_case(draw_case(wish), tmp_path / name)
    model = scale_case(tmp_path / "image", MACHINES[machine], scale)
    plant, image = (
        compare(load_model(m), load_measurements(tmp_path / name), checks=())
        for m, name in ((machine, "plant"), (model, "image"))
    )
    growth = 1.0 if machine == "drive" else 10.0
    for signal, error in plant.learning.rmse.items():
        assert image.learning.rmse[signal] == pytest.approx(growth * error, rel=0.02)


def test_a_controller_follows_the_planned_motion_in_spite_of_friction() -> None:
    drawn = draw_case(Wish("S", "drive", 0, 3, enr=300.0, seconds=2.0, effects=("viscous_friction",)))
    closed = close_loop(drawn, np.random.default_rng(1))
    errors = []
    for case in (drawn, closed):
        wanted = run_trial(case.machine, drawn.plans[0]).outputs
        done = run_trial(case.machine, case.plans[0], case.injections).outputs
        errors.append(float(np.sqrt(np.mean((done - wanted) ** 2))))
    assert errors[1] < 0.5 * errors[0]


def test_discrepancy_is_hidden_and_only_the_main_effect_is_asked_for(tmp_path: Path) -> None:
    answer = make_case(WorldWish("discrepancy", "drive", 1, 3, seconds=2.0), tmp_path)
    assert len(answer["effects"]) == 1
    assert 0.01 <= abs(answer["changed"]["J"] / MACHINES["drive"].values["J"] - 1) <= 0.03
    assert "[tolerances]" not in (tmp_path / "case.toml").read_text()


def test_a_single_record_is_one_file_with_windows(tmp_path: Path) -> None:
    make_case(WorldWish("single", "drive", 0, 3, seconds=1.0), tmp_path)
    assert len(trials_of(tmp_path)) == 1
    subsets = [trial.subset for trial in load_measurements(tmp_path).trials]
    assert subsets == ["learning", "held_out"]


def test_the_same_wish_gives_the_same_case(tmp_path: Path) -> None:
    wish = WorldWish("dirt", "drive", 2, 3, seconds=1.0)
    answers = [make_case(wish, tmp_path / name) for name in "ab"]
    assert json.dumps(answers[0]) == json.dumps(answers[1])
    one, other = (read_columns(trials_of(tmp_path / name)[0]) for name in "ab")
    assert all(np.array_equal(one[name], other[name]) for name in one)


def test_cross_validation_keeps_what_predicts_and_drops_what_does_not() -> None:
    random = np.random.default_rng(4)
    columns = [random.normal(size=(500, 1)) for _ in range(6)]
    residual = (2.0 * columns[3] - 1.0 * columns[1])[:, 0] + random.normal(size=500)
    problem = Regression(residual, tuple(columns), tuple("abcdef"), 500)
    path = forward_path(problem, 3)
    assert path[:2] == [3, 1]
    assert _best_size(problem, path) == 2


def test_the_table_counts_a_wrong_name_and_a_wrong_alarm() -> None:
    rows = [
        {"case": "a", "family": "scale", "true": ["x"], "wrong": "", "checks": [{"kind": "unit", "strong": True}]}
        | {"misfit": {"said": ["y"], "verdict": "named", "worse": False}},
        {"case": "b", "family": "units", "true": ["x"], "wrong": "unit", "checks": [{"kind": "unit", "strong": True}]},
    ]
    text = table(rows)
    assert "| scale: the same plants from milli to kilo scale | misfit | 0/1 = 0 % (0-79) | 1/1 = 100 %" in text
    assert "| wrong data recognised, with the right kind | 1/1 = 100 %" in text

"""What the classes behind `import misfit` promise: the same figures as the commands, new models, one error for wrong arguments."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import misfit

ROOT = Path(__file__).parents[2]
PENDULUM = ROOT / "tests" / "cases" / "pendulum"


def swing(seconds: float = 8.0) -> dict[str, np.ndarray]:
    """Small swings of a pendulum whose friction is known: q = 0.1 exp(-d t) cos(w t)."""
    time = np.arange(0.0, seconds, 0.02)
    return {"time": time, "theta": 0.1 * np.exp(-0.1 * time) * np.cos(5.0 * time)}


class Frame:
    """What pandas, polars and pyarrow frames have in common."""

    def __init__(self, columns: dict[str, np.ndarray]) -> None:
        self._columns, self.columns = columns, list(columns)

    def __getitem__(self, name: str) -> np.ndarray:
        return self._columns[name]


def test_comparison_is_that_of_the_command(tmp_path: Path) -> None:
    from click.testing import CliRunner

    from orchestrator.cli.analyse import compare

    target = tmp_path / "comparison.json"
    CliRunner().invoke(compare, ["pendulum", str(PENDULUM), "--json", str(target)], catch_exceptions=False)

    found = misfit.compare("pendulum", PENDULUM).to_json()

    assert json.loads(target.read_text())["held_out"] == found["held_out"]
    assert misfit.Model("pendulum").compare(misfit.Data.read(PENDULUM)).to_json()["learning"] == found["learning"]


def test_an_effect_gives_a_new_model_that_exports_to_the_same_figures(tmp_path: Path) -> None:
    model, data = misfit.Model("pendulum"), misfit.Data.read(PENDULUM)
    estimate = misfit.Estimate(1.86e-4, "N.m.s/rad", (1.8e-4, 1.9e-4))
    better = model.add([misfit.NamedEffect("viscous_friction", "joint1", {"b[1]": estimate})])

    before, after = (each.compare(data).learning.over_floor for each in (model, better))
    again = misfit.compare(f"{better.to_modelica(tmp_path / 'P.mo')}:P", data).learning.over_floor

    assert after < 0.5 * before
    assert again == pytest.approx(after, rel=1e-6)
    assert better.to_fmu(tmp_path / "p.fmu").stat().st_size > 1000
    assert better.missing(data).rms["theta"] < model.missing(data).rms["theta"]
    assert "90 % band" in better.missing(data).plot().html


@pytest.mark.parametrize("make", [dict, Frame, lambda columns: [columns, columns, columns]])
def test_arrays_become_learning_and_held_out_trials(make: Any) -> None:
    data = misfit.Data.of(make(swing()), units={"theta": "rad"}, noise={"theta": 1e-4})

    assert {trial.subset for trial in data.trials} == {"learning", "held_out"}
    assert data.trials[0].units == {"theta": "rad"}
    assert misfit.Model("pendulum").compare(data).noise_floor["theta"] == pytest.approx(1e-4, rel=0.5)


def test_declared_inputs_have_to_be_inputs_of_the_model() -> None:
    columns = swing()
    data = misfit.Data.of(columns, inputs={"torq": np.zeros_like(columns["time"])})

    with pytest.raises(misfit.MisfitError, match="'torq' was said to drive the model, which has the inputs"):
        misfit.compare("pendulum", data)


@pytest.mark.parametrize(
    ("arrays", "options", "words"),
    [
        ({"theta": [1.0, 2.0]}, {}, "no column time"),
        ({"time": [0.0, 1.0], "theta": [1.0]}, {}, "theta has 1 values and time has 2"),
        ({"time": [0.0, 0.0], "theta": [1.0, 2.0]}, {}, "time has to increase"),
        ({"time": [0.0, 1.0], "theta": [1.0, np.nan]}, {}, r"theta\[1\] = nan; expected finite numbers"),
        ({"time": [0.0, 1.0], "theta": [1.0, 2.0]}, {"units": {"tetha": "rad"}}, "units names 'tetha'"),
        ({"time": [0.0, 1.0], "theta": ["a", "b"]}, {}, "no numbers"),
        (3, {}, "expected a mapping from column to array"),
        ([], {}, "at least one trial"),
    ],
)
def test_wrong_arrays_get_one_clear_error(arrays: Any, options: dict[str, Any], words: str) -> None:
    with pytest.raises(misfit.MisfitError, match=words):
        misfit.Data.of(arrays, **options)


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: misfit.compare(3, PENDULUM), "a int is no model"),
        (lambda: misfit.compare("pendulum", 3), "a int is no measurement"),
        (lambda: misfit.compare(PENDULUM, "pendulum"), "there is no model"),
        (lambda: misfit.Model("pendulumm"), "there is no model 'pendulumm'"),
        (lambda: misfit.Model("gone.fmu"), "gone.fmu does not exist"),
        (lambda: misfit.Model(None), r"Model\(NoneType\)"),
        (lambda: misfit.Data.read({"time": [0.0]}), "arrays go to Data.of"),
        (lambda: misfit.Model("pendulum").add([]), "no effects to add"),
        (lambda: misfit.Model("pendulum").add("fricton"), "there is no effect 'fricton'"),
        (lambda: misfit.Model("pendulum").add(3), "expected the effects of a diagnosis"),
        (lambda: misfit.diagnose("pendulum", PENDULUM, only=["fricton"]), "there is no effect 'fricton'"),
        (lambda: misfit.Model("pendulum").to_fmu("p.zip"), "expected a file NAME.fmu"),
        (lambda: misfit.Model("pendulum").to_modelica("2p.mo"), "a Modelica class is named as its file"),
        (lambda: misfit.System(3), r"System\(int\)"),
        (lambda: misfit.System("gone.toml"), "gone.toml does not exist"),
        (lambda: misfit.regress("gone"), "gone does not exist"),
        (lambda: misfit.Bench().hold(0.0, "x"), "expected a time above 0 s"),
    ],
)
def test_wrong_arguments_get_one_clear_error(call: Any, words: str) -> None:
    with pytest.raises(misfit.MisfitError, match=words) as raised:
        call()
    assert "\n" not in str(raised.value)


def test_a_block_learns_takes_more_data_and_comes_back_from_its_file(tmp_path: Path) -> None:
    x = np.linspace(-1.0, 1.0, 12)
    block = misfit.Block.fit({"x": x}, {"y": 3.0 * x}, units={"x": "m", "y": "N"}, noise={"y": 0.01})
    mean, std = block.predict({"x": [0.5, 4.0]})

    further = block.condition({"x": [4.0]}, {"y": [12.0]})

    assert mean[0] == pytest.approx(1.5, abs=0.03) and std[0] < 0.05 < std[1]
    assert further.predict({"x": 4.0})[0][0] == pytest.approx(12.0, abs=0.1)
    saved = misfit.Block.read(further.save(tmp_path / "block.json"))
    assert saved.predict({"x": 0.3})[0] == further.predict({"x": 0.3})[0]
    assert block.to_fmu(tmp_path / "block.fmu").is_file()
    with pytest.raises(misfit.MisfitError, match="no output 'z'"):
        block.predict({"x": 0.0}, "z")


def test_a_system_runs_steps_and_takes_other_values() -> None:
    system = misfit.System("pendulum")
    result = system.run(stop=0.1)

    assert result.time[-1] == pytest.approx(0.1)
    assert any(name.endswith(".theta") for name in result.names)
    with system.open() as run:
        run.step(0.05)
        assert run.time == pytest.approx(0.05)

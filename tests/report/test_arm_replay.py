"""The replay of a trial shows the torque that the model lacks: one that was put in comes out again."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from builders import comparison

from orchestrator.compare.comparison import compare
from orchestrator.measurements import load_measurements
from orchestrator.model_argument import load_model
from orchestrator.models.symbolic import SymbolicModel
from orchestrator.report.arm_replay import arm_replay, worst_trial

NOISE = 1e-4


@pytest.fixture(scope="module")
def pushed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two trials of the library's arm; in the second the elbow is driven by 0.5 sin(3 t) N.m that the file does not tell."""
    folder = tmp_path_factory.mktemp("pushed")
    model = load_model("arm")
    assert isinstance(model, SymbolicModel)
    time = np.linspace(0.0, 4.0, 801)
    names = [v.name for v in model.inputs]
    random = np.random.default_rng(1)
    for number, torque in ((1, 0.0), (2, 0.5)):
        inputs = np.zeros((len(time), len(names)))
        inputs[:, names.index("alpha_3")] = 0.05 + 0.04 * np.sin(2 * time)
        inputs[:, names.index("alpha_4")] = 0.05 - 0.04 * np.sin(2 * time)
        inputs[:, names.index("correction_q2")] = torque * np.sin(3 * time)
        start = np.array([v.start or 0.0 for v in model.system.states])
        run = model.compiled.run(time, inputs, model.compiled.parameters, start, substeps=4).outputs
        columns = {"time": time, **{name: inputs[:, names.index(name)] for name in ("alpha_3", "alpha_4")}}
        outputs = dict(zip(model.signals, run.T, strict=True))
        columns |= {name: outputs[name] + NOISE * random.standard_normal(len(time)) for name in ("q1", "q2")}
        header = "time,alpha_3,alpha_4,q1,q2"
        np.savetxt(
            folder / f"trial_{number}.csv",
            np.column_stack(list(columns.values())),
            delimiter=",",
            header=header,
            comments="",
        )
    return folder


def test_replay_shows_the_torque_that_was_hidden_in_the_worst_trial(pushed: Path) -> None:
    model, measurements = load_model("arm"), load_measurements(str(pushed))
    found = arm_replay(model, measurements, compare(model, measurements))

    assert found is not None and found.torque is not None and found.torque_std is not None
    inner = (found.time > 0.2) & (found.time < 3.8)
    true = np.column_stack([np.zeros(len(found.time)), 0.5 * np.sin(3 * found.time)])
    error = (found.torque - true)[inner]
    # Four standard deviations and a hundredth of the amplitude for what a smooth prior bends.
    assert np.all(np.abs(error) <= 4 * found.torque_std[inner] + 0.02)
    assert found.shape.length == (0.33, 0.32)
    assert [panel.unit for panel in found.panels] == ["rad", "rad", "N.m"]


def test_model_that_is_no_arm_has_no_replay(pushed: Path) -> None:
    assert arm_replay(load_model("pendulum"), load_measurements(str(pushed)), comparison(n=60)) is None


def test_worst_trial_is_the_one_farthest_above_the_noise_and_no_runaway() -> None:
    found = comparison(n=60, signals=("q1",), n_learning=2, n_held_out=1)
    first, second, third = found.curves
    far = replace(second, modelled={"q1": second.modelled["q1"] + 1.0})
    lost = replace(third, modelled={"q1": np.full(60, np.inf)})

    worst = worst_trial(replace(found, curves=(first, far, lost)))
    assert worst is not None and worst.file == second.file
    assert worst_trial(replace(found, curves=())) is None

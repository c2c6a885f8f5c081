"""The metric of noise: what a right model leaves has unit variance in it, also where the model integrates its inputs."""

from pathlib import Path

import numpy as np
import pytest

from fmus.catalogue import find_modelica_model
from orchestrator.diagnosis.candidates import EffectSet, model_of
from orchestrator.diagnosis.evidence import LearningData, fit_nominal, smoothed
from orchestrator.diagnosis.noise_model import metrics_of
from orchestrator.diagnosis.response import Response
from orchestrator.measurements import bind, load_measurements

INERTIA, TORQUE_NOISE, ANGLE_NOISE = 0.02, 2e-3, 1e-4
CASE = f"""files = ["a.csv", "b.csv"]
learning = [1]
held_out = [2]
[columns]
time = "s"
torque = "N.m"
phi = "rad"
[sensors]
phi_noise_std_rad = {ANGLE_NOISE}
"torque_noise_std_N.m" = {TORQUE_NOISE}
"""


def test_errors_of_a_right_drive_have_unit_variance(tmp_path: Path) -> None:
    """J phi'' = A sin(w t) gives phi = (A/J) (t/w - sin(w t)/w^2) + speed t + phi(0)."""
    random, time, amplitude, rate = np.random.default_rng(3), np.arange(1500) * 0.004, 0.1, 3.0
    angle = amplitude / INERTIA * (time / rate - np.sin(rate * time) / rate**2) - 1.5 * time + 0.2
    for name in ("a.csv", "b.csv"):
        torque = amplitude * np.sin(rate * time) + TORQUE_NOISE * random.normal(size=time.size)
        columns = np.column_stack([time, torque, angle + ANGLE_NOISE * random.normal(size=time.size)])
        np.savetxt(tmp_path / name, columns, delimiter=",", header="time,torque,phi", comments="", fmt="%.12g")
    (tmp_path / "case.toml").write_text(CASE)
    source = find_modelica_model("drive")
    model = model_of(source, source.compile())
    data = bind(load_measurements(tmp_path), model.inputs, model.outputs)
    model, nothing = model.restricted(("phi",)), EffectSet(source, (), ("phi",))
    trials, noise = smoothed(data.learning, np.array([ANGLE_NOISE])), np.array([ANGLE_NOISE])
    first = fit_nominal(nothing, model, LearningData(trials, noise))
    assert first.cost > 4.0  # the noise of the torque does move the drive

    outputs, inputs = ([data.noise_of(name) for name in names] for names in (data.output_names, data.input_names))
    metrics = metrics_of(Response(first, [t.smoother for t in trials]), outputs, inputs)
    found = fit_nominal(nothing, model, LearningData(trials, noise, tuple(metrics)))

    # 500 means over three samples less two start values: the mean of their squares scatters by sqrt(2/500).
    assert found.cost == pytest.approx(1.0, abs=4 * np.sqrt(2 / found.fit.rows))

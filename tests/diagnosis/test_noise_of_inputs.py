"""The metric of noise: what a right model leaves has unit variance in it, also where the model integrates its inputs."""

from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import expm

from fmus.catalogue import find_modelica_model
from orchestrator.diagnosis.fit.candidates import EffectSet
from orchestrator.diagnosis.fit.evidence import LearningData, fit_nominal, smoothed
from orchestrator.diagnosis.fit.extensible import model_of
from orchestrator.diagnosis.linear.noise_model import metrics_of
from orchestrator.diagnosis.linear.response import Response
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


def test_errors_of_two_masses_whose_shaft_rings_have_unit_variance(tmp_path: Path) -> None:
    """Noise of the torque above the slow waves that carry the rest meets the resonance of the shaft, at 18.8 Hz.

    Every trial must have it: whether it is seen must not depend on how far noise happens to make the masses drift. The
    truth is the exact solution for torques that are straight between samples.
    """
    motor, load, stiffness, damping, step, ends = 0.002, 0.005, 20.0, 0.01, 0.004, 1e-5
    shaft = np.array([[-stiffness, stiffness, -damping, damping], [stiffness, -stiffness, damping, -damping]])
    rates = np.zeros((6, 6))  # both angles, both speeds, the torque and its slope
    rates[:2, 2:4], rates[2:4, :4] = np.eye(2), shaft / np.array([[motor], [load]])
    rates[2, 4], rates[4, 5] = 1 / motor, 1.0
    forward, random = expm(rates * step), np.random.default_rng(5)
    names = [f"{k}.csv" for k in range(5)]
    for name in names:
        time = np.arange(1500) * step
        torque, state = 0.02 * np.sin(3.0 * time), np.array([0.1, 0.1, 0.0, 0.0])
        angles = []
        for now, then in zip(torque, np.append(torque[1:], torque[-1]), strict=True):
            angles.append(state[:2])
            state = (forward @ np.r_[state, now, (then - now) / step])[:4]
        shown = np.array(angles) + ends * random.normal(size=(len(time), 2))
        columns = np.column_stack([time, torque + 5e-4 * random.normal(size=len(time)), shown])
        np.savetxt(
            tmp_path / name, columns, delimiter=",", header="time,torque,phiMotor,phiLoad", comments="", fmt="%.12g"
        )
    sensors = f'phiMotor_noise_std_rad = {ends}\nphiLoad_noise_std_rad = {ends}\n"torque_noise_std_N.m" = 5e-4\n'
    units = 'time = "s"\ntorque = "N.m"\nphiMotor = "rad"\nphiLoad = "rad"\n'
    head = f"files = {names}\nlearning = [1, 2, 3, 4]\nheld_out = [5]\n".replace("'", '"')
    (tmp_path / "case.toml").write_text(f"{head}[columns]\n{units}[sensors]\n{sensors}")
    source, signals = find_modelica_model("two-mass"), ("phiMotor", "phiLoad")
    model, nothing = model_of(source, source.compile(), signals), EffectSet(source, (), signals)
    data = bind(load_measurements(tmp_path), model.inputs, model.outputs)
    noise = np.full(2, ends)
    trials = smoothed(data.learning, noise)
    first = fit_nominal(nothing, model, LearningData(trials, noise))

    outputs, inputs = ([data.noise_of(name) for name in names] for names in (data.output_names, data.input_names))
    metrics = metrics_of(Response(first, [t.smoother for t in trials]), outputs, inputs)
    found = [fit_nominal(nothing, model, LearningData((t,), noise, (m,))) for t, m in zip(trials, metrics, strict=True)]

    for each in found:
        assert each.cost == pytest.approx(1.0, abs=5 * np.sqrt(2 / each.fit.rows))

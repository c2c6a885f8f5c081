"""Noise of inputs is carried by the machine with its effects: two encoders of one shaft, of which one reads too little."""

from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import cholesky, expm

from fmus.catalogue import find_modelica_model
from orchestrator.diagnosis.fit import evidence
from orchestrator.diagnosis.fit.candidates import EffectSet
from orchestrator.diagnosis.fit.evidence import LearningData, fit_nominal, refit, smoothed
from orchestrator.diagnosis.fit.extensible import find_candidates, model_of
from orchestrator.diagnosis.linear.carried_noise import NoiseOfSignals, divergence
from orchestrator.diagnosis.linear.noise_model import metrics_of
from orchestrator.diagnosis.linear.response import Response
from orchestrator.library.cards import effect_library
from orchestrator.measurements import bind, load_measurements
from orchestrator.models.estimation import Fit

MOTOR, LOAD, STIFFNESS, DAMPING, STEP = 0.002, 0.005, 20.0, 0.01, 0.004
ENCODER, TORQUE, SCALE = 1e-5, 1e-4, 0.99
SOURCE, SIGNALS = find_modelica_model("two-mass"), ("phiMotor", "phiLoad")


def write_swings(folder: Path) -> None:
    """Trials of two masses on a shaft, by the exact solution for torques that are straight between samples."""
    shaft = np.array([[-STIFFNESS, STIFFNESS, -DAMPING, DAMPING], [STIFFNESS, -STIFFNESS, DAMPING, -DAMPING]])
    rates = np.zeros((6, 6))  # both angles, both speeds, the torque and its slope
    rates[:2, 2:4], rates[2:4, :4] = np.eye(2), shaft / np.array([[MOTOR], [LOAD]])
    rates[2, 4], rates[4, 5] = 1 / MOTOR, 1.0
    forward, random, time = expm(rates * STEP), np.random.default_rng(4), np.arange(1500) * STEP
    for name in ("a.csv", "b.csv"):
        torque, state = 0.02 * np.sin(3.0 * time), np.array([0.1, 0.1, 0.0, 0.0])
        angles = []
        for now, then in zip(torque, np.append(torque[1:], torque[-1]), strict=True):
            angles.append(state[:2])
            state = (forward @ np.r_[state, now, (then - now) / STEP])[:4]
        shown = np.array(angles) * [1.0, SCALE] + ENCODER * random.normal(size=(len(time), 2))
        columns = np.column_stack([time, torque + TORQUE * random.normal(size=len(time)), shown])
        np.savetxt(
            folder / name, columns, delimiter=",", header="time,torque,phiMotor,phiLoad", comments="", fmt="%.12g"
        )
    sensors = "".join(f"{name}_noise_std_rad = {ENCODER}\n" for name in SIGNALS)
    (folder / "case.toml").write_text(
        'files = ["a.csv", "b.csv"]\nlearning = [1]\nheld_out = [2]\n[columns]\ntime = "s"\ntorque = "N.m"\n'
        f'phiMotor = "rad"\nphiLoad = "rad"\n[sensors]\n{sensors}"torque_noise_std_N.m" = {TORQUE}\n'
    )


def test_right_scale_leaves_noise_in_the_metric_of_the_machine_that_has_it(tmp_path: Path) -> None:
    write_swings(tmp_path)
    model = model_of(SOURCE, SOURCE.compile())
    data = bind(load_measurements(tmp_path), model.inputs, model.outputs)
    model, nothing = model.restricted(SIGNALS), EffectSet(SOURCE, (), SIGNALS)
    noise = NoiseOfSignals(*(tuple(map(data.noise_of, names)) for names in (data.output_names, data.input_names)))
    trials = smoothed(data.learning, np.full(2, ENCODER))
    first = fit_nominal(nothing, model, LearningData(trials, np.full(2, ENCODER)))
    nominal = metrics_of(Response(first, [t.smoother for t in trials]), noise.outputs, noise.inputs)
    learning = LearningData(trials, np.full(2, ENCODER), tuple(nominal))
    cards = [card for card in effect_library() if card.id == "joint_scale"]
    (load,) = [c for c in find_candidates(SOURCE, SOURCE.compile(), cards)[0] if c.element == "[2]"]
    scaled = EffectSet(SOURCE, [load], SIGNALS)
    before = refit(scaled, learning, np.array([0.995]))

    there = noise.carried_by(before, learning)
    after = refit(scaled, there, before.values, earlier=before.fit)

    scatter = 4 * np.sqrt(2 / after.fit.rows)
    assert before.cost > 1.0 + scatter
    assert after.cost == pytest.approx(1.0, abs=scatter)
    assert after.values[0] == pytest.approx(SCALE, abs=4 * after.std[0])
    assert noise.carried_by(after, there) is there


def test_divergence_is_that_of_two_gaussian_distributions() -> None:
    """Second computation, with inverse and determinant of the covariances themselves."""
    random = np.random.default_rng(1)
    covariances = [a @ a.T + np.eye(5) for a in random.normal(size=(2, 5, 5))]
    old, new = (np.linalg.inv(cholesky(c, lower=True)) for c in covariances)
    ratio = np.linalg.inv(covariances[0]) @ covariances[1]

    expected = 0.5 * (np.trace(ratio) - 5 - np.log(np.linalg.det(ratio)))

    assert divergence(old, new) == pytest.approx(expected)
    assert divergence(old, old) == pytest.approx(0.0, abs=1e-12)


def test_fit_goes_on_from_a_bound_where_an_earlier_one_ended(monkeypatch: pytest.MonkeyPatch) -> None:
    """A fit that begins at a bound is begun inside it; one that ended there would be led astray by that."""
    cards = [card for card in effect_library() if card.id == "passive_stiffness"]
    effects = EffectSet(SOURCE, find_candidates(SOURCE, SOURCE.compile(), cards)[0], SIGNALS)
    begun: list[np.ndarray] = []

    def stop(*arguments: object) -> None:
        begun.append(np.asarray(arguments[3]))
        raise StopIteration

    monkeypatch.setattr(evidence, "_fit", stop)
    learning, row = LearningData((), np.ones(2), ()), np.array([0.0, 0.0, -0.1, 0.1])
    earlier = Fit(row, row, (), 1.0, np.zeros(4, bool), 1)
    for each in (None, earlier):
        with pytest.raises(StopIteration):
            refit(effects, learning, row, earlier=each)

    assert np.all(begun[0][:2] > 0)
    np.testing.assert_array_equal(begun[1], row)

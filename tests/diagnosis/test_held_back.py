"""What a delay holds back when a record begins while an input is on its way."""

import numpy as np
import pytest
from scipy import linalg

from fmus.catalogue import find_modelica_model
from orchestrator.diagnosis.fit.candidates import EffectSet
from orchestrator.diagnosis.fit.evidence import LearningData, fit_nominal, refit
from orchestrator.diagnosis.fit.extensible import find_candidates
from orchestrator.diagnosis.linear.noise_model import metrics_of
from orchestrator.diagnosis.linear.response import Response
from orchestrator.library.cards import effect_library
from orchestrator.measurements import Noise
from orchestrator.models.held_back import NODES, answers_to, likeliest, ways_before, whitened
from orchestrator.models.smoothing import SmoothedTrial

DRIVE = find_modelica_model("drive")
STEP, INERTIA, NOISE = 0.004, 0.02, 1e-6


def angle(torque: np.ndarray, speed: float) -> np.ndarray:
    """Exact angle of an inertia at half steps, for a torque that is straight between them."""
    h, rates = 0.5 * STEP, torque / INERTIA
    speeds = speed + np.r_[0.0, np.cumsum(0.5 * h * (rates[1:] + rates[:-1]))]
    moves = h * speeds[:-1] + h**2 * (2 * rates[:-1] + rates[1:]) / 6
    return np.asarray(np.r_[0.0, np.cumsum(moves)])


def delayed_trial(phase: float, random: np.random.Generator, half_steps: int = 3) -> SmoothedTrial:
    """A drive whose torque acts so many half samples late; the record begins in the middle of a swing."""
    fine = np.arange(-100, 2000) * 0.5 * STEP
    sampled = fine[::2]
    torque = np.interp(fine, sampled, 0.05 * np.sin(40.0 * sampled + phase))
    late = np.r_[np.full(half_steps, torque[0]), torque[:-half_steps]]
    seen = slice(100, None, 2)
    phi = angle(late, 0.3)[seen] + NOISE * random.standard_normal(1000)
    inputs = np.column_stack([torque[seen], np.zeros(1000)])
    return SmoothedTrial(fine[seen], inputs, phi[:, None], np.array([NOISE]))


def late_torque(signals: list[str]) -> EffectSet:
    candidates, _ = find_candidates(DRIVE, DRIVE.compile(), effect_library())
    return EffectSet(DRIVE, [c for c in candidates if c.card.id == "stimulation_delay"], signals)


@pytest.mark.parametrize("half_steps", [3, 17])
def test_delay_is_found_though_nobody_recorded_what_it_held_back_at_the_start(half_steps: int) -> None:
    """A model that holds the first torque for 6 ms is off by an impulse, and for 34 ms by a swing that bends."""
    random = np.random.default_rng(4)
    trials = tuple(delayed_trial(phase, random, half_steps) for phase in (0.0, 1.0, 2.5))
    found, noise = late_torque(["phi"]), np.array([NOISE])
    nominal = EffectSet(DRIVE, (), ["phi"])
    first = fit_nominal(nominal, nominal.model, LearningData(trials, noise))
    metrics = metrics_of(Response(first, [t.smoother for t in trials]), [Noise(NOISE)], [Noise(0.0), Noise(0.0)])

    late = refit(found, LearningData(trials, noise, tuple(metrics)), np.array([0.015 if half_steps == 3 else 0.03]))

    assert first.cost > 100.0
    assert late.values[0] == pytest.approx(0.5 * half_steps * STEP, abs=max(5 * late.std[0], 1e-5))
    assert late.cost == pytest.approx(1.0, abs=5 * np.sqrt(2 / late.fit.rows))


def test_an_input_that_is_at_rest_at_first_held_nothing_back() -> None:
    model, time = late_torque(["phi"]).model.compiled, STEP * np.arange(200)
    inputs = np.column_stack([np.r_[np.full(40, 0.3), np.linspace(0, 1, 160)], np.zeros(200)])

    assert len(ways_before(model, time, inputs, model.with_values([0.02]))) == 0
    assert len(ways_before(model, time[30:], inputs[30:], model.with_values([0.02]))) == NODES


def test_run_with_what_was_held_back_continues_a_longer_one() -> None:
    """A delay of four samples holds back four, and the model's nodes lie there: both runs do the same."""
    model = late_torque(["q", "w"]).model.compiled
    parameters = model.with_values([NODES * STEP])
    time = STEP * np.arange(300)
    inputs = np.column_stack([np.random.default_rng(6).standard_normal(300), np.zeros(300)])
    begin = 100
    whole = model.run(time, inputs, parameters, np.zeros(2), substeps=2).outputs
    before = inputs[begin - 1 : begin - 1 - NODES : -1, 0] - inputs[begin, 0]

    part = model.run(time[begin:], inputs[begin:], parameters, whole[begin], substeps=2, before=before[None]).outputs
    without = model.run(time[begin:], inputs[begin:], parameters, whole[begin], substeps=2).outputs

    assert np.abs(without - whole[begin:]).max() > 1e-3
    np.testing.assert_allclose(part, whole[begin:], atol=1e-12)


def test_ways_before_are_of_the_size_of_changes_in_as_long() -> None:
    model = late_torque(["phi"]).model.compiled
    parameters, time = model.with_values([0.03]), STEP * np.arange(200)
    inputs = np.column_stack([np.sin(30.0 * time), np.zeros(200)])
    plain = model.run(time, inputs, parameters, np.zeros(2)).outputs

    ways = ways_before(model, time, inputs, parameters)
    found = answers_to(ways, model, time, inputs, parameters, np.zeros(2), plain, 1)

    change = np.sqrt(np.mean((inputs[8:, 0] - inputs[:-8, 0]) ** 2))  # 30 ms are less than eight samples
    moved = model.run(time, inputs, parameters, np.zeros(2), before=np.array([[0, 0, 0, change]])).outputs
    assert ways.shape == (NODES, 1, NODES) and found.shape == (200, 1, NODES)
    np.testing.assert_allclose(found[:, :, -1], moved - plain, atol=1e-12)


def test_a_run_with_what_was_likeliest_held_back_shows_the_trial() -> None:
    """Not so a run without it, whose torque is off for 34 ms."""
    trial = delayed_trial(2.5, np.random.default_rng(3), 17)
    fitted = refit(late_torque(["phi"]), LearningData((trial,), np.array([NOISE])), np.array([0.03]))
    record, model = fitted.records[0], fitted.model
    parameters, start = model.compiled.with_values(fitted.fit.values), fitted.fit.starts[0]

    shown = model.run_fit(record, fitted.fit, 0, fitted.substeps).outputs
    without = model.compiled.run(record.time, record.inputs, parameters, start, substeps=fitted.substeps).outputs

    assert np.sqrt(np.mean((shown - trial.measured) ** 2)) < 1.5 * NOISE
    assert np.sqrt(np.mean((without - trial.measured) ** 2)) > 100 * NOISE


def test_likeliest_sizes_are_shrunk_to_none_by_noise() -> None:
    """Of one disturbance c: c'e/(1 + c'c), as regression with a normal prior gives it."""
    c, errors = np.array([3.0, 4.0]), np.array([6.0, 8.0])

    np.testing.assert_allclose(likeliest(errors, c[:, None]), [50.0 / 26.0])
    assert likeliest(errors, np.zeros((2, 0))).shape == (0,)


def test_whitened_noise_and_disturbances_are_white() -> None:
    random = np.random.default_rng(0)
    disturbances, series = random.standard_normal((12, 3)) * [0.1, 1.0, 30.0], random.standard_normal((12, 4))
    covariance = np.eye(12) + disturbances @ disturbances.T

    found = whitened(series, disturbances)

    np.testing.assert_allclose(found.T @ found, series.T @ np.linalg.solve(covariance, series), rtol=1e-9)
    np.testing.assert_array_equal(whitened(series, disturbances[:, :0]), series)
    np.testing.assert_allclose(whitened(np.eye(12), disturbances), linalg.inv(linalg.sqrtm(covariance)), atol=1e-9)


def test_an_answer_to_a_delayed_input_is_a_difference_of_runs() -> None:
    """Slow changes, so that the trapezoidal rule of the answer errs by little."""
    trial = delayed_trial(0.0, np.random.default_rng(1), 17)
    fitted = refit(late_torque(["phi"]), LearningData((trial,), np.array([NOISE])), np.array([0.03]))
    answered = Response(fitted, [trial.smoother])
    change = 1e-3 * np.cos(5.0 * trial.time)
    moved = trial.inputs + np.column_stack([change, np.zeros(1000)])
    runs = [
        fitted.model.compiled.run(trial.time, u, answered.parameters, fitted.fit.starts[0], substeps=4).outputs
        for u in (trial.inputs, moved)
    ]

    found = answered.to_input(0, 0, change[:, None])[:, :, 0]

    np.testing.assert_allclose(found, runs[1] - runs[0], atol=1e-3 * np.abs(runs[1] - runs[0]).max())

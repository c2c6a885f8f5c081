"""The grey box's filter against dense algebra and differences."""

from dataclasses import replace
from math import factorial
from pathlib import Path

import numpy as np
import pytest
from plants import slide_record

from fmus.catalogue import find_modelica_model
from orchestrator.greybox.evidence import case_of
from orchestrator.greybox.extended import extend
from orchestrator.greybox.filtering import GreyBox, Trial
from orchestrator.measurements import load_measurements


def _box(folder: Path) -> tuple[GreyBox, Trial]:
    slide_record(folder, lambda x, v: 0.0)
    case = case_of(find_modelica_model(f"{folder / 'Slide.mo'}:Slide"), load_measurements(str(folder)))
    extended = extend(case.base, case.balances, case.signals, ())
    box = GreyBox(extended.system, extended.outputs, extended.balances, ("k",))
    first = case.data.trials[0]
    part = slice(0, 25)
    start, spread = np.array([0.0, 0.1]), np.array([0.01, 0.3])
    return box, Trial("first", first.time[part], first.inputs[part], first.outputs[part], start, spread)


def test_the_likelihood_is_that_of_the_joint_normal_distribution_of_all_samples(tmp_path: Path) -> None:
    box, trial = _box(tmp_path)
    intensity, noise = 0.4, 3e-3
    found = box.run(trial.in_steps(4), np.array([30.0]), np.array([intensity]), np.array([noise]))

    n, step, m, k = len(trial.time), trial.time[1] - trial.time[0], 2.0, 30.0
    w = np.sqrt(k / m)
    free = np.array([[np.cos(w * step), np.sin(w * step) / w], [-w * np.sin(w * step), np.cos(w * step)]])
    push = np.array([(1 - np.cos(w * step)) / k, np.sin(w * step) / (w * m)])
    mean, covariance = [trial.start], [np.diag(trial.spread**2)]
    for i in range(n - 1):
        ramp = (trial.inputs[i + 1, 0] - trial.inputs[i, 0]) / step
        rise = np.array([step / k - np.sin(w * step) / (w * k), push[0]])
        mean.append(free @ mean[-1] + push * trial.inputs[i, 0] + rise * ramp)
        covariance.append(free @ covariance[-1] @ free.T + np.outer(push, push) * intensity**2 / step)
    joint = np.empty((n, n))
    for i in range(n):
        passed = np.eye(2)
        for j in range(i, n):
            joint[i, j] = joint[j, i] = (passed @ covariance[i])[0, 0]
            passed = free @ passed
    joint += noise**2 * np.eye(n)
    error = trial.measured[:, 0] - np.array([each[0] for each in mean])
    expected = -0.5 * (error @ np.linalg.solve(joint, error) + np.linalg.slogdet(joint)[1])
    assert abs(found.log_likelihood - expected) < 1e-4 * abs(expected)


def test_slopes_of_innovations_are_their_differences_where_nothing_is_corrected(tmp_path: Path) -> None:
    box, trial = _box(tmp_path)
    trial = Trial("fixed", trial.time, trial.inputs, trial.measured, trial.start, np.zeros(2))
    quiet = np.array([1e-12]), np.array([1e-3])
    slope = box.run(trial, np.array([30.0]), *quiet, slopes=True).slope[:, 0, 0]
    above, below = (box.run(trial, np.array([30.0 + h]), *quiet).innovation[:, 0] for h in (1e-3, -1e-3))
    np.testing.assert_allclose(slope, (above - below) / 2e-3, rtol=1e-5, atol=1e-9)


def test_a_sample_that_was_not_measured_takes_no_part(tmp_path: Path) -> None:
    box, trial = _box(tmp_path)
    measured = trial.measured.copy()
    measured[7] = np.nan
    gap = Trial("gap", trial.time, trial.inputs, measured, trial.start, trial.spread)
    found = box.run(gap, np.array([30.0]), np.array([0.4]), np.array([3e-3]))
    assert found.variance[7, 0] == 0.0 and found.innovation[7, 0] == 0.0
    assert np.isfinite(found.log_likelihood)


def test_a_linear_model_in_lines_has_the_likelihood_of_a_run_with_any_other_noise(tmp_path: Path) -> None:
    box, trial = _box(tmp_path)
    measured = np.array(trial.measured)
    measured[7] = np.nan
    trial = Trial("gap", trial.time, trial.inputs, measured, trial.start, trial.spread)
    theta = np.array([30.0])
    lines = box.in_lines(trial.in_steps(4), theta, np.array([0.4]), np.array([3e-3]))
    for intensity, noise in ((0.4, 3e-3), (0.01, 1e-2), (5.0, 1e-4)):
        other = np.array([intensity]), np.array([noise])
        expected = box.run(trial.in_steps(4), theta, *other).log_likelihood
        assert abs(lines.log_likelihood(*other) - expected) < 1e-7 * abs(expected)


def test_slopes_by_noise_are_those_of_runs_with_other_noise(tmp_path: Path) -> None:
    box, trial = _box(tmp_path)
    theta, logs, h = np.array([30.0]), np.log([0.4, 3e-3]), 1e-4
    value, found, _ = box.in_lines(trial.in_steps(4), theta, np.array([0.4]), np.array([3e-3])).slopes(
        np.array([0.4]), np.array([3e-3])
    )
    for slope, step in zip(found, h * np.eye(2), strict=True):
        up, down = (box.run(trial.in_steps(4), theta, *np.exp(at).reshape(2, 1)) for at in (logs + step, logs - step))
        expected = (up.log_likelihood - down.log_likelihood) / (2 * h)
        assert abs(slope - expected) < 1e-5 * (1 + abs(expected))


def test_what_shorter_steps_would_move_a_state_by_is_what_they_do_to_a_spring(tmp_path: Path) -> None:
    box, trial = _box(tmp_path)
    stiffness, intensity, noise = 3e4, 0.4, 3e-3
    trial = replace(trial, inputs=np.zeros_like(trial.inputs), steps=np.array([1] + [2] * (len(trial.time) - 1)))
    off = box.off_by_steps(trial, np.array([stiffness]), np.array([intensity]), np.array([noise]))
    run = box.run(trial, np.array([stiffness]), np.array([intensity]), np.array([noise]), covariances=True)
    assert run.ahead_covariance is not None
    pace = np.array([[0.0, 1.0], [-stiffness / 2.0, 0.0]]) * (trial.time[1] - trial.time[0])
    powers = [np.linalg.matrix_power(pace, k) / factorial(k) for k in range(5)]  # Runge and Kutta's series

    def moved(parts: int) -> np.ndarray:
        once = sum(power / parts**k for k, power in enumerate(powers))
        return np.asarray(np.linalg.matrix_power(once, parts) @ run.mean[0])

    spread = np.sqrt(np.diag(run.ahead_covariance[1]))
    assert off[1] == pytest.approx(np.max(np.abs(moved(4) - moved(2)) / spread), rel=1e-6)
    assert off[1] > 1e-4

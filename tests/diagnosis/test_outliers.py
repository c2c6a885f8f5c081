"""Outliers that only a model shows."""

import numpy as np
import pytest

from orchestrator.diagnosis.noise.metric import Metric, coloured_metric, white_metric
from orchestrator.diagnosis.noise.outliers import without_outliers
from orchestrator.measurements.colour import Noise
from orchestrator.models.smoothing import SmoothedTrial

STEP, COUNT = 0.004, 400
SLOW = Noise(0.05, 1.0, 0.9)
METRICS = {
    "coloured": coloured_metric([SLOW.covariance(COUNT, 1)], 1, np.zeros((COUNT, 1, 0))),
    "coloured means": coloured_metric([SLOW.covariance(COUNT // 4, 4)], 4, np.zeros((COUNT, 1, 0))),
    "white": white_metric(np.array([1.0]), 1),
}


def case(spike: float) -> tuple[SmoothedTrial, np.ndarray, np.ndarray]:
    """A trial with a spike at sample 202, its error, and the trial without the spike."""
    time = np.arange(COUNT) * STEP
    clean = 50 * np.sin(8 * time)[:, None] + SLOW.draw((COUNT, 1), np.random.default_rng(3))
    measured = clean + spike * (np.arange(COUNT) == 202)[:, None]
    trial = SmoothedTrial(time, np.zeros((COUNT, 0)), measured, np.array([1.0]))
    return trial, 50 * np.sin(8 * time)[:, None] - measured, clean


@pytest.mark.parametrize("name", METRICS)
def test_a_sample_that_is_off_by_itself_is_put_where_its_neighbours_let_expect_it(name: str) -> None:
    trial, error, clean = case(40.0)

    found = without_outliers(trial, error, METRICS[name])

    assert np.flatnonzero(found.measured != trial.measured).tolist() == [202]
    assert abs(found.measured[202, 0] - clean[202, 0]) < 6.0


@pytest.mark.parametrize("name", METRICS)
def test_noise_alone_has_no_outliers_and_a_wrong_model_has_none_either(name: str) -> None:
    trial, error, _ = case(0.0)
    wrong = error + 20 * np.sin(20 * trial.time)[:, None]

    for each in (error, wrong):
        assert without_outliers(trial, each, METRICS[name]) is trial


@pytest.mark.parametrize("name", METRICS)
def test_errors_that_bend_where_a_force_sets_in_hold_no_outliers(name: str) -> None:
    trial, error, _ = case(0.0)
    bent = error + 2000.0 * np.maximum(trial.time - 0.8, 0.0)[:, None]

    assert without_outliers(trial, bent, METRICS[name]) is trial


def test_what_happens_often_is_no_accident() -> None:
    trial, error, _ = case(0.0)
    metric: Metric = METRICS["white"]
    error[::10] += 30.0

    assert without_outliers(trial, error, metric) is trial

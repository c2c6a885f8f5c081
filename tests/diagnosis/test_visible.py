"""How large a change is beside the noise, in the outputs as they are."""

import numpy as np
import pytest

from orchestrator.diagnosis.linear.visible import over_noise
from orchestrator.diagnosis.noise.metric import Metric, white_metric

ROWS = 60
TIME = np.linspace(0.0, 1.0, ROWS)


def drifting() -> tuple[Metric, np.ndarray]:
    """Noise of a sensor and, a thousand times larger, of a drift that comes with it; and its covariance."""
    walk = np.cumsum(np.eye(ROWS), axis=0)
    covariance = np.eye(ROWS) + 0.3 * walk @ walk.T + 1e6 * np.outer(TIME, TIME)
    return Metric(1, np.asfortranarray(np.linalg.inv(np.linalg.cholesky(covariance)))), covariance


def test_share_is_that_of_what_least_squares_of_the_starts_leaves_of_both() -> None:
    """Second way: residuals of ordinary regressions on the starts, each sample in units of its noise."""
    metric, covariance = drifting()
    change, starts = np.sin(7 * TIME), np.column_stack([np.ones(ROWS), TIME])
    scale = np.sqrt(np.diag(covariance))
    kept = np.eye(ROWS) - (starts / scale[:, None]) @ np.linalg.pinv(starts / scale[:, None])
    power = np.diag(kept @ (covariance / np.outer(scale, scale)) @ kept.T)

    total, rows = over_noise(metric(change[:, None]), metric(starts[:, None, :]), metric)

    assert rows == ROWS
    assert total == pytest.approx(np.sum((kept @ (change / scale)) ** 2 / power), rel=1e-5)


def test_a_drift_beside_drifting_noise_shows_more_in_the_outputs_than_in_the_metric() -> None:
    """Of noise that is a thousand times larger along one drift, a change along it is a small share in few directions."""
    metric, covariance = drifting()
    change = 0.5 * np.sqrt(TIME @ covariance @ TIME) / (TIME @ TIME) * TIME
    white = metric(change[:, None])

    total, rows = over_noise(white, np.zeros((ROWS, 0)), metric)

    assert np.sqrt(np.mean(white**2)) < 0.15
    assert np.sqrt(total / rows) > 0.45


def test_white_noise_shows_as_in_the_metric() -> None:
    metric, change = white_metric(np.array([0.2, 3.0]), 1), np.random.default_rng(1).standard_normal((ROWS, 2))

    total, rows = over_noise(metric(change), np.zeros((2 * ROWS, 0)), metric)

    assert rows == 2 * ROWS
    assert total == pytest.approx(np.sum((change / [0.2, 3.0]) ** 2))


def test_what_starts_do_is_no_change() -> None:
    metric, _ = drifting()
    starts = metric(np.column_stack([np.ones(ROWS), TIME])[:, None, :])

    total, _ = over_noise(starts @ np.array([2.0, -1.0]), starts, metric)

    assert total < 1e-9

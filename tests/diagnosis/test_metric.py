"""The metric: noise becomes white with unit variance, and signals keep their likelihood."""

import numpy as np

from orchestrator.diagnosis.metric import coloured_metric, hats, stride_for, thin, white_metric

RANDOM = np.random.default_rng(4)
TIME = np.arange(600) * 0.01


def test_coloured_noise_becomes_white_with_unit_variance() -> None:
    carried = np.cumsum(hats(TIME), axis=0)[:, None, :] * np.array([0.3, 0.2])[None, :, None]
    own = [std**2 / 2 * np.eye(len(TIME) // 2) for std in (1.0, 0.5)]
    metric = coloured_metric(own, 2, carried)
    draws = carried @ RANDOM.standard_normal((carried.shape[2], 400))
    draws += RANDOM.standard_normal(draws.shape) * np.array([1.0, 0.5])[None, :, None]

    white = metric(draws)

    covariance = white @ white.T / 400
    # The mean of 600 variances of 400 draws each errs by 0.3 %; a correlation by 0.05.
    assert abs(np.mean(np.diag(covariance)) - 1) < 0.02
    neighbours = np.diag(covariance, 2)
    assert abs(np.mean(neighbours)) < 0.01


def test_without_carried_noise_the_coloured_metric_is_the_white_one() -> None:
    std, series = np.array([0.1, 0.2]), RANDOM.standard_normal((600, 2, 3))

    found = coloured_metric([each**2 / 3 * np.eye(200) for each in std], 3, np.zeros((600, 2, 1)))(series)

    np.testing.assert_allclose(found, white_metric(std, 3)(series), atol=1e-9)


def test_hats_pass_the_power_of_white_noise_on_to_slow_systems() -> None:
    """A running sum over one second of unit white noise has variance 100; by hats it keeps it."""
    shapes = hats(TIME)
    summed = np.cumsum(shapes, axis=0)
    variance = np.sum((summed[400] - summed[300]) ** 2)
    assert abs(variance / 100 - 1) < 0.05


def test_thinning_keeps_means_and_bounds_the_number_of_samples() -> None:
    assert len(thin(TIME, stride_for(len(TIME), 1))) <= 600
    assert stride_for(6001, 1) == 11
    np.testing.assert_allclose(thin(TIME[:, None], 4)[0], TIME[:4].mean())

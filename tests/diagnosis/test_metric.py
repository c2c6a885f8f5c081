"""The metric: noise becomes white with unit variance, and signals keep their likelihood."""

import numpy as np

from orchestrator.diagnosis.noise.metric import (
    Metric,
    NoisyInput,
    coloured_metric,
    stride_for,
    thin,
    waves,
    white_metric,
)
from orchestrator.measurements.colour import Noise

RANDOM = np.random.default_rng(4)
TIME = np.arange(600) * 0.01


def test_coloured_noise_becomes_white_with_unit_variance() -> None:
    carried = np.cumsum(waves(len(TIME)), axis=0)[:, None, :] * np.array([0.3, 0.2])[None, :, None]
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


def test_waves_carry_slow_coloured_noise_with_its_covariance() -> None:
    """A running sum over one second of unit white noise has variance 100; that of slow noise is a sum of its covariance."""
    shapes = waves(len(TIME))
    np.testing.assert_allclose(shapes.T @ shapes, np.eye(200), atol=1e-12)
    for noise in (Noise(1.0), Noise(0.2, 1.0, 0.9)):
        slow = shapes * np.sqrt(noise.density(0.5 * np.arange(200) / 600))
        summed = np.cumsum(slow, axis=0)
        variance = np.sum((summed[400] - summed[300]) ** 2)
        assert abs(variance / noise.covariance(100, 1).sum() - 1) < 0.05


def test_thinning_keeps_means_and_bounds_the_number_of_samples() -> None:
    assert len(thin(TIME, stride_for(len(TIME), 1))) <= 600
    assert stride_for(6001, 1) == 11
    np.testing.assert_allclose(thin(TIME[:, None], 4)[0], TIME[:4].mean())


def test_the_likeliest_noise_of_inputs_is_the_conditional_mean() -> None:
    """Textbook: of jointly Gaussian w and e, E[w | e] = cov(w, e) cov(e)^-1 e; its error is independent of e."""
    shapes, carry = RANDOM.standard_normal((40, 5)), RANDOM.standard_normal((40, 1, 5))
    metric = coloured_metric([0.3 * np.eye(40)], 1, carry)
    noisy = Metric(1, metric.whitener, (NoisyInput(1, shapes, metric(carry)),))
    error = carry @ RANDOM.standard_normal(5)
    covariance = carry[:, 0] @ carry[:, 0].T + 0.3 * np.eye(40)

    found = noisy.input_noise(noisy(error), 3)

    np.testing.assert_allclose(
        found[:, 1], shapes @ carry[:, 0].T @ np.linalg.solve(covariance, error[:, 0]), atol=1e-9
    )
    assert not found[:, [0, 2]].any()


def test_errors_beyond_all_noise_give_no_more_noise_than_is_likely() -> None:
    carry = RANDOM.standard_normal((40, 1, 5))
    metric = coloured_metric([0.3 * np.eye(40)], 1, carry)
    noisy = Metric(1, metric.whitener, (NoisyInput(0, np.eye(40)[:, :5], metric(carry)),))

    found = noisy.input_noise(noisy(1e6 * carry[:, :, 0]), 1)

    assert np.sum(found**2) <= 5 + 3 * np.sqrt(10) + 1e-9


def test_a_clock_that_jitters_makes_what_moves_noisy_and_signals_err_together() -> None:
    early = np.column_stack([np.linspace(0, 1, 60), np.linspace(0, 2, 60)])
    metric = coloured_metric([0.04 * np.eye(60), 0.01 * np.eye(60)], 1, np.zeros((60, 2, 0)), early)
    draws = early[:, :, None] * RANDOM.standard_normal((60, 1, 4000))
    draws += RANDOM.standard_normal((60, 2, 4000)) * np.array([0.2, 0.1])[None, :, None]

    white = metric(draws)

    np.testing.assert_allclose(white @ white.T / 4000, np.eye(120), atol=0.1)


def test_what_has_no_columns_keeps_its_rows() -> None:
    """A model without start values that can be moved has no slopes, but has errors."""
    assert Metric(1, np.ones(2))(np.zeros((40, 2, 0))).shape == (80, 0)

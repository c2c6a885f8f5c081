"""Derivatives of sampled signals."""

import numpy as np

from orchestrator.models.smoothing import second_difference


def test_a_parabola_has_its_second_derivative_at_uneven_times() -> None:
    time = np.cumsum(np.random.default_rng(1).uniform(0.5, 2.0, 50))
    series = np.column_stack([3.0 * time**2 - time, -0.5 * time**2 + 4.0])

    np.testing.assert_allclose(second_difference(series, time), np.tile([6.0, -1.0], (50, 1)), rtol=1e-9)

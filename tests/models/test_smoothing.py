"""Derivatives of sampled signals."""

import numpy as np
import pytest
from scipy import signal

from orchestrator.models.smoothing import low_pass, second_difference


def test_a_parabola_has_its_second_derivative_at_uneven_times() -> None:
    time = np.cumsum(np.random.default_rng(1).uniform(0.5, 2.0, 50))
    series = np.column_stack([3.0 * time**2 - time, -0.5 * time**2 + 4.0])

    np.testing.assert_allclose(second_difference(series, time), np.tile([6.0, -1.0], (50, 1)), rtol=1e-9)


@pytest.mark.parametrize("order", [1, 3, 4])
@pytest.mark.parametrize("shape", [(200,), (200, 2), (200, 2, 3)])
def test_low_pass_is_that_of_scipy_to_the_last_bit(order: int, shape: tuple[int, ...]) -> None:
    series = np.cumsum(np.random.default_rng(order).standard_normal(shape), axis=0)
    sections = signal.butter(order, 0.2, output="sos")

    assert np.array_equal(low_pass(series, order, 0.2), signal.sosfiltfilt(sections, series, axis=0))


def test_low_pass_refuses_a_record_in_which_it_cannot_settle() -> None:
    with pytest.raises(ValueError, match="5 samples are too few"):
        low_pass(np.zeros(5), 4, 0.2)

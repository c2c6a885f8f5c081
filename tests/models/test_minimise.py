"""The search for the least value within bounds, on functions whose least value is known."""

import numpy as np
import pytest

from orchestrator.models.minimise import minimise

FREE = np.full(2, -np.inf), np.full(2, np.inf)


def valley(x):
    """Rosenbrock's: a bent valley with its lowest point 0 at (1, 1)."""
    value = 100 * (x[1] - x[0] ** 2) ** 2 + (1 - x[0]) ** 2
    return value, np.array([-400 * x[0] * (x[1] - x[0] ** 2) - 2 * (1 - x[0]), 200 * (x[1] - x[0] ** 2)])


STIFF = np.array([1.0, 1e4])


def bowl(x):
    return 0.5 * float(STIFF @ (x - 3.0) ** 2), STIFF * (x - 3.0)


def test_a_bent_valley_is_followed_to_its_lowest_point():
    found = minimise(valley, np.array([-1.2, 1.0]), *FREE)
    assert found.point == pytest.approx([1.0, 1.0], abs=1e-3)
    assert found.value < 1e-7
    assert found.evaluations < 80


def test_bounds_hold_and_the_rest_is_still_minimised():
    found = minimise(bowl, np.zeros(2), np.array([-1.0, -1.0]), np.array([1.0, 9.0]))
    assert found.point == pytest.approx([1.0, 3.0], abs=1e-6)


def test_what_is_known_of_the_curvature_saves_evaluations():
    begin = np.array([3.5, 2.6])
    first = minimise(bowl, begin, *FREE)
    again = minimise(bowl, begin, *FREE, curvature=np.diag(STIFF))
    assert again.evaluations == 2 < first.evaluations
    assert again.value < 1e-12


def test_a_region_without_values_is_stepped_back_from():
    def walled(x):
        return bowl(x) if x[1] < 3.2 else (np.nan, np.full(2, np.nan))

    assert minimise(walled, np.array([0.0, -9.0]), *FREE).point == pytest.approx([3.0, 3.0], abs=1e-3)


def test_a_start_without_a_value_ends_there_with_infinity():
    found = minimise(lambda x: (np.nan, np.full(2, np.nan)), np.ones(2), *FREE)
    assert found.value == np.inf
    assert found.evaluations == 1

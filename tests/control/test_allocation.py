"""Activations for a torque, against algebra and another solver."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import minimize

from orchestrator.control.hold import Allocation
from tests.benchmarks.control.run import slope

ALLOCATION = Allocation(2, 6)


def muscles(seed: int) -> np.ndarray:
    """Capabilities (2, 6) of which every torque up to some size can be made."""
    rng = np.random.default_rng(seed)
    angle = np.arange(6) * np.pi / 3 + rng.uniform(-0.3, 0.3, 6)
    return rng.uniform(5.0, 20.0, 6) * np.array([np.cos(angle), np.sin(angle)])


@settings(deadline=None, max_examples=25)
@given(seed=st.integers(0, 10**6), x=st.floats(-4, 4), y=st.floats(-4, 4))
def test_the_torque_is_made_within_bounds_with_no_more_effort_than_another_solver_needs(seed, x, y):
    capability, torque = muscles(seed), np.array([x, y])
    found = ALLOCATION(torque, capability)
    assert found.min() >= 0.0
    assert found.max() <= 1.0
    assert np.allclose(capability @ found, torque, atol=1e-4)
    other = minimize(
        lambda a: a @ a,
        np.full(6, 0.3),
        jac=lambda a: 2 * a,
        bounds=[(0, 1)] * 6,
        constraints={"type": "eq", "fun": lambda a: capability @ a - torque, "jac": lambda a: capability},
        options={"ftol": 1e-12, "maxiter": 300},
    )
    if other.success:
        assert found @ found <= other.fun + 1e-5


def test_one_muscle_for_each_direction_is_used_alone():
    capability = np.array([[10.0, -10.0, 0.0, 0.0, 0.0, 0.0], [0.0, 0.0, 20.0, -20.0, 0.0, 0.0]])
    assert ALLOCATION(np.array([2.0, -5.0]), capability) == pytest.approx([0.2, 0, 0, 0.25, 0, 0], abs=1e-5)


def test_of_a_torque_that_is_too_large_as_much_as_possible_is_made():
    capability = np.array([[10.0, -10.0, 0.0, 0.0, 0.0, 0.0], [0.0, 0.0, 20.0, -20.0, 0.0, 0.0]])
    found = ALLOCATION(np.array([50.0, 10.0]), capability)
    assert found == pytest.approx([1.0, 0, 0.5, 0, 0, 0], abs=1e-4)


def test_the_slope_is_what_a_small_torque_changes():
    capability, torque, step = muscles(3), np.array([1.5, -2.0]), 1e-4
    found = slope(ALLOCATION(torque, capability), capability)
    for k, moved in enumerate(step * np.eye(2)):
        change = (ALLOCATION(torque + moved, capability) - ALLOCATION(torque - moved, capability)) / (2 * step)
        assert np.allclose(found[:, k], change, atol=1e-5)

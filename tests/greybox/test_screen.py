"""Regression on whitened innovations, by algebra on random columns."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from orchestrator.greybox.screen import Normal


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 10**6))
def test_squares_from_zero_are_those_of_innovations_without_the_fitted_parameters(seed: int) -> None:
    random = np.random.default_rng(seed)
    slopes, innovations, theta = random.normal(size=(3, 20, 4)), random.normal(size=(3, 20)), random.normal(size=4)

    def normal(errors: np.ndarray) -> Normal:
        matrix = np.einsum("bnk,bnl->bkl", slopes, slopes)
        vector = np.einsum("bnk,bn->bk", slopes, errors)
        return Normal(matrix, vector, np.sum(errors**2, axis=1), np.full(3, 20))

    moved, wanted = normal(innovations).from_zero(theta), normal(innovations - slopes @ theta)
    assert moved.vector == pytest.approx(wanted.vector)
    assert moved.square == pytest.approx(wanted.square)

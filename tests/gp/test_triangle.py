"""Triangular factors against dense algebra, for sizes on both sides of the block size."""

import numpy as np
import pytest

from orchestrator.gp.triangle import inverse_from_factor, solve_half, solve_lower, solve_transposed

SIZES = [1, 2, 47, 48, 49, 97, 200]


def positive(count: int) -> np.ndarray:
    half = np.random.default_rng(count).normal(size=(count, count + 3))
    return half @ half.T


@pytest.mark.parametrize("count", SIZES)
def test_the_inverse_of_a_factored_matrix_is_its_inverse(count):
    matrix = positive(count)
    found = inverse_from_factor(np.asfortranarray(np.linalg.cholesky(matrix)))
    assert np.allclose(np.tril(found), np.tril(np.linalg.inv(matrix)), rtol=1e-8, atol=1e-10)


@pytest.mark.parametrize("columns", [1, 2, 9])
def test_solutions_are_those_of_dense_algebra(columns):
    matrix = positive(60)
    lower, right = np.linalg.cholesky(matrix), np.random.default_rng(1).normal(size=(60, columns))
    kept = right.copy()
    assert np.allclose(lower @ solve_half(lower, right), right)
    assert np.allclose(lower.T @ solve_transposed(lower, right), right)
    assert np.allclose(matrix @ solve_lower(lower, right), right)
    assert np.array_equal(right, kept)

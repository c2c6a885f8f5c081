"""Taking a datum out of a factor, compiled and by NumPy, against factoring what is left."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fmus.errors import MisfitError
from orchestrator.gp import removal
from orchestrator.models import compiled

ROOM = 12


def factored(count: int, seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """A positive matrix and right sides, and their factor in a larger one as a learner keeps it."""
    rng = np.random.default_rng(seed)
    half = rng.normal(size=(count, count + 2))
    matrix, right = half @ half.T, rng.normal(size=(count, 2))
    lower, rows = np.asfortranarray(np.eye(ROOM)), np.zeros((2, ROOM))
    lower[:count, :count] = np.linalg.cholesky(matrix)
    rows[:, :count] = np.linalg.solve(lower[:count, :count], right).T
    return matrix, right, lower, rows


@pytest.mark.parametrize("remove", [removal.remove, removal.remove_by_numpy])
@settings(deadline=None, max_examples=25)
@given(seed=st.integers(0, 10**6), count=st.integers(1, ROOM), data=st.data())
def test_what_is_left_is_the_factor_of_the_others(remove, seed, count, data):
    place = data.draw(st.integers(0, count - 1))
    matrix, right, lower, rows = factored(count, seed)
    remove(lower, rows, count, place)
    kept = np.delete(np.arange(count), place)
    expected, expected_rows = np.eye(ROOM), np.zeros((2, ROOM))
    expected[: count - 1, : count - 1] = np.linalg.cholesky(matrix[np.ix_(kept, kept)])
    expected_rows[:, : count - 1] = np.linalg.solve(expected[: count - 1, : count - 1], right[kept]).T
    assert np.allclose(lower, expected, rtol=1e-8, atol=1e-9)
    assert np.allclose(rows, expected_rows, rtol=1e-7, atol=1e-8)


def test_without_a_compiler_numpy_does_it(monkeypatch):
    def none(source, level):
        raise MisfitError("no C compiler found")

    monkeypatch.setattr(compiled, "build_library", none)
    monkeypatch.setattr(removal, "_compiled", removal._compiled.__wrapped__)
    matrix, _, lower, rows = factored(5, 1)
    removal.remove(lower, rows, 5, 2)
    kept = [0, 1, 3, 4]
    assert np.allclose(lower[:4, :4], np.linalg.cholesky(matrix[np.ix_(kept, kept)]))

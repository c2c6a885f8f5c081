"""Many exponentials at once are those of SciPy, one after the other."""

import numpy as np
import pytest
from scipy import linalg

from orchestrator.models.exponential import exponentials


@pytest.mark.parametrize("size", [1e-9, 0.1, 1.0, 5.0, 40.0])
def test_exponentials_are_those_of_scipy(size: float) -> None:
    matrices = size * np.random.default_rng(1).uniform(-1, 1, (50, 5, 5))

    expected = linalg.expm(matrices)

    assert np.abs(exponentials(matrices) - expected).max() < 1e-12 * np.abs(expected).max()


def test_a_stiff_matrix_among_others_is_as_exact_as_alone() -> None:
    mild, stiff = np.array([[0.0, 1.0], [-1.0, 0.0]]), np.array([[-1e5, 1e5], [0.0, -1.0]])

    found = exponentials(np.array([mild, stiff]))

    turned = [[np.cos(1.0), np.sin(1.0)], [-np.sin(1.0), np.cos(1.0)]]
    assert np.abs(found[0] - turned).max() < 1e-14
    # The fast state follows the slow one, in closed form: exp(-1) 1e5 / (1e5 - 1) of it.
    assert found[1] == pytest.approx(np.array([[0.0, np.exp(-1.0) / (1 - 1e-5)], [0.0, np.exp(-1.0)]]), rel=1e-9)


def test_systems_without_states_have_exponentials_without_entries() -> None:
    assert exponentials(np.zeros((7, 0, 0))).shape == (7, 0, 0)


def test_what_is_no_number_spoils_only_itself() -> None:
    found = exponentials(np.array([[[np.nan]], [[1.0]]]))

    assert np.isnan(found[0]).all() and found[1, 0, 0] == pytest.approx(np.e)

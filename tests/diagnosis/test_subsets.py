"""Best sets of blocks, against brute force and against tables."""

from itertools import combinations

import numpy as np
import pytest
from scipy import stats

from orchestrator.diagnosis.linear.subsets import Library, log_tail, score
from orchestrator.diagnosis.linear.tangent import orthonormal

RANDOM = np.random.default_rng(7)


def library() -> tuple[Library, list[np.ndarray]]:
    bases = [orthonormal(RANDOM.standard_normal((60, k))) for k in (1, 2, 1, 3, 2, 1)]
    return Library(bases, ["a", "b", "c", "d", "d", "e"]), bases


def test_best_pair_is_the_one_that_trying_all_pairs_finds() -> None:
    found, bases = library()
    error = bases[0][:, 0] * 5 + bases[3][:, 1] * 8 + RANDOM.standard_normal(60) * 0.3

    best = found.best(error, 2)[1]

    def gain(blocks: tuple[int, ...]) -> float:
        basis = orthonormal(np.column_stack([bases[k] for k in blocks]))
        return float(np.sum((basis.T @ error) ** 2))

    pairs = {pair: gain(pair) for pair in combinations(range(6), 2) if pair != (3, 4)}
    assert best.blocks == max(pairs, key=pairs.__getitem__) == (0, 3)
    assert best.gain == pytest.approx(pairs[best.blocks])


def test_pair_of_which_no_part_shows_alone_is_found_where_a_beam_goes_past_it() -> None:
    """`a` and `b` are nearly one shape; the error is what they differ by, and six others show more of it alone."""
    common, beside, own = np.eye(40)[:3]
    bases = [common + 0.1 * own, common - 0.1 * own]
    bases += [own + (1.0 + 0.1 * k) * beside + np.eye(40)[10 + k] for k in range(6)]
    found = Library([orthonormal(each[:, None]) for each in bases], list("abcdefgh"))
    error = 20.0 * own

    hidden = found.hidden_pair(error)

    assert hidden is not None
    assert hidden.blocks == (0, 1)
    assert hidden.gain == pytest.approx(400.0)
    assert found.best(error, 2)[1].blocks != (0, 1)
    assert found.hidden_pair(20.0 * orthonormal(bases[0][:, None])[:, 0]) is None


def test_two_points_of_one_candidate_never_stand_together() -> None:
    found, bases = library()
    error = bases[3][:, 0] * 9 + bases[4][:, 0] * 9

    assert all(not {3, 4} <= set(entry.blocks) for entry in found.best(error))


@pytest.mark.parametrize(("gain", "parameters"), [(0.5, 1), (7.8, 3), (60.0, 2), (500.0, 5)])
def test_tail_is_that_of_chi_squared(gain: float, parameters: int) -> None:
    assert log_tail(gain, parameters) == pytest.approx(stats.chi2.logsf(gain, parameters), rel=1e-9)


def test_tail_goes_on_where_numbers_underflow() -> None:
    """With four degrees of freedom the tail is exp(-x/2) (1 + x/2)."""
    assert log_tail(3000.0, 4) == pytest.approx(-1500.0 + np.log(1501.0), abs=1e-5)


def test_score_counts_the_sets_that_were_tried() -> None:
    assert score(10.0, 1, 72, 2) == pytest.approx(-stats.chi2.logsf(10.0, 1) - np.log(72 * 71 / 2))

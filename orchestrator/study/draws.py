"""Thousands of random choices of corrections: what the models gain from 50, 100, ... of them, in the mean and spread.

One draw is an order of all corrections. The leading blocks of one Cholesky factor are the factors of the first 50, 100, ... of
that order, so that a single factorisation serves all sizes; the sizes of a draw are nested, draws are independent.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dtrtrs

from orchestrator.gp.covariance import factor
from orchestrator.study.conditioned import Conditioned, given_bench, size_over_grid
from orchestrator.study.corrections import Corrections
from orchestrator.study.initial import Initial
from orchestrator.study.work import digest

Array = NDArray[Any]
SIZES = (50, 100, 200, 300, 400, 500)
CHUNK = 128  # draws of a task; fixed, so that results do not depend on who does how many
_BATCH = 32


@dataclass(frozen=True, eq=False)
class Problem:
    """All that draws depend on: models of the bench data, corrections, and how far each may be off, (n,) N."""

    initial: Initial
    corrections: Corrections
    deviation: Array


@dataclass(frozen=True, eq=False)
class DrawTask:
    """A chunk of the draws of a problem, whose content hash is `content`."""

    problem: Problem
    content: str
    sizes: tuple[int, ...]
    seed: int
    chunk: int
    count: int

    @property
    def key(self) -> str:
        """Content hash of the task."""
        return digest((self.content, self.sizes, self.seed, self.chunk, self.count))

    def run(self) -> Array:
        """Errors over the grid, (count, sizes, 6), N."""
        given, matrix = _ready(_Same(self.content, self.problem))
        rng = np.random.default_rng([self.seed, 5, self.chunk])
        orders = [rng.permutation(len(matrix))[: max(self.sizes)] for _ in range(self.count)]
        batches = [orders[k : k + _BATCH] for k in range(0, self.count, _BATCH)]
        return np.concatenate([_errors(given, matrix, batch, self.sizes) for batch in batches])


def tasks(problem: Problem, sizes: Sequence[int], draws: int, seed: int) -> list[DrawTask]:
    """All draws in chunks; an order of the chunks is the order of the draws."""
    counts, content = [min(CHUNK, draws - begin) for begin in range(0, draws, CHUNK)], digest(problem)
    return [DrawTask(problem, content, tuple(sizes), seed, chunk, count) for chunk, count in enumerate(counts)]


@dataclass(frozen=True, eq=False)
class _Same:
    """A problem as a key, so that tasks of one problem share what is computed once."""

    key: str
    problem: Problem

    def __hash__(self) -> int:
        return hash(self.key)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Same) and self.key == other.key


@lru_cache(maxsize=2)
def _ready(same: _Same) -> tuple[Conditioned, Array]:
    """The problem given the bench data, and the covariance of all corrections with their noise."""
    given = given_bench(same.problem.initial, same.problem.corrections)
    return given, given.covariance + np.diag(same.problem.deviation**2)


def _errors(given: Conditioned, matrix: Array, orders: Sequence[Array], sizes: Sequence[int]) -> Array:
    """Errors over the grid of some draws, (draws, sizes, 6)."""
    weights = np.zeros((len(orders), len(sizes), 2, len(matrix)))
    for place, order in enumerate(orders):
        weights[place][:, :, order] = _weights(matrix, given.residuals, order, sizes)
    reach = given.reach.reshape(-1, len(matrix))
    moved = (reach @ weights.reshape(-1, len(matrix)).T).reshape(*given.off.shape[:2], len(orders), len(sizes), 2)
    moved += given.off[:, :, None, None, :]
    return size_over_grid(moved.transpose(2, 3, 0, 1, 4))


def _weights(matrix: Array, residuals: Array, order: Array, sizes: Sequence[int]) -> Array:
    """(K_n + noise)^-1 residuals_n of the first n of an order for each size n, (sizes, 2, len(order)), zero behind n."""
    lower = factor(matrix.take(order, axis=0).take(order, axis=1))
    half = dtrtrs(lower, residuals[order], lower=1)[0]
    # Where the right side ends with zeros, so does the solution of the upper triangle: that of the leading block.
    ends = np.zeros((len(order), len(sizes), 2), order="F")
    for place, size in enumerate(sizes):
        ends[:size, place] = half[:size]
    solved = dtrtrs(lower, ends.reshape(len(order), -1), lower=1, trans=1)[0]
    return solved.T.reshape(len(sizes), 2, len(order))

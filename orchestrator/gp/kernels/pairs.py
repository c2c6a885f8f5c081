"""Unordered pairs of points of a set: half of the work of a covariance of points with themselves."""

from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]


class Pairs:
    """All pairs (row, column) with row >= column of points (n, d), column after column: m = n (n + 1) / 2 of them.

    What kernels need of the pairs is computed once, however often hyperparameters change.
    """

    def __init__(self, points: Array) -> None:
        self.points = points
        self.column, self.row = np.triu_indices(len(points))
        self._parts: dict[tuple[int, ...], Pairs] = {}

    @cached_property
    def squares(self) -> Array:
        """Squared differences input by input, (d, m)."""
        found = np.empty((self.points.shape[1], len(self.row)))
        for k, values in enumerate(self.points.T):
            np.subtract(values[self.row], values[self.column], out=found[k])
            found[k] *= found[k]
        return found

    def packed(self, matrix: Array) -> Array:
        """Entries of a symmetric matrix (n, n) in the order of the pairs, (m,)."""
        return matrix[self.row, self.column]

    def part(self, columns: tuple[int, ...]) -> "Pairs":
        """Pairs of the same points, of which only some inputs count."""
        if columns not in self._parts:
            self._parts[columns] = Pairs(self.points[:, list(columns)])
        return self._parts[columns]

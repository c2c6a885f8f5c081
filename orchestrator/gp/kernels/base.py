"""What every kernel offers, with sums and products of kernels.

Each kernel is a formula and its derivatives, in inputs and in its own positive numbers ("values"). The formulas hold for
complex arguments too, so that derivatives can be checked by a complex step.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Self

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


class Kernel(ABC):
    """A positive semidefinite function k(x, y); x is (n, d), y is (m, d), each row a point."""

    @abstractmethod
    def __call__(self, x: Array, y: Array) -> Array:
        """k(x_i, y_j), (n, m)."""

    @abstractmethod
    def diagonal(self, x: Array) -> Array:
        """k(x_i, x_i), (n,)."""

    @abstractmethod
    def input_gradient(self, x: Array, y: Array) -> Array:
        """d k(x_i, y_j) / d x_i, (n, m, d)."""

    @abstractmethod
    def value_gradients(self, x: Array, y: Array) -> Iterator[Array]:
        """d k(x_i, y_j) / d value, (n, m), one after the other in the order of `values`."""

    def on_pairs(self, pairs: Pairs) -> tuple[Array, Callable[[Array], Array]]:
        """k of each pair, (m,), an array of the caller's, and a function: from weights (m,) it makes sum_m weights_m d k_m / d value of each value."""
        x = pairs.points

        def contract(weights: Array) -> Array:
            return np.array([weights @ pairs.packed(gradient) for gradient in self.value_gradients(x, x)])

        return pairs.packed(self(x, x)), contract

    def towards(self, points: Array) -> Callable[[Array], Array]:
        """A quick function of one point x, (d,): k(points_i, x), (n,)."""
        return lambda x: self(points, x[None, :])[:, 0]

    @property
    @abstractmethod
    def names(self) -> tuple[str, ...]:
        """Names of the values, such as `variance`, `length_scales[2]`."""

    @property
    @abstractmethod
    def values(self) -> Array:
        """The numbers to fit, all positive."""

    @abstractmethod
    def with_values(self, values: Array) -> Self:
        """The same kernel with other numbers."""

    def __add__(self, other: "Kernel") -> "Kernel":
        return Sum(self, other)

    def __mul__(self, other: "Kernel") -> "Kernel":
        return Product(self, other)


@dataclass(frozen=True)
class _Pair(Kernel):
    one: Kernel
    other: Kernel

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(f"{part}.{name}" for part in ("one", "other") for name in getattr(self, part).names)

    @property
    def values(self) -> Array:
        return np.concatenate([self.one.values, self.other.values])

    def with_values(self, values: Array) -> Self:
        split = len(self.one.values)
        return replace(self, one=self.one.with_values(values[:split]), other=self.other.with_values(values[split:]))


@dataclass(frozen=True)
class Sum(_Pair):
    """one(x, y) + other(x, y): a sum of two independent functions."""

    def __call__(self, x: Array, y: Array) -> Array:
        return self.one(x, y) + self.other(x, y)

    def diagonal(self, x: Array) -> Array:
        return self.one.diagonal(x) + self.other.diagonal(x)

    def input_gradient(self, x: Array, y: Array) -> Array:
        return self.one.input_gradient(x, y) + self.other.input_gradient(x, y)

    def value_gradients(self, x: Array, y: Array) -> Iterator[Array]:
        yield from self.one.value_gradients(x, y)
        yield from self.other.value_gradients(x, y)

    def on_pairs(self, pairs: Pairs) -> tuple[Array, Callable[[Array], Array]]:
        (one, of_one), (other, of_other) = self.one.on_pairs(pairs), self.other.on_pairs(pairs)
        return one + other, lambda weights: np.concatenate([of_one(weights), of_other(weights)])

    def towards(self, points: Array) -> Callable[[Array], Array]:
        one, other = self.one.towards(points), self.other.towards(points)
        return lambda x: one(x) + other(x)


@dataclass(frozen=True)
class Product(_Pair):
    """one(x, y) * other(x, y): alike only where both say so."""

    def __call__(self, x: Array, y: Array) -> Array:
        return self.one(x, y) * self.other(x, y)

    def diagonal(self, x: Array) -> Array:
        return self.one.diagonal(x) * self.other.diagonal(x)

    def input_gradient(self, x: Array, y: Array) -> Array:
        one, other = self.one(x, y)[:, :, None], self.other(x, y)[:, :, None]
        return self.one.input_gradient(x, y) * other + one * self.other.input_gradient(x, y)

    def value_gradients(self, x: Array, y: Array) -> Iterator[Array]:
        one, other = self.one(x, y), self.other(x, y)
        for slope in self.one.value_gradients(x, y):
            yield slope * other
        for slope in self.other.value_gradients(x, y):
            yield one * slope

    def on_pairs(self, pairs: Pairs) -> tuple[Array, Callable[[Array], Array]]:
        (one, of_one), (other, of_other) = self.one.on_pairs(pairs), self.other.on_pairs(pairs)
        return one * other, lambda weights: np.concatenate([of_one(weights * other), of_other(weights * one)])

    def towards(self, points: Array) -> Callable[[Array], Array]:
        one, other = self.one.towards(points), self.other.towards(points)
        return lambda x: one(x) * other(x)

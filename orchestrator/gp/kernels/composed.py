"""Kernels made of kernels."""

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from fmus.errors import MisfitError
from orchestrator.gp.kernels.base import Array, Kernel
from orchestrator.gp.kernels.pairs import Pairs


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


@dataclass(frozen=True)
class OnInputs(Kernel):
    """kernel(x[columns], y[columns]): a function of some of the inputs, counted from 0."""

    columns: tuple[int, ...]
    kernel: Kernel

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(
            re.sub(r"(\d+)(?=\]$)", lambda k: str(self.columns[int(k[1]) - 1] + 1), n) for n in self.kernel.names
        )

    @property
    def values(self) -> Array:
        return self.kernel.values

    def with_values(self, values: Array) -> Self:
        return replace(self, kernel=self.kernel.with_values(values))

    def _of(self, x: Array) -> Array:
        if max(self.columns) >= x.shape[1] or min(self.columns) < 0:
            raise MisfitError(f"a kernel on the inputs {self.columns} (from 0) got points of {x.shape[1]} inputs")
        return x[:, list(self.columns)]

    def __call__(self, x: Array, y: Array) -> Array:
        return self.kernel(self._of(x), self._of(y))

    def diagonal(self, x: Array) -> Array:
        return self.kernel.diagonal(self._of(x))

    def input_gradient(self, x: Array, y: Array) -> Array:
        part = self.kernel.input_gradient(self._of(x), self._of(y))
        whole = np.zeros((*part.shape[:2], x.shape[1]), dtype=part.dtype)
        whole[:, :, list(self.columns)] = part
        return whole

    def value_gradients(self, x: Array, y: Array) -> Iterator[Array]:
        return self.kernel.value_gradients(self._of(x), self._of(y))

    def on_pairs(self, pairs: Pairs) -> tuple[Array, Callable[[Array], Array]]:
        self._of(pairs.points[:0])
        return self.kernel.on_pairs(pairs.part(self.columns))

    def towards(self, points: Array) -> Callable[[Array], Array]:
        inner, columns = self.kernel.towards(self._of(points)), list(self.columns)
        return lambda x: inner(x[columns])

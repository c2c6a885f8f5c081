"""Covariance functions: what a latent function can look like before any datum is seen.

Each kernel is a formula and its derivatives, in inputs and in its own positive numbers ("values"). The formulas hold for
complex arguments too, so that derivatives can be checked by a complex step.
"""

import re
from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from fmus.errors import MisfitError

Array = NDArray[Any]


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

    def contraction(self, x: Array, weights: Array) -> Array:
        """sum_ij weights_ij d k(x_i, x_j) / d value of each value, for symmetric weights (n, n)."""
        return np.array([np.vdot(weights, gradient) for gradient in self.value_gradients(x, x)])

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
class _Leaf(Kernel):
    """A kernel whose fields are its values, each a number or one number for each input."""

    def __post_init__(self) -> None:
        for field in fields(self):
            given = np.atleast_1d(getattr(self, field.name))
            if given.ndim != 1 or given.size == 0 or not np.all(np.isfinite(given) & (given.real > 0.0)):
                raise MisfitError(
                    f"{type(self).__name__}: {field.name} = {getattr(self, field.name)}; expected positive numbers"
                )

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(name for field in fields(self) for name in self._names_of(field.name))

    @property
    def values(self) -> Array:
        return np.concatenate([np.atleast_1d(getattr(self, field.name)) for field in fields(self)])

    def with_values(self, values: Array) -> Self:
        left = list(values)
        changes: dict[str, Any] = {}
        for field in fields(self):
            now = getattr(self, field.name)
            changes[field.name] = tuple(left.pop(0) for _ in now) if isinstance(now, tuple) else left.pop(0)
        return replace(self, **changes)

    def _names_of(self, name: str) -> list[str]:
        now = getattr(self, name)
        return [f"{name}[{k + 1}]" for k in range(len(now))] if isinstance(now, tuple) else [name]

    def _difference(self, x: Array, y: Array, sizes: Sequence[float]) -> Array:
        _check_inputs(self, x, len(sizes))
        return x[:, None, :] - y[None, :, :]


@dataclass(frozen=True)
class _Radial(_Leaf):
    """variance * g(r2), where r2 = sum_j ((x_j - y_j) / length_scale_j)^2."""

    variance: float
    length_scales: tuple[float, ...]

    @abstractmethod
    def _shape(self, r2: Array) -> tuple[Array, Array]:
        """g and dg/d(r2)."""

    def __call__(self, x: Array, y: Array) -> Array:
        return self.variance * self._shape(self._squared_distance(x, y))[0]

    def _squared_distance(self, x: Array, y: Array) -> Array:
        _check_inputs(self, x, len(self.length_scales))
        # Differences column by column: exact for points close to each other, and no array of n m d numbers.
        total: Array = np.zeros((len(x), len(y)))
        for k, scale in enumerate(self.length_scales):
            difference = np.subtract.outer(x[:, k] / scale, y[:, k] / scale)
            total = total + difference * difference
        return total

    def diagonal(self, x: Array) -> Array:
        _check_inputs(self, x, len(self.length_scales))
        return np.full(x.shape[0], self.variance)

    def input_gradient(self, x: Array, y: Array) -> Array:
        scales = np.array(self.length_scales)
        scaled = self._difference(x, y, self.length_scales) / scales
        slope = self._shape((scaled * scaled).sum(axis=2))[1]
        return 2.0 * self.variance * slope[:, :, None] * scaled / scales

    def value_gradients(self, x: Array, y: Array) -> Iterator[Array]:
        shape, slope = self._shape(self._squared_distance(x, y))
        yield shape
        for k, scale in enumerate(self.length_scales):
            difference = np.subtract.outer(x[:, k] / scale, y[:, k] / scale)
            yield (-2.0 * self.variance / scale) * slope * difference * difference

    def contraction(self, x: Array, weights: Array) -> Array:
        shape, slope = self._shape(self._squared_distance(x, x))
        slope *= weights
        # sum_ij w_ij (x_i - x_j)^2 for all inputs in one product; centred, so that little cancels.
        scaled = (x - x.mean(axis=0)) / np.array(self.length_scales)
        sums = 2.0 * (slope.sum(axis=0) @ (scaled * scaled) - np.einsum("nd,nd->d", scaled, slope @ scaled))
        return np.concatenate([[np.vdot(weights, shape)], -2.0 * self.variance * sums / np.array(self.length_scales)])


@dataclass(frozen=True)
class SquaredExponential(_Radial):
    """variance * exp(-r2 / 2): smooth functions."""

    def _shape(self, r2: Array) -> tuple[Array, Array]:
        shape = np.exp(-0.5 * r2)
        return shape, -0.5 * shape


@dataclass(frozen=True)
class Matern32(_Radial):
    """variance * (1 + a) exp(-a), a = sqrt(3 r2): functions with one derivative."""

    def _shape(self, r2: Array) -> tuple[Array, Array]:
        a = np.sqrt(3.0 * r2)
        decay = np.exp(-a)
        return (1.0 + a) * decay, -1.5 * decay


@dataclass(frozen=True)
class Matern52(_Radial):
    """variance * (1 + a + a^2 / 3) exp(-a), a = sqrt(5 r2): functions with two derivatives."""

    def _shape(self, r2: Array) -> tuple[Array, Array]:
        a = np.sqrt(5.0 * r2)
        decay = np.exp(-a)
        return (1.0 + a + 5.0 / 3.0 * r2) * decay, -5.0 / 6.0 * (1.0 + a) * decay


@dataclass(frozen=True)
class Constant(_Leaf):
    """variance: one unknown number, the same everywhere."""

    variance: float

    def __call__(self, x: Array, y: Array) -> Array:
        return np.full((x.shape[0], y.shape[0]), self.variance)

    def diagonal(self, x: Array) -> Array:
        return np.full(x.shape[0], self.variance)

    def input_gradient(self, x: Array, y: Array) -> Array:
        return np.zeros((x.shape[0], y.shape[0], x.shape[1]))

    def value_gradients(self, x: Array, y: Array) -> Iterator[Array]:
        yield np.ones((x.shape[0], y.shape[0]))


@dataclass(frozen=True)
class Linear(_Leaf):
    """sum_j variance_j x_j y_j: a plane through the origin with slopes of these variances."""

    variances: tuple[float, ...]

    def __call__(self, x: Array, y: Array) -> Array:
        _check_inputs(self, x, len(self.variances))
        return (x * np.array(self.variances)) @ y.T

    def diagonal(self, x: Array) -> Array:
        _check_inputs(self, x, len(self.variances))
        return (x * x) @ np.array(self.variances)

    def input_gradient(self, x: Array, y: Array) -> Array:
        return np.broadcast_to(y * np.array(self.variances), (x.shape[0], *y.shape)).copy()

    def value_gradients(self, x: Array, y: Array) -> Iterator[Array]:
        for k in range(len(self.variances)):
            yield np.outer(x[:, k], y[:, k])


@dataclass(frozen=True)
class Periodic(_Leaf):
    """variance * exp(-2 sum_j sin^2(pi (x_j - y_j) / period_j) / smoothness_j^2); smoothness bears no unit."""

    variance: float
    periods: tuple[float, ...]
    smoothness: tuple[float, ...]

    def __post_init__(self) -> None:
        super().__post_init__()
        if len(self.periods) != len(self.smoothness):
            raise MisfitError(f"Periodic: {len(self.periods)} periods and {len(self.smoothness)} numbers of smoothness")

    def _angles(self, x: Array, y: Array) -> Array:
        return np.pi * self._difference(x, y, self.periods) / np.array(self.periods)

    def __call__(self, x: Array, y: Array) -> Array:
        return self.variance * self._decay(self._angles(x, y))

    def _decay(self, angles: Array) -> Array:
        waves = np.sin(angles) / np.array(self.smoothness)
        return np.exp(-2.0 * (waves * waves).sum(axis=2))

    def diagonal(self, x: Array) -> Array:
        _check_inputs(self, x, len(self.periods))
        return np.full(x.shape[0], self.variance)

    def input_gradient(self, x: Array, y: Array) -> Array:
        angles = self._angles(x, y)
        factors = -2.0 * np.pi / (np.array(self.periods) * np.array(self.smoothness) ** 2)
        return self.variance * self._decay(angles)[:, :, None] * factors * np.sin(2.0 * angles)

    def value_gradients(self, x: Array, y: Array) -> Iterator[Array]:
        angles = self._angles(x, y)
        decay = self._decay(angles)
        yield decay
        for k, (period, scale) in enumerate(zip(self.periods, self.smoothness, strict=True)):
            angle = angles[:, :, k]
            yield self.variance * decay * 2.0 * angle * np.sin(2.0 * angle) / (period * scale**2)
        for k, scale in enumerate(self.smoothness):
            yield self.variance * decay * 4.0 * np.sin(angles[:, :, k]) ** 2 / scale**3


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

    def contraction(self, x: Array, weights: Array) -> Array:
        return np.concatenate([self.one.contraction(x, weights), self.other.contraction(x, weights)])


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

    def contraction(self, x: Array, weights: Array) -> Array:
        one, other = self.one(x, x), self.other(x, x)
        return np.concatenate([self.one.contraction(x, weights * other), self.other.contraction(x, weights * one)])


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

    def contraction(self, x: Array, weights: Array) -> Array:
        return self.kernel.contraction(self._of(x), weights)


def _check_inputs(kernel: Kernel, x: Array, count: int) -> None:
    if x.shape[1] != count:
        raise MisfitError(f"{type(kernel).__name__} is made for {count} inputs, the points have {x.shape[1]}")

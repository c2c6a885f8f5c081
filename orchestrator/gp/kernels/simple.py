"""Kernels of constants, planes and waves."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from fmus.errors import MisfitError
from orchestrator.gp.kernels.base import Array
from orchestrator.gp.kernels.leaf import Leaf, check_inputs


@dataclass(frozen=True)
class Constant(Leaf):
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
class Linear(Leaf):
    """sum_j variance_j x_j y_j: a plane through the origin with slopes of these variances."""

    variances: tuple[float, ...]

    def __call__(self, x: Array, y: Array) -> Array:
        check_inputs(self, x, len(self.variances))
        return (x * np.array(self.variances)) @ y.T

    def diagonal(self, x: Array) -> Array:
        check_inputs(self, x, len(self.variances))
        return (x * x) @ np.array(self.variances)

    def input_gradient(self, x: Array, y: Array) -> Array:
        return np.broadcast_to(y * np.array(self.variances), (x.shape[0], *y.shape)).copy()

    def value_gradients(self, x: Array, y: Array) -> Iterator[Array]:
        for k in range(len(self.variances)):
            yield np.outer(x[:, k], y[:, k])


@dataclass(frozen=True)
class Periodic(Leaf):
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
        check_inputs(self, x, len(self.periods))
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

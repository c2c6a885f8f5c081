"""Kernels of a distance that is scaled input by input."""

from abc import abstractmethod
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from orchestrator.gp.kernels.base import Array, Leaf, check_inputs


@dataclass(frozen=True)
class _Radial(Leaf):
    """variance * g(r2), where r2 = sum_j ((x_j - y_j) / length_scale_j)^2."""

    variance: float
    length_scales: tuple[float, ...]

    @abstractmethod
    def _shape(self, r2: Array) -> tuple[Array, Array]:
        """g and dg/d(r2)."""

    def __call__(self, x: Array, y: Array) -> Array:
        return self.variance * self._shape(self._squared_distance(x, y))[0]

    def _squared_distance(self, x: Array, y: Array) -> Array:
        check_inputs(self, x, len(self.length_scales))
        # Differences column by column: exact for points close to each other, and no array of n m d numbers.
        total: Array | None = None
        for k, scale in enumerate(self.length_scales):
            difference = np.subtract.outer(x[:, k] / scale, y[:, k] / scale)
            difference *= difference
            total = difference if total is None else total + difference
        assert total is not None
        return total

    def diagonal(self, x: Array) -> Array:
        check_inputs(self, x, len(self.length_scales))
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

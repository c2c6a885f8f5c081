"""Kernels of a distance that is scaled input by input."""

from abc import abstractmethod
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from scipy.spatial.distance import cdist

from orchestrator.gp.kernels.base import Array, Pairs
from orchestrator.gp.kernels.leaf import Leaf, check_inputs


@dataclass(frozen=True)
class _Radial(Leaf):
    """variance * g(r2), where r2 = sum_j ((x_j - y_j) / length_scale_j)^2."""

    variance: float
    length_scales: tuple[float, ...]

    @abstractmethod
    def _shape(self, r2: Array) -> Array:
        """g of r2."""

    @abstractmethod
    def _slope(self, r2: Array, shape: Array) -> Array:
        """dg/d(r2) of r2 and g."""

    def __call__(self, x: Array, y: Array) -> Array:
        shape = self._shape(self._squared_distance(x, y))
        shape *= self.variance
        return shape

    def _squared_distance(self, x: Array, y: Array) -> Array:
        check_inputs(self, x, len(self.length_scales))
        # By differences: exact for points close to each other, and no array of n m d numbers.
        scales = np.array(self.length_scales)
        one, other = x / scales, y / scales
        if np.iscomplexobj(one) or np.iscomplexobj(other):  # derivatives by complex steps
            return np.asarray(sum(np.subtract.outer(a, b) ** 2 for a, b in zip(one.T, other.T, strict=True)))
        return np.asarray(cdist(one, other, "sqeuclidean"))

    def diagonal(self, x: Array) -> Array:
        check_inputs(self, x, len(self.length_scales))
        return np.full(x.shape[0], self.variance)

    def input_gradient(self, x: Array, y: Array) -> Array:
        scales = np.array(self.length_scales)
        scaled = self._difference(x, y, self.length_scales) / scales
        r2 = (scaled * scaled).sum(axis=2)
        slope = self._slope(r2, self._shape(r2))
        return 2.0 * self.variance * slope[:, :, None] * scaled / scales

    def value_gradients(self, x: Array, y: Array) -> Iterator[Array]:
        r2 = self._squared_distance(x, y)
        shape = self._shape(r2)
        yield shape
        slope = self._slope(r2, shape)
        for k, scale in enumerate(self.length_scales):
            difference = np.subtract.outer(x[:, k] / scale, y[:, k] / scale)
            yield (-2.0 * self.variance / scale) * slope * difference * difference

    def on_pairs(self, pairs: Pairs) -> tuple[Array, Callable[[Array], Array]]:
        check_inputs(self, pairs.points, len(self.length_scales))
        scales = np.array(self.length_scales)
        r2 = (1.0 / scales**2) @ pairs.squares
        shape = self._shape(r2)

        def contract(weights: Array) -> Array:
            slope = self._slope(r2, shape)
            slope *= weights
            return np.append(weights @ shape, (-2.0 * self.variance / scales**3) * (pairs.squares @ slope))

        return self.variance * shape, contract

    def towards(self, points: Array) -> Callable[[Array], Array]:
        check_inputs(self, points, len(self.length_scales))
        per_scale = 1.0 / np.array(self.length_scales)
        scaled, ones = np.ascontiguousarray(points.T * per_scale[:, None]), np.ones(len(per_scale))

        def seen_from(x: Array) -> Array:
            squares = scaled - (x * per_scale)[:, None]
            squares *= squares
            shape = self._shape(ones @ squares)
            shape *= self.variance
            return shape

        return seen_from


@dataclass(frozen=True)
class SquaredExponential(_Radial):
    """variance * exp(-r2 / 2): smooth functions."""

    def _shape(self, r2: Array) -> Array:
        half = -0.5 * r2
        return np.exp(half, out=half) if isinstance(half, np.ndarray) else np.exp(half)

    def _slope(self, r2: Array, shape: Array) -> Array:
        return -0.5 * shape


@dataclass(frozen=True)
class Matern32(_Radial):
    """variance * (1 + a) exp(-a), a = sqrt(3 r2): functions with one derivative."""

    def _shape(self, r2: Array) -> Array:
        a = np.sqrt(3.0 * r2)
        return (1.0 + a) * np.exp(-a)

    def _slope(self, r2: Array, shape: Array) -> Array:
        return -1.5 * shape / (1.0 + np.sqrt(3.0 * r2))


@dataclass(frozen=True)
class Matern52(_Radial):
    """variance * (1 + a + a^2 / 3) exp(-a), a = sqrt(5 r2): functions with two derivatives."""

    def _shape(self, r2: Array) -> Array:
        a = np.sqrt(5.0 * r2)
        return (1.0 + a + 5.0 / 3.0 * r2) * np.exp(-a)

    def _slope(self, r2: Array, shape: Array) -> Array:
        a = np.sqrt(5.0 * r2)
        return -5.0 / 6.0 * (1.0 + a) * shape / (1.0 + a + 5.0 / 3.0 * r2)

"""A kernel on some of the inputs."""

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from fmus.errors import MisfitError
from orchestrator.gp.kernels.base import Array, Kernel, Pairs


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

"""What every kernel offers, and what those have in common whose fields are their values.

Each kernel is a formula and its derivatives, in inputs and in its own positive numbers ("values"). The formulas hold for
complex arguments too, so that derivatives can be checked by a complex step.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from fmus.errors import MisfitError
from orchestrator.gp.kernels.pairs import Pairs

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

    def on_pairs(self, pairs: Pairs) -> tuple[Array, Callable[[Array], Array]]:
        """k of each pair, (m,), and a function: from weights (m,) it makes sum_m weights_m d k_m / d value of each value."""
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
        from orchestrator.gp.kernels.composed import Sum

        return Sum(self, other)

    def __mul__(self, other: "Kernel") -> "Kernel":
        from orchestrator.gp.kernels.composed import Product

        return Product(self, other)


@dataclass(frozen=True)
class Leaf(Kernel):
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
        check_inputs(self, x, len(sizes))
        return x[:, None, :] - y[None, :, :]


def check_inputs(kernel: Kernel, x: Array, count: int) -> None:
    """Refuse points of another number of inputs."""
    if x.shape[1] != count:
        raise MisfitError(f"{type(kernel).__name__} is made for {count} inputs, the points have {x.shape[1]}")

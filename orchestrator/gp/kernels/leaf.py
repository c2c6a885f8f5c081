"""Kernels whose fields are their values."""

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import Any, Self

import numpy as np

from fmus.errors import MisfitError
from orchestrator.gp.kernels.base import Array, Kernel


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
    """Refuse points of another number of inputs.

    Args:
        kernel: the kernel, for the message.
        x: points (n, d).
        count: the d that it is made for.

    Raises:
        MisfitError: if there are others.
    """
    if x.shape[1] != count:
        raise MisfitError(f"{type(kernel).__name__} is made for {count} inputs, the points have {x.shape[1]}")

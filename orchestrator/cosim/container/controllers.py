"""The matrices of a linear controller for the runtime of a container."""

from collections.abc import Callable, Iterable
from typing import Any

import numpy as np

from orchestrator.cosim.kinds.controller import LinearController


def linear_data(
    controller: LinearController, size: float, array: Callable[[str, Iterable[Any]], str]
) -> dict[str, Any]:
    """The fields of `LinearData`; `array` writes numbers down and gives their name, `size` s is the step to be prepared."""
    a, b, c, d = controller.matrices
    fields: dict[str, Any] = {"n": a.shape[0], "m": b.shape[1], "p": c.shape[0]}
    fields |= {name: array("double", np.ravel(matrix)) for name, matrix in zip("abcd", (a, b, c, d), strict=True)}
    if controller.sample_time:
        return fields | {"sample_time": repr(controller.sample_time)}
    exact = controller.exact_step(size)
    names = ("exact_a", "exact_b")
    return (
        fields
        | {"exact_size": repr(size)}
        | {name: array("double", np.ravel(matrix)) for name, matrix in zip(names, exact, strict=True)}
    )

"""Calls of FMI 3.0 that FMPy makes for scalars only."""

from collections.abc import Sequence
from ctypes import c_double, c_uint
from math import prod
from typing import Any

from fmpy.fmi3 import FMU3Slave  # type: ignore[import-untyped]


def size(variable: Any) -> int:
    """Number of elements of a variable of a model description."""
    return prod(int(dimension.start) for dimension in variable.dimensions)


def derivative(
    slave: FMU3Slave, function: str, rows: Sequence[int], columns: Sequence[int], seed: Sequence[float], n_results: int
) -> list[float]:
    """Directional or adjoint derivative; seed and result count elements, rows and columns are references."""
    result = (c_double * n_results)()
    given = (c_double * len(seed))(*seed)
    unknowns, knowns = (c_uint * len(rows))(*rows), (c_uint * len(columns))(*columns)
    call = getattr(slave, function)
    call(slave.component, unknowns, len(rows), knowns, len(columns), given, len(seed), result, n_results)
    return list(result)

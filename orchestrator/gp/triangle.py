"""Triangular factors by BLAS and LAPACK, where the usual routines leave time.

In one thread: with two, factorisations of some hundred rows take up to 100 times as long.
"""

from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.blas import dtrmm, dtrsm, dtrsv
from scipy.linalg.lapack import dlauum, dtrtri
from threadpoolctl import ThreadpoolController

Array = NDArray[Any]
# Below this size LAPACK inverts a triangle in its own way; above it products of halves are faster (by a third at 700).
_BLOCK = 48
# So many right sides are solved one by one in less time than together.
_FEW = 4


def solve_lower(lower: Array, right: Array) -> Array:
    """Solve lower lower' x = right, (n, p)."""
    return solve_transposed(lower, solve_half(lower, right))


def solve_half(lower: Array, right: Array) -> Array:
    """Solve lower x = right, (n, p)."""
    return _solve(lower, right, 0)


def solve_transposed(lower: Array, right: Array) -> Array:
    """Solve lower' x = right, (n, p)."""
    return _solve(lower, right, 1)


def inverse_from_factor(lower: Array) -> Array:
    """Lower triangle of the inverse of lower lower'; `lower` is in column order and is overwritten."""
    _invert(lower, 0, len(lower))
    return dlauum(lower, lower=1, overwrite_c=1)[0]


def _solve(lower: Array, right: Array, transposed: int) -> Array:
    if right.shape[1] > _FEW:
        return dtrsm(1.0, lower, right, lower=1, trans_a=transposed)
    return np.column_stack([dtrsv(lower, column, lower=1, trans=transposed) for column in right.T])


def _invert(lower: Array, begin: int, end: int) -> None:
    """Replace a diagonal block by its inverse: that of [A 0; B C] is [A^-1 0; -C^-1 B A^-1 C^-1]."""
    if end - begin <= _BLOCK:
        lower[begin:end, begin:end] = dtrtri(lower[begin:end, begin:end], lower=1)[0]
        return
    middle = (begin + end) // 2
    first, second = slice(begin, middle), slice(middle, end)
    _invert(lower, begin, middle)
    _invert(lower, middle, end)
    product = dtrmm(-1.0, lower[first, first], lower[second, first], side=1, lower=1)
    lower[second, first] = dtrmm(1.0, lower[second, second], product, lower=1, overwrite_b=1)


def one_thread() -> Any:
    """A context in which BLAS runs in one thread; it takes 20 us."""
    return _blas().limit(limits=1, user_api="blas")


@cache
def _blas() -> ThreadpoolController:
    return ThreadpoolController()

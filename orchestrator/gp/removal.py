"""Taking a datum out of a Cholesky factor in place: in C where there is a compiler, otherwise by NumPy."""

import ctypes
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.blas import dtrsv

from fmus.errors import MisfitError

Array = NDArray[Any]
_SOURCE = Path(__file__).with_name("forget.c")


def remove(lower: Array, half: Array, count: int, place: int) -> None:
    """Take row and column `place` out of a factor of `count` rows; those behind move up, a one takes the last diagonal place.

    Args:
        lower: (room, room) in column order, ones on the diagonal behind `count`.
        half: (components, room): inv(lower) times residuals. Its rows are rows of the factor, too, and change with it.
    """
    compiled = _compiled()
    if compiled is None:
        remove_by_numpy(lower, half, count, place)
        return
    work = np.empty(len(lower))
    compiled(*(each.ctypes.data for each in (lower, half, work)), len(lower), count, place, len(half))


def remove_by_numpy(lower: Array, half: Array, count: int, place: int) -> None:
    """The same without a compiler.

    The block behind the place, L, becomes the factor of L L' + l l' (l its column). That is L M with M M' = I + v v' and
    v = inv(L) l, whose factor is known in closed form: with s_j = 1 + sum_{k<=j} v_k^2, M_jj = sqrt(s_j / s_{j-1}) and
    M_kj = v_k v_j / sqrt(s_j s_{j-1}) below it (Gill, Golub, Murray and Saunders 1974).

    Args:
        lower: (room, room), as for `remove`; changed in place.
        half: (components, room); changed in place, too.
        count: number of rows before.
        place: the row that goes, from 0.
    """
    n = count
    block = lower[place + 1 : n, place + 1 : n].copy(order="F")
    rows = half[:, place + 1 : n].copy()
    if len(block):
        v = dtrsv(block, lower[place + 1 : n, place], lower=1)
        s = np.concatenate([[1.0], 1.0 + np.cumsum(v * v)])
        on, below = np.sqrt(s[1:] / s[:-1]), v / np.sqrt(s[1:] * s[:-1])
        block = np.tril(block * on + _behind(block * v) * below)
        # A row of residuals h with the entry t in the column that goes: h M + (t - h v) v' M / s, where v' M = s v /
        # sqrt(s_j s_{j-1}).
        rows = rows * on + (_behind(rows * v) + (half[:, [place]] - (rows @ v)[:, None])) * below
    lower[place : n - 1, :place] = lower[place + 1 : n, :place]
    lower[place : n - 1, place : n - 1] = block
    half[:, place : n - 1] = rows
    lower[n - 1, :n], half[:, n - 1] = 0.0, 0.0
    lower[n - 1, n - 1] = 1.0


def _behind(terms: Array) -> Array:
    """Sums over the columns behind each column."""
    found = np.zeros_like(terms)
    found[:, :-1] = np.cumsum(terms[:, :0:-1], axis=1)[:, ::-1]
    return found


@cache
def _compiled() -> Callable[..., None] | None:
    from orchestrator.models.compiled import FOR_LOOPS, build_library

    try:
        function = ctypes.CDLL(str(build_library(_SOURCE.read_text(), level=FOR_LOOPS))).misfit_forget
    except (MisfitError, OSError):
        return None
    function.argtypes = [ctypes.c_void_p] * 3 + [ctypes.c_longlong] * 4
    function.restype = None
    return function

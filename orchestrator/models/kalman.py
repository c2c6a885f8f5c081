"""What a series of measurements says about the states of a linear time-varying system: Kalman filter and smoother."""

import ctypes
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

from fmus.errors import MisfitError
from orchestrator.models.compiled import FOR_LOOPS, build_library

_SOURCE = Path(__file__).with_name("kalman.c")


@dataclass(frozen=True, eq=False)
class LinearSystem:
    """x(k+1) = step(k) x(k) + offset(k) + v(k), y(k) = show(k) x(k) + shift(k) + e(k), both noises white and normal.

    `step` is (n - 1, m, m), `offset` (n - 1, m), `disturbance` the covariance of v, (n - 1, m, m); `show` is (n, ny,
    m), `shift` (n, ny), `noise` the variance of e, (ny,), channels independent. The first state has `mean` (m,) and
    `covariance` (m, m).
    """

    step: np.ndarray
    offset: np.ndarray
    disturbance: np.ndarray
    show: np.ndarray
    shift: np.ndarray
    noise: np.ndarray
    mean: np.ndarray
    covariance: np.ndarray


@dataclass(frozen=True, eq=False)
class States:
    """Means (n, m) and covariances (n, m, m) of the states, and the log likelihood of what was measured."""

    means: np.ndarray
    covariances: np.ndarray
    log_likelihood: float


@dataclass(frozen=True, eq=False)
class _Filtered:
    """States up to each instant, and means and covariances ahead of each measurement but the first."""

    states: States
    ahead_means: np.ndarray
    ahead_covariances: np.ndarray


def filtered(system: LinearSystem, measured: np.ndarray) -> States:
    """States given the measurements (n, ny) up to each of them."""
    return _forward(system, measured).states


def smoothed(system: LinearSystem, measured: np.ndarray) -> States:
    """States given all measurements (n, ny), by Rauch, Tung and Striebel (AIAA J. 3, 1965)."""
    forward = _forward(system, measured)
    found = forward.states
    means, covariances = found.means.copy(), found.covariances.copy()
    shared = system.step @ found.covariances[:-1]
    gains = np.linalg.solve(forward.ahead_covariances, shared).transpose(0, 2, 1)
    for k in range(len(means) - 2, -1, -1):
        means[k] += gains[k] @ (means[k + 1] - forward.ahead_means[k])
        covariances[k] += gains[k] @ (covariances[k + 1] - forward.ahead_covariances[k]) @ gains[k].T
    return States(means, covariances, found.log_likelihood)


def _forward(system: LinearSystem, measured: np.ndarray) -> _Filtered:
    n, m, ny = len(measured), len(system.mean), measured.shape[1]
    means, covariances = np.empty((n, m)), np.empty((n, m, m))
    means[0], covariances[0] = system.mean, system.covariance
    ahead_means, ahead_covariances = np.empty((n - 1, m)), np.empty((n - 1, m, m))
    given = (system.step, system.offset, system.disturbance, system.show, measured - system.shift, system.noise)
    keep = [np.array([n, m, ny], dtype=np.longlong), *(np.ascontiguousarray(part, dtype=float) for part in given)]
    keep += [means, covariances, ahead_means, ahead_covariances, np.empty(2 * m * m + m)]
    total = _filter()(*(part.ctypes.data for part in keep))
    return _Filtered(States(means, covariances, total), ahead_means, ahead_covariances)


@cache
def _filter() -> Callable[..., float]:
    """The compiled filter; models are compiled, too, so that a compiler is there."""
    try:
        function = ctypes.CDLL(str(build_library(_SOURCE.read_text(), level=FOR_LOOPS))).misfit_filter
    except OSError as error:
        raise MisfitError(f"the compiled Kalman filter cannot be loaded: {error}") from error
    function.argtypes, function.restype = [ctypes.c_void_p] * 12, ctypes.c_double
    return function

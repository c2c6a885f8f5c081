"""What a series of measurements says about the states of a linear time-varying system: Kalman filter and smoother."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, eq=False)
class LinearSystem:
    """x(k+1) = step(k) x(k) + offset(k) + v(k), y(k) = show(k) x(k) + shift(k) + e(k), both noises white and normal.

    `step` is (n - 1, m, m), `offset` (n - 1, m), `disturbance` the covariance of v, (n - 1, m, m); `show` is (n, ny, m), `shift` (n, ny),
    `noise` the variance of e, (ny,), channels independent. The first state has `mean` (m,) and `covariance` (m, m).
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


def filtered(system: LinearSystem, measured: np.ndarray) -> States:
    """States given the measurements (n, ny) up to each of them."""
    return _forward(system, measured)[0]


def smoothed(system: LinearSystem, measured: np.ndarray) -> States:
    """States given all measurements (n, ny), by Rauch, Tung and Striebel (AIAA J. 3, 1965)."""
    found, ahead = _forward(system, measured)
    means, covariances = found.means.copy(), found.covariances.copy()
    for k in range(len(means) - 2, -1, -1):
        mean, covariance = ahead[k]
        gain = np.linalg.solve(covariance, system.step[k] @ found.covariances[k]).T
        means[k] += gain @ (means[k + 1] - mean)
        covariances[k] += gain @ (covariances[k + 1] - covariance) @ gain.T
    return States(means, covariances, found.log_likelihood)


def _forward(system: LinearSystem, measured: np.ndarray) -> tuple[States, list[tuple[np.ndarray, np.ndarray]]]:
    n, m = len(measured), len(system.mean)
    means, covariances = np.empty((n, m)), np.empty((n, m, m))
    ahead: list[tuple[np.ndarray, np.ndarray]] = []
    mean, covariance, total = system.mean, system.covariance, 0.0
    for k in range(n):
        if k:
            step = system.step[k - 1]
            mean = step @ mean + system.offset[k - 1]
            covariance = step @ covariance @ step.T + system.disturbance[k - 1]
            ahead.append((mean, covariance))
        channels = zip(system.show[k], measured[k] - system.shift[k], system.noise, strict=True)
        mean, covariance, gained = _seen(mean, covariance, channels)
        total += gained
        means[k], covariances[k] = mean, covariance
    return States(means, covariances, total), ahead


def _seen(
    mean: np.ndarray, covariance: np.ndarray, channels: Iterable[tuple[np.ndarray, float, float]]
) -> tuple[np.ndarray, np.ndarray, float]:
    """Mean and covariance after measurements of one instant, one after the other, and their log likelihood."""
    total = 0.0
    for show, value, noise in channels:
        shared = covariance @ show
        variance = float(show @ shared) + float(noise)
        surprise = float(value - show @ mean)
        mean = mean + shared * (surprise / variance)
        covariance = covariance - np.outer(shared, shared) / variance
        total -= 0.5 * (surprise * surprise / variance + np.log(2.0 * np.pi * variance))
    return mean, covariance, total

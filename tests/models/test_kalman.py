"""The Kalman smoother against conditioning all states at once."""

import numpy as np
from scipy.stats import multivariate_normal

from orchestrator.models.kalman import LinearSystem, filtered, smoothed

N, M, NY = 6, 3, 2


def varying(seed: int) -> tuple[LinearSystem, np.ndarray]:
    rng = np.random.default_rng(seed)
    half = rng.normal(size=(N, M, M))
    positive = half @ half.transpose(0, 2, 1)
    system = LinearSystem(
        rng.normal(size=(N - 1, M, M)),
        rng.normal(size=(N - 1, M)),
        positive[1:],
        rng.normal(size=(N, NY, M)),
        rng.normal(size=(N, NY)),
        np.array([0.1, 0.4]),
        rng.normal(size=M),
        positive[0],
    )
    return system, rng.normal(size=(N, NY))


def dense(system: LinearSystem) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Mean and covariance of all states one after the other, and what shows them."""
    mean, covariance = [system.mean], np.zeros((N * M, N * M))
    covariance[:M, :M] = system.covariance
    for k in range(N - 1):
        now, then = slice(k * M, (k + 1) * M), slice((k + 1) * M, (k + 2) * M)
        mean.append(system.step[k] @ mean[-1] + system.offset[k])
        covariance[then, : (k + 1) * M] = system.step[k] @ covariance[now, : (k + 1) * M]
        covariance[: (k + 1) * M, then] = covariance[then, : (k + 1) * M].T
        covariance[then, then] = system.step[k] @ covariance[now, now] @ system.step[k].T + system.disturbance[k]
    show = np.zeros((N * NY, N * M))
    for k in range(N):
        show[k * NY : (k + 1) * NY, k * M : (k + 1) * M] = system.show[k]
    return np.concatenate(mean), covariance, show, np.diag(np.tile(system.noise, N))


def test_smoothed_states_are_those_given_all_measurements_at_once():
    system, measured = varying(0)
    mean, covariance, show, noise = dense(system)
    gain = covariance @ show.T @ np.linalg.inv(show @ covariance @ show.T + noise)
    expected = mean + gain @ ((measured - system.shift).ravel() - show @ mean)
    left = covariance - gain @ show @ covariance
    found = smoothed(system, measured)
    assert np.allclose(found.means.ravel(), expected, rtol=1e-8, atol=1e-9)
    for k in range(N):
        block = left[k * M : (k + 1) * M, k * M : (k + 1) * M]
        assert np.allclose(found.covariances[k], block, rtol=1e-7, atol=1e-8)


def test_the_likelihood_is_the_density_of_all_measurements():
    system, measured = varying(1)
    mean, covariance, show, noise = dense(system)
    density = multivariate_normal(show @ mean + system.shift.ravel(), show @ covariance @ show.T + noise)
    assert np.isclose(filtered(system, measured).log_likelihood, density.logpdf(measured.ravel()), rtol=1e-10)

"""Posteriors of many data on few of their rows (inducing points), with a bound on what that costs.

Titsias, Variational Learning of Inducing Variables in Sparse Gaussian Processes (2009): the best posterior that knows
the functions by the values of m rows alone. Data are read in parts, so that memory is that of m rows and a part, and
time grows with their number.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular
from scipy.linalg.lapack import dpotrf

from fmus.errors import MisfitError
from orchestrator.gp.covariance import Latents, covariance, known, variances
from orchestrator.gp.observations import Observation, Rows, stacked
from orchestrator.gp.posterior import Posterior, condition, residuals_and_noise
from orchestrator.gp.triangle import one_thread

Array = NDArray[Any]
# Up to so many data conditioning is exact by itself; more are taken in through so many rows.
EXACT, ROWS = 5000, 500
# Rows are chosen among so many; data are read so many at a time.
_CANDIDATES, _PART = 4000, 4096
# A candidate of which less than this share of its variance is new cannot be told from those chosen.
_NEW, _ROUNDING = 1e-8, 1e-12


@dataclass(frozen=True, eq=False)
class Sparse:
    """A posterior on chosen rows, to be used as any other, and what the choice may cost.

    `evidence` is a lower bound on the logarithm of the marginal likelihood; what it lacks is the divergence from the
    exact posterior. `lost` bounds that, in nats, on average over data that the functions with their noise make (Burt,
    Rasmussen and van der Wilk 2019: between half of it and it). With `lost` far below 1 the posterior is as good as
    exact; more rows make it smaller.
    """

    posterior: Posterior
    evidence: float
    lost: float


def conditioned(latents: Latents, observations: Sequence[Observation]) -> Posterior:
    """The posterior after all observations: exact up to `EXACT` data, of more on `ROWS` of their rows.

    Raises:
        MisfitError: as `condition`, or as `condition_sparse`.
    """
    if sum(len(each.inputs) for each in observations) <= EXACT:
        return condition(latents, observations)
    return condition_sparse(latents, observations, ROWS).posterior


def condition_sparse(latents: Latents, observations: Sequence[Observation], count: int = 300, seed: int = 0) -> Sparse:
    """Condition on all observations, on at most `count` of their rows.

    Rows are chosen greedily: each time the one of which the others leave most open, in standard deviations of its
    noise, among 4000 drawn at random.

    Args:
        latents: the latent functions.
        observations: the data.
        count: rows that are kept, at most.
        seed: of the draw of candidates.

    Raises:
        MisfitError: if an observation names an unknown latent function or has no noise.
    """
    rows = stacked(observations)
    known(latents, rows.coefficients)
    residuals, noise = residuals_and_noise(latents, rows, observations)
    if not np.all(noise > 0.0):
        raise MisfitError("observations without noise; give standard deviations above 0 to condition on many of them")
    with one_thread():
        drawn = np.random.default_rng(seed).permutation(len(noise))[:_CANDIDATES]
        chosen = drawn[_most_open(latents, _part(rows, drawn), noise[drawn], count)]
        kept = _part(rows, chosen)
        lower = np.linalg.cholesky(_apart(covariance(latents, kept, kept)))
        told, right, open_, logs, square = _summed(latents, rows, residuals, noise, kept, lower)
        return _posterior(latents, kept, lower, told, right, open_, logs, square)


def _summed(
    latents: Latents, rows: Rows, residuals: Array, noise: Array, kept: Rows, lower: Array
) -> tuple[Array, Array, float, float, float]:
    """Sums over all data: phi phi'/s^2 (m, m), phi r'/s^2 (m, p), what the rows leave open by s^2, log s^2, and
    r^2/s^2; phi whitened."""
    m, p = len(lower), residuals.shape[1]
    told, right, left = np.zeros((m, m)), np.zeros((m, p)), 0.0
    for begin in range(0, len(noise), _PART):
        some = np.arange(begin, min(begin + _PART, len(noise)))
        new = _part(rows, some)
        phi = solve_triangular(lower, covariance(latents, kept, new), lower=True, check_finite=False)
        left += float(np.sum(np.maximum(variances(latents, new) - np.einsum("ij,ij->j", phi, phi), 0.0) / noise[some]))
        phi /= np.sqrt(noise[some])
        told += phi @ phi.T
        right += phi @ (residuals[some] / np.sqrt(noise[some])[:, None])
    logs = float(np.sum(np.log(2.0 * np.pi * noise)))
    return told, right, left, logs, float(np.sum(residuals**2 / noise[:, None]))


def _posterior(
    latents: Latents, kept: Rows, lower: Array, told: Array, right: Array, left: float, logs: float, square: float
) -> Sparse:
    m, p = right.shape
    factor = np.linalg.cholesky(np.eye(m) + told)
    half = solve_triangular(factor, right, lower=True)
    mean = solve_triangular(factor, half, lower=True, trans="T")
    weights = solve_triangular(lower, mean, lower=True, trans="T")
    # I - inv(I + told) = U U' with U upper triangular; variances are k** - |inv(lower inv(U)') k|^2.
    inverse = solve_triangular(factor, np.eye(m), lower=True)
    explained = (np.eye(m) * (1.0 + _ROUNDING) - inverse.T @ inverse)[::-1, ::-1]
    reversed_half, failed = dpotrf(explained, lower=1, clean=1)
    if failed:
        values, vectors = np.linalg.eigh(explained)
        reversed_half = np.linalg.cholesky((vectors * np.maximum(values, 2.0 * m * _ROUNDING)) @ vectors.T)
    upper = reversed_half[::-1, ::-1]
    whole = np.asfortranarray(solve_triangular(upper, lower.T, lower=False).T)
    evidence = -0.5 * (
        p * (logs + 2.0 * float(np.log(np.diagonal(factor)).sum()) + left) + square - float(np.sum(half**2))
    )
    return Sparse(Posterior(latents, kept, whole, weights), evidence, p * left)


def _most_open(latents: Latents, rows: Rows, noise: Array, count: int) -> NDArray[np.intp]:
    """Rows by a partial Cholesky factorisation with pivots."""
    open_ = variances(latents, rows)
    first, factors = open_.copy(), np.zeros((min(count, len(noise)), len(noise)))
    chosen: list[int] = []
    for k in range(len(factors)):
        best = int(np.argmax(open_ / noise))
        if not open_[best] > _NEW * first[best]:
            break
        row = covariance(latents, _part(rows, np.array([best])), rows)[0] - factors[:k, best] @ factors[:k]
        factors[k] = row / np.sqrt(open_[best])
        open_ = np.maximum(open_ - factors[k] ** 2, 0.0)
        open_[best] = 0.0
        chosen.append(best)
    return np.array(chosen, dtype=np.intp)


def _apart(matrix: Array) -> Array:
    matrix[np.diag_indices_from(matrix)] *= 1.0 + _NEW
    return matrix


def _part(rows: Rows, chosen: Array) -> Rows:
    return Rows(rows.inputs[chosen], {name: a[chosen] for name, a in rows.coefficients.items()})

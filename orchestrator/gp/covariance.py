"""Covariances of rows of observations, and factors of them that are known to be sound."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dpotrf

from fmus.errors import MisfitError
from orchestrator.gp.kernels import Kernel
from orchestrator.gp.observations import Rows
from orchestrator.measurements.wording import listed

Array = NDArray[Any]


@dataclass(frozen=True)
class Latent:
    """A function that nobody sees directly: its kernel, and what is expected of it before any datum (0 if absent).

    `mean` maps inputs (n, d) to (n,) or (n, p), such as the prediction of the current physics model; `mean_gradient` to
    (n, p, d).
    """

    kernel: Kernel
    mean: Callable[[Array], Array] | None = None
    mean_gradient: Callable[[Array], Array] | None = None


Latents = Mapping[str, Latent]


def known(latents: Latents, names: Mapping[str, Any]) -> None:
    """Refuse names of latent functions that are not there."""
    for name in names:
        if name not in latents:
            raise MisfitError(f"there is no latent function {name!r}; there are {listed(latents)}")


def covariance(latents: Latents, one: Rows, other: Rows) -> Array:
    """sum_f a_f,i k_f(x_i, y_j) b_f,j of rows with coefficients a and b, (n, m); latent functions are independent.

    Args:
        latents: the latent functions.
        one: n rows.
        other: m rows.
    """
    total = np.zeros((len(one.inputs), len(other.inputs)))
    for name, a in one.coefficients.items():  # in their order, so that sums are the same bits in every process
        b = other.coefficients.get(name, np.zeros(0))
        i, j = np.flatnonzero(a), np.flatnonzero(b)
        if i.size and j.size:
            block = latents[name].kernel(one.inputs[i], other.inputs[j])
            if np.iscomplexobj(block) and not np.iscomplexobj(total):
                total = total.astype(complex)
            block *= a[i, None]
            block *= b[j]
            if block.shape == total.shape:
                total += block
            else:
                total[np.ix_(i, j)] += block
    return total


def variances(latents: Latents, rows: Rows) -> Array:
    """Diagonal of the covariance of rows with themselves, (n,)."""
    total = np.zeros(len(rows.inputs))
    for name, a in rows.coefficients.items():
        total += a * a * latents[name].kernel.diagonal(rows.inputs)
    return total


def mean(latents: Latents, rows: Rows, components: int) -> Array:
    """Prior mean of rows, (n, components).

    Args:
        latents: the latent functions.
        rows: n rows.
        components: number of components of each function.
    """
    total = np.zeros((len(rows.inputs), components))
    for name, a in rows.coefficients.items():
        function = latents[name].mean
        if function is not None:
            total += a[:, None] * shaped(name, function(rows.inputs), total.shape)
    return total


def shaped(name: str, found: Array, shape: tuple[int, ...]) -> Array:
    """What a prior mean function returned, if it has the shape; one component may lack its axis.

    Args:
        name: name of the latent function, for the message.
        found: what its mean returned.
        shape: (n, components).

    Raises:
        MisfitError: for another shape, or numbers that are not finite.
    """
    found = np.asarray(found, dtype=float)
    if found.size == np.prod(shape) and found.shape[:1] == shape[:1]:
        found = found.reshape(shape)
    if found.shape != shape or not np.isfinite(found).all():
        raise MisfitError(
            f"the prior mean of {name} returned shape {found.shape}, finite {np.isfinite(found).all()}; "
            f"expected finite numbers of shape {shape}"
        )
    return found


def factor(matrix: Array) -> Array:
    """Lower Cholesky factor of a covariance of observations, which is overwritten; see `factor_in_place`."""
    # The transpose of a symmetric matrix is in the order of LAPACK, so that nothing is copied.
    lower = matrix.T
    factor_in_place(lower, clean=True)
    return lower


def factor_in_place(matrix: Array, clean: bool = False) -> None:
    """Replace the lower triangle of a covariance of observations, in column order, by its Cholesky factor.

    What is above the diagonal is not read; it stays, or becomes 0 if that is to be `clean`.

    A pivot says which share of an observation's variance the ones before it leave open. Below the rounding error of the
    factorisation that share is noise of the computer, and so would be everything computed with it.

    Raises:
        MisfitError: if an observation follows from the others up to rounding.
    """
    variance = np.diagonal(matrix).copy()
    _, failed = dpotrf(matrix, lower=1, clean=int(clean), overwrite_a=1)
    if not failed:
        open_share = np.diagonal(matrix) ** 2 / variance
        failed = 0 if open_share.min() > least_share(len(matrix)) else int(np.argmin(open_share)) + 1
    if failed:
        scale = np.sqrt(max(float(variance[failed - 1]), 0.0))
        raise MisfitError(
            f"observation {failed} of {len(matrix)} follows from the ones before it (prior deviation with noise {scale:.3g}); "
            f"give observations a noise of at least {least_noise(len(matrix), scale):.1g}, or leave out repeated ones"
        )


def least_share(count: int) -> float:
    """The share of a variance that is not yet rounding error in a factor of `count` observations."""
    return 10.0 * count * float(np.finfo(float).eps)


def least_noise(count: int, scale: float) -> float:
    """A standard deviation of noise that is surely enough for a factor, for observations of this standard deviation."""
    return 3.0 * float(np.sqrt(least_share(count))) * scale

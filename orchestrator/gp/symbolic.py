"""Posteriors as CasADi expressions: for code that runs without Python, for derivatives, and for optimal control."""

from functools import singledispatch
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from fmus.errors import MisfitError
from orchestrator.gp.kernels import (
    Constant,
    Kernel,
    Linear,
    Matern32,
    Matern52,
    OnInputs,
    Periodic,
    Product,
    SquaredExponential,
    Sum,
)
from orchestrator.gp.physics import physics_of
from orchestrator.gp.posterior import Posterior
from orchestrator.gp.triangle import solve_half

Array = NDArray[Any]
# Below this a variance is rounding; its root has a slope there that is still a number.
_LEAST = 1e-300


def mean_of(posterior: Posterior, latent: str, x: ca.MX) -> ca.MX:
    """Expected values (p, 1) of a latent function at a point (d, 1).

    Args:
        posterior: the posterior.
        latent: name of the latent function.
        x: the point.

    Raises:
        MisfitError: if it has a prior mean that is Python code; that of a physics model is a formula.
    """
    expected = ca.MX.zeros(posterior.weights.shape[1], 1)
    if posterior.latents[latent].mean is not None:
        physics = physics_of(posterior.latents[latent])
        if physics is None:
            raise MisfitError(f"{latent} has a prior mean that is no formula; let another component add it")
        expected = physics.formula(x)
    seen, a = _seen(posterior, latent)
    if not seen.size:
        return expected
    values = kernel_at(posterior.latents[latent].kernel, posterior.rows.inputs[seen], x)
    return expected + ca.mtimes(ca.DM((a[:, None] * posterior.weights[seen]).T), values)


def deviation_of(posterior: Posterior, coefficients: dict[str, ca.MX], x: ca.MX) -> ca.MX:
    """Standard deviation of each component of a combination of latent functions at a point (d, 1).

    Args:
        posterior: the posterior.
        coefficients: factor of each latent function, by name.
        x: the point.
    """
    n = len(posterior.rows.inputs)
    shared, total = ca.MX.zeros(n, 1), ca.MX(0)
    for latent, factor in coefficients.items():
        kernel = posterior.latents[latent].kernel
        total += factor**2 * kernel_at_itself(kernel, x)
        seen, a = _seen(posterior, latent)
        if seen.size:
            places = ca.DM.ones(ca.Sparsity.triplet(n, len(seen), list(map(int, seen)), list(range(len(seen)))))
            values = kernel_at(kernel, posterior.rows.inputs[seen], x)
            shared += factor * ca.mtimes(places, ca.DM(a) * values)
    # The inverse of a triangle is as accurate here as solving with it, and a plain product in generated code.
    inverse = ca.tril(ca.DM(solve_half(posterior.lower, np.eye(n))))
    explained = ca.sumsqr(ca.mtimes(ca.sparsify(inverse), shared))
    return ca.sqrt(ca.fmax(total - explained, _LEAST))


def _seen(posterior: Posterior, latent: str) -> tuple[Array, Array]:
    """Rows of data in which a latent function counts, and what it counts there."""
    a = posterior.rows.coefficients.get(latent, np.zeros(0))
    seen = np.flatnonzero(a)
    return seen, a[seen]


@singledispatch
def kernel_at(kernel: Kernel, points: Array, x: ca.MX) -> ca.MX:
    """k(points_i, x), (n, 1), of points (n, d) and x (d, 1)."""
    raise MisfitError(f"the kernel {type(kernel).__name__} has no formula for generated code")


@singledispatch
def kernel_at_itself(kernel: Kernel, x: ca.MX) -> ca.MX:
    """k(x, x)."""
    return ca.MX(kernel.variance)  # type: ignore[attr-defined]


def _scaled_square(scales: tuple[float, ...], points: Array, x: ca.MX) -> ca.MX:
    total = ca.MX.zeros(len(points), 1)
    for k, scale in enumerate(scales):
        total += (ca.DM(points[:, k] / scale) - x[k] / scale) ** 2
    return total


@kernel_at.register
def _(kernel: SquaredExponential, points: Array, x: ca.MX) -> ca.MX:
    return kernel.variance * ca.exp(-0.5 * _scaled_square(kernel.length_scales, points, x))


@kernel_at.register
def _(kernel: Matern32, points: Array, x: ca.MX) -> ca.MX:
    a = _root(3.0 * _scaled_square(kernel.length_scales, points, x))
    return kernel.variance * (1.0 + a) * ca.exp(-a)


@kernel_at.register
def _(kernel: Matern52, points: Array, x: ca.MX) -> ca.MX:
    r2 = _scaled_square(kernel.length_scales, points, x)
    a = _root(5.0 * r2)
    return kernel.variance * (1.0 + a + 5.0 / 3.0 * r2) * ca.exp(-a)


def _root(square: ca.MX) -> ca.MX:
    """A root that has a slope of 0 at 0, where only its product with others counts."""
    return ca.sqrt(ca.fmax(square, _LEAST))


@kernel_at.register
def _(kernel: Constant, points: Array, x: ca.MX) -> ca.MX:
    return kernel.variance * ca.MX.ones(len(points), 1)


@kernel_at.register
def _(kernel: Linear, points: Array, x: ca.MX) -> ca.MX:
    return ca.mtimes(ca.DM(points * np.array(kernel.variances)), x)


@kernel_at.register
def _(kernel: Periodic, points: Array, x: ca.MX) -> ca.MX:
    total = ca.MX.zeros(len(points), 1)
    for k, (period, smoothness) in enumerate(zip(kernel.periods, kernel.smoothness, strict=True)):
        total += (ca.sin(np.pi * (ca.DM(points[:, k]) - x[k]) / period) / smoothness) ** 2
    return kernel.variance * ca.exp(-2.0 * total)


@kernel_at.register
def _(kernel: Sum, points: Array, x: ca.MX) -> ca.MX:
    return kernel_at(kernel.one, points, x) + kernel_at(kernel.other, points, x)


@kernel_at.register
def _(kernel: Product, points: Array, x: ca.MX) -> ca.MX:
    return kernel_at(kernel.one, points, x) * kernel_at(kernel.other, points, x)


@kernel_at.register
def _(kernel: OnInputs, points: Array, x: ca.MX) -> ca.MX:
    return kernel_at(kernel.kernel, points[:, list(kernel.columns)], x[list(kernel.columns)])


@kernel_at_itself.register
def _(kernel: Linear, x: ca.MX) -> ca.MX:
    return ca.dot(ca.DM(kernel.variances), x * x)


@kernel_at_itself.register
def _(kernel: Sum, x: ca.MX) -> ca.MX:
    return kernel_at_itself(kernel.one, x) + kernel_at_itself(kernel.other, x)


@kernel_at_itself.register
def _(kernel: Product, x: ca.MX) -> ca.MX:
    return kernel_at_itself(kernel.one, x) * kernel_at_itself(kernel.other, x)


@kernel_at_itself.register
def _(kernel: OnInputs, x: ca.MX) -> ca.MX:
    return kernel_at_itself(kernel.kernel, x[list(kernel.columns)])

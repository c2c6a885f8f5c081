"""A plain Gaussian process written by hand on NumPy and LAPACK: what a library has to be measured against.

ARD squared exponential and noise, zero mean; parameters are the logarithms of length scales (d), variance and noise variance.
Distances are computed once, of the lower triangle only; the rest is dpotrf, dpotri and one product for all length scales.
"""

import numpy as np
from scipy.linalg import solve_triangular
from scipy.linalg.blas import dsyr
from scipy.linalg.lapack import dpotrf, dpotri
from scipy.optimize import minimize

LOW, HIGH = np.log(1e-2), np.log(1e3)
STARTS = 3


class Reference:
    """The negative log marginal likelihood of y, (n,), at x, (n, d)."""

    def __init__(self, x: np.ndarray, y: np.ndarray) -> None:
        self.x, self.y, n = x, y, len(x)
        column, row = np.triu_indices(n)
        self.squares = ((x[row] - x[column]) ** 2).T.copy()
        self.places = column * n + row

    def __call__(self, parameters: np.ndarray) -> tuple[float, np.ndarray]:
        """Value and gradient."""
        n, d = self.x.shape
        scales, variance, noise = np.exp(parameters[:d]), np.exp(parameters[d]), np.exp(parameters[d + 1])
        kernel = variance * np.exp(-0.5 * ((1.0 / scales**2) @ self.squares))
        matrix = np.zeros((n, n), order="F")
        matrix.ravel(order="K")[self.places] = kernel
        matrix[np.diag_indices(n)] += noise
        lower, failed = dpotrf(matrix, lower=1, clean=0, overwrite_a=1)
        if failed:
            return 1e10, np.zeros(d + 2)
        half = solve_triangular(lower, self.y, lower=True, check_finite=False)
        weights = solve_triangular(lower, half, lower=True, trans="T", check_finite=False)
        value = 0.5 * half @ half + np.log(np.diag(lower)).sum() + 0.5 * n * np.log(2.0 * np.pi)
        inverse, _ = dpotri(lower, lower=1, overwrite_c=1)
        slope = dsyr(-1.0, weights, a=inverse, lower=1, overwrite_a=1)
        slope[np.diag_indices(n)] *= 0.5
        by_kernel = slope.ravel(order="K")[self.places] * kernel
        gradient = np.append((self.squares @ by_kernel) / scales**2, [by_kernel.sum(), noise * np.trace(slope)])
        return value, gradient

    def fit(self, begin: np.ndarray, low: np.ndarray, high: np.ndarray) -> tuple[float, int]:
        """The least value from a start, by L-BFGS-B with tight tolerances, and evaluations."""
        found = minimize(
            self,
            begin,
            jac=True,
            method="L-BFGS-B",
            bounds=list(zip(low, high, strict=True)),
            options={"ftol": 1e-12, "gtol": 1e-6},
        )
        return float(found.fun), int(found.nfev)


def problem(count: int) -> tuple[np.ndarray, np.ndarray]:
    """States (n, 4) of two joints and a standardised smooth function of them with noise of 0.05; larger sets begin with smaller ones."""
    rng = np.random.default_rng(20260101)
    x = np.column_stack(
        [rng.uniform(low, high, 756) for low, high in ((0.0, 1.5), (0.5, 2.2), (-2.0, 2.0), (-2.0, 2.0))]
    )
    y = np.sin(x[:, 0]) * np.cos(1.3 * x[:, 1]) + 0.3 * np.tanh(x[:, 2]) + 0.05 * x[:, 3] * x[:, 1]
    y = (y - y.mean()) / y.std() + 0.05 * rng.normal(size=756)
    return x[:count], y[:count]


def begins(inputs: int) -> np.ndarray:
    """Logarithms of length scales, variance and noise variance of each start."""
    rng = np.random.default_rng(7)
    middle = np.append(np.zeros(inputs + 1), np.log(0.01))
    return middle + np.vstack([np.zeros(inputs + 2), rng.uniform(-1.0, 1.0, (STARTS - 1, inputs + 2))])

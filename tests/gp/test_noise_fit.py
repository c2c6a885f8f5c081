"""Weights of noise alone: what `fit` finds with all kernels held, and the slope of the likelihood."""

import numpy as np
import pytest
from scipy.optimize import approx_fprime

from orchestrator.gp import noise_fit
from orchestrator.gp.covariance import Latent
from orchestrator.gp.fit import fit
from orchestrator.gp.kernels import SquaredExponential
from orchestrator.gp.limits import Limits
from orchestrator.gp.noise import AddedNoise
from orchestrator.gp.noise_fit import fit_noise
from orchestrator.gp.observations import observe

KERNEL = SquaredExponential(1.0, (0.7,))


def noisy() -> tuple[np.ndarray, np.ndarray, AddedNoise]:
    """Data whose noise grows with their distance from 0."""
    rng = np.random.default_rng(4)
    x = rng.uniform(-2, 2, (60, 1))
    f = np.linalg.cholesky(KERNEL(x, x) + 1e-9 * np.eye(60)) @ rng.normal(size=(60, 2))
    y = f + (0.05 * np.exp(1.2 * np.abs(x))) * rng.normal(size=(60, 2))
    noise = AddedNoise(np.column_stack([np.ones(60), np.abs(x[:, 0])]), np.zeros(2), ("one", "far"), np.full(60, 0.01))
    return x, y, noise


def test_weights_are_those_of_the_fit_of_everything_with_kernels_held() -> None:
    x, y, noise = noisy()
    alone = fit_noise(y, KERNEL(x, x), noise, [(0.0, 0.0), (-2.0, 0.5)])
    held = {f"f.{name}": Limits(v, v) for name, v in zip(KERNEL.names, KERNEL.values, strict=True)}
    together = fit({"f": Latent(KERNEL)}, [observe("d", x, "f", y, noise)], held)
    assert alone.value == pytest.approx(together.value, abs=1e-6)
    assert alone.noise.deviation == pytest.approx(together.observations[0].deviation, rel=1e-3)


def test_slope_of_the_noise_likelihood_is_its_difference_quotient() -> None:
    x, y, noise = noisy()
    weights, matrix = np.array([-1.5, 0.6]), KERNEL(x, x)
    numeric = approx_fprime(weights, lambda w: noise_fit._value(w, y, matrix, noise)[0], 1e-6)
    assert noise_fit._value(weights, y, matrix, noise)[1] == pytest.approx(numeric, rel=1e-4)

"""Libraries to compare with: each fits the same problem from the same starts with its own likelihood."""

from collections.abc import Callable

import numpy as np
from lapack_reference import HIGH, LOW, Reference, begins

from orchestrator.gp.covariance import Latent
from orchestrator.gp.fit import fit
from orchestrator.gp.kernels import SquaredExponential
from orchestrator.gp.likelihood import Likelihood
from orchestrator.gp.limits import Limits
from orchestrator.gp.noise import constant_noise
from orchestrator.gp.observations import observe
from orchestrator.gp.posterior import condition

# value, evaluations
Outcome = tuple[float, int]


def misfit_problem(x: np.ndarray, y: np.ndarray, begin: np.ndarray) -> tuple[dict, list, dict]:
    d = x.shape[1]
    latents = {"f": Latent(SquaredExponential(np.exp(begin[d]), tuple(np.exp(begin[:d]))))}
    data = [observe("data", x, "f", y, constant_noise(np.exp(0.5 * begin[d + 1]), len(x)))]
    limits = {f"f.length_scales[{k + 1}]": Limits(np.exp(LOW), np.exp(HIGH)) for k in range(d)}
    return latents, data, limits | {"f.variance": Limits(np.exp(LOW), np.exp(HIGH))}


def misfit_likelihood(x: np.ndarray, y: np.ndarray) -> Callable[[], object]:
    latents, data, _ = misfit_problem(x, y, begins(x.shape[1])[0])
    likelihood = Likelihood(latents, data)
    return lambda: likelihood(likelihood.start)


def misfit_mixed(x: np.ndarray, y: np.ndarray, count: int) -> Callable[[], object]:
    """The likelihood of a sum of so many functions with known factors."""
    rng = np.random.default_rng(0)
    latents = {f"f{k}": Latent(SquaredExponential(1.0, (1.0 + 0.1 * k,) * x.shape[1])) for k in range(count)}
    of = {name: 1.0 if name == "f0" else rng.uniform(size=len(x)) for name in latents}
    likelihood = Likelihood(latents, [observe("data", x, of, y, constant_noise(0.05, len(x)))])
    return lambda: likelihood(likelihood.start)


def misfit_fit(x: np.ndarray, y: np.ndarray, begin: np.ndarray) -> Outcome:
    latents, data, limits = misfit_problem(x, y, begin)
    found = fit(latents, data, limits, starts=1)
    return found.value, found.evaluations[0]


Predict = Callable[[], tuple[np.ndarray, np.ndarray]]


def misfit_predict(x: np.ndarray, y: np.ndarray, points: np.ndarray) -> Predict:
    """Mean and deviation at points, from a posterior that is there."""
    latents, data, _ = misfit_problem(x, y, begins(x.shape[1])[0])
    posterior = condition(latents, data)

    def predict() -> tuple[np.ndarray, np.ndarray]:
        mean, variance = posterior.predict("f", points)
        return mean[:, 0], np.sqrt(variance)

    return predict


def sklearn_predict(x: np.ndarray, y: np.ndarray, points: np.ndarray) -> Predict:
    """The same of scikit-learn, whose deviation holds the noise: it is taken off."""
    begin = begins(x.shape[1])[0]
    process = sklearn_process(x, y, begin)
    process.optimizer = None
    process.fit(x, y)

    def predict() -> tuple[np.ndarray, np.ndarray]:
        mean, deviation = process.predict(points, return_std=True)
        return mean, np.sqrt(deviation**2 - np.exp(begin[-1]))

    return predict


def reference_likelihood(x: np.ndarray, y: np.ndarray) -> Callable[[], object]:
    reference, begin = Reference(x, y), begins(x.shape[1])[0]
    return lambda: reference(begin)


def reference_fit(x: np.ndarray, y: np.ndarray, begin: np.ndarray) -> Outcome:
    low, high = np.full(len(begin), LOW), np.full(len(begin), HIGH)
    low[-1] = np.log(1e-6)
    return Reference(x, y).fit(begin, low, high)


def sklearn_process(x: np.ndarray, y: np.ndarray, begin: np.ndarray):
    from sklearn.gaussian_process import GaussianProcessRegressor
    from sklearn.gaussian_process.kernels import RBF, ConstantKernel, WhiteKernel

    d, bounds = x.shape[1], (np.exp(LOW), np.exp(HIGH))
    kernel = ConstantKernel(np.exp(begin[d]), bounds) * RBF(np.exp(begin[:d]), bounds)
    return GaussianProcessRegressor(kernel + WhiteKernel(np.exp(begin[d + 1]), (1e-6, 1e3)), alpha=0.0)


def sklearn_likelihood(x: np.ndarray, y: np.ndarray) -> Callable[[], object]:
    process = sklearn_process(x, y, begins(x.shape[1])[0])
    process.optimizer = None
    process.fit(x, y)
    theta = process.kernel_.theta
    return lambda: process.log_marginal_likelihood(theta, eval_gradient=True, clone_kernel=False)


def sklearn_fit(x: np.ndarray, y: np.ndarray, begin: np.ndarray) -> Outcome:
    from scipy.optimize import minimize

    process, count = sklearn_process(x, y, begin), 0

    def search(objective, start, bounds):
        nonlocal count
        options = {"ftol": 1e-12, "gtol": 1e-6}
        found = minimize(objective, start, jac=True, method="L-BFGS-B", bounds=bounds, options=options)
        count = found.nfev
        return found.x, found.fun

    process.optimizer = search
    process.fit(x, y)
    return -process.log_marginal_likelihood_value_, count


PEERS = {
    "LAPACK by hand": (reference_likelihood, reference_fit),
    "scikit-learn": (sklearn_likelihood, sklearn_fit),
}

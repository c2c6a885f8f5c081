"""The marginal likelihood and its gradient, and hyperparameters fitted by it."""

import numpy as np
import pytest
from scipy.optimize import minimize
from scipy.stats import multivariate_normal

from fmus.errors import MisfitError
from orchestrator.gp.covariance import Latent, covariance
from orchestrator.gp.fit import fit
from orchestrator.gp.kernels import Linear, Matern32, Matern52, Periodic, SquaredExponential
from orchestrator.gp.likelihood import Likelihood
from orchestrator.gp.limits import Limits, Units
from orchestrator.gp.noise import constant_noise, growing_noise
from orchestrator.gp.observations import observe, stacked

LATENTS = {
    "statics": Latent(SquaredExponential(2.0, (0.9, 1.6)), lambda x: 2.0 * x),
    "strong": Latent(Matern52(1.5, (1.2, 0.7)) + Linear((0.3, 0.2))),
    "weak": Latent(Matern32(0.5, (0.8, 2.0)) * Periodic(0.6, (2.0, 3.0), (1.1, 0.9))),
}


def mixed():
    rng = np.random.default_rng(3)
    x, y = rng.normal(size=(2, 20, 2))
    a = rng.uniform(size=(2, 8))
    return [
        observe("statics", x[:6], "statics", y[:6], constant_noise(0.2, 6)),
        observe("strong", x[6:12], "strong", y[6:12], 0.1),
        observe(
            "corrections",
            x[12:],
            {"statics": -1.0, "strong": -a[0], "weak": -a[1]},
            y[12:],
            growing_noise(0.3, y[12:, 0], 0.5),
        ),
    ]


def test_the_value_is_the_density_of_all_observations_together():
    observations = mixed()
    likelihood = Likelihood(LATENTS, observations)
    rows = stacked(observations)
    k = covariance(LATENTS, rows, rows) + np.diag(np.concatenate([each.deviation for each in observations]) ** 2)
    values = np.concatenate([each.values for each in observations])
    values[:, :] -= (2.0 * rows.inputs) * rows.coefficients["statics"][:, None]
    expected = -sum(multivariate_normal(cov=k).logpdf(column) for column in values.T)
    assert likelihood(likelihood.start)[0] == pytest.approx(expected, rel=1e-12)


def complex_value(likelihood: Likelihood, parameters: np.ndarray) -> complex:
    """The same number for complex parameters, by LU instead of Cholesky."""
    latents, observations = likelihood.at(parameters)
    rows = stacked(observations)
    k = covariance(latents, rows, rows) + np.diag(np.concatenate([each.deviation for each in observations]) ** 2)
    values = np.concatenate([each.values for each in observations]).astype(complex)
    values -= (2.0 * rows.inputs) * rows.coefficients["statics"][:, None]
    pivots = k.copy()
    for j in range(len(k)):  # elimination: the determinant is the product of the pivots
        pivots[j + 1 :, j:] -= np.outer(pivots[j + 1 :, j] / pivots[j, j], pivots[j, j:])
    logarithm = np.log(np.diag(pivots)).sum()
    return 0.5 * ((values * np.linalg.solve(k, values)).sum() + 2 * logarithm + values.size * np.log(2 * np.pi))


def test_the_gradient_agrees_with_the_complex_step():
    likelihood = Likelihood(LATENTS, mixed())
    found = likelihood(likelihood.start)[1]
    assert len(found) == len(likelihood.names) == 3 + 5 + 3 + 5 + 1 + 2
    for k, name in enumerate(likelihood.names):
        moved = likelihood.start.astype(complex)
        moved[k] += 1e-30j
        assert found[k] == pytest.approx(complex_value(likelihood, moved).imag / 1e-30, rel=1e-10, abs=1e-11), name


def smooth_data(count=40, noise=0.05):
    rng = np.random.default_rng(8)
    x = rng.uniform(-2, 2, size=(count, 2))
    return x, np.sin(2 * x[:, 0]) + 0.5 * x[:, 1] + noise * rng.normal(size=count)


def plain(x, y, start=0.3):
    return {"f": Latent(SquaredExponential(1.0, (1.0, 1.0)))}, [
        observe("data", x, "f", y, constant_noise(start, len(x)))
    ]


def test_the_optimum_is_that_of_another_optimiser_from_every_start():
    latents, observations = plain(*smooth_data())
    found = fit(latents, observations, starts=3)
    likelihood = Likelihood(latents, observations)
    reference = minimize(
        likelihood, likelihood.start, jac=True, method="L-BFGS-B", options={"ftol": 1e-15, "gtol": 1e-8}
    )
    assert found.value == pytest.approx(reference.fun, abs=1e-6)
    assert found.values == pytest.approx([reference.fun] * 3, abs=1e-6)
    assert max(found.evaluations) < 200
    assert found.parameters["data.log deviation"] == pytest.approx(np.log(0.05), abs=0.3)


def test_many_data_lead_to_the_optimum_of_another_optimiser_and_starts_that_meet_are_searched_once():
    latents, observations = plain(*smooth_data(240))
    found = fit(latents, observations, starts=2)
    likelihood = Likelihood(latents, observations)
    reference = minimize(
        likelihood, likelihood.start, jac=True, method="L-BFGS-B", options={"ftol": 1e-15, "gtol": 1e-8}
    )
    assert found.value == pytest.approx(reference.fun, abs=1e-6)
    assert found.evaluations[0] < reference.nfev
    assert found.evaluations[1] == 0


def test_the_optimum_is_never_worse_than_that_of_scikit_learn():
    process = pytest.importorskip("sklearn.gaussian_process")
    x, y = smooth_data()
    kernel = process.kernels.ConstantKernel() * process.kernels.RBF([1.0, 1.0]) + process.kernels.WhiteKernel(0.09)
    theirs = process.GaussianProcessRegressor(kernel, alpha=0.0).fit(x, y)
    ours = fit(*plain(x, y))
    assert ours.value <= -theirs.log_marginal_likelihood_value_ + 1e-6


def test_an_input_that_never_varies_keeps_its_length_scale_and_is_named():
    x, y = smooth_data()
    x[:, 1] = 0.7
    found = fit(*plain(x, y), starts=1)
    assert found.held == ("f.length_scales[2]",)
    assert found.parameters["f.length_scales[2]"] == pytest.approx(1.0, rel=1e-12)


def test_an_input_that_hardly_varies_is_not_declared_irrelevant():
    x, _ = smooth_data()
    speed = 0.02 * x[:, 1:]
    state = np.hstack([x[:, :1], speed])
    found = fit(*plain(state, np.sin(2 * x[:, 0])), starts=2)
    assert found.parameters["f.length_scales[2]"] <= 10.0 * np.ptp(speed) * (1 + 1e-9)
    assert "f.length_scales[2]" in found.at_bounds


def test_limits_have_units():
    latents, observations = plain(*smooth_data())
    limits = {
        "f.length_scales[1]": Limits(1.0, 20.0, "deg"),
        "f.variance": Limits(1e-2, 1e4, "cN2"),
    }
    found = fit(latents, observations, limits, Units(("rad", "rad/s"), "N"), starts=1)
    assert found.parameters["f.length_scales[1]"] == pytest.approx(np.radians(20.0), rel=1e-3)
    assert found.parameters["f.variance"] <= 1.0 + 1e-9


def test_hyperparameters_that_are_all_given_stay_as_given():
    latents, observations = plain(*smooth_data(10))
    likelihood = Likelihood(latents, observations)
    given = {name: Limits(0.5, 0.5) for name in likelihood.names}
    found = fit(latents, observations, given)
    assert list(found.parameters.values()) == pytest.approx([0.5] * 4, rel=1e-12)
    assert found.evaluations == (1, 1, 1)
    assert found.at_bounds == ()


def test_a_tight_prior_wins_over_the_data():
    latents, observations = plain(*smooth_data())
    prior = {"f.length_scales[1]": Limits(0.1, 10.0, median=3.0, spread=1.0001)}
    assert fit(latents, observations, prior, starts=1).parameters["f.length_scales[1]"] == pytest.approx(3.0, rel=1e-3)


@pytest.mark.parametrize(
    ("name", "limits", "message"),
    [
        ("f.length", Limits(1, 2), "limits for 'f.length', which is no hyperparameter; there are 'f.variance'"),
        ("f.variance", Limits(2, 1), "f.variance: limits from 2 to 1"),
        ("f.variance", Limits(0, 1), "all positive"),
        ("f.length_scales[1]", Limits(1, 2, "N"), "a limit in N; expected a unit that converts to rad"),
        ("f.variance", Limits(1, 2, "N"), r"a limit in N; expected a unit that converts to \(N\)\^2"),
        ("data.log deviation", Limits(1, 2, median=1.5, spread=0), "a spread of 0"),
    ],
)
def test_wrong_limits_are_refused_by_name(name, limits, message):
    latents, observations = plain(*smooth_data(8))
    with pytest.raises(MisfitError, match=message):
        fit(latents, observations, {name: limits}, Units(("rad", "rad/s"), "N"))


def test_data_without_noise_that_repeat_give_no_silent_fit():
    x = np.zeros((4, 1))
    latents = {"f": Latent(SquaredExponential(1.0, (1.0,)))}
    with pytest.raises(MisfitError, match="no start of 2 gave a likelihood; give observations more noise"):
        fit(latents, [observe("d", x, "f", [1, 2, 3, 4], 0.0)], starts=2)


def test_values_a_million_times_larger_give_the_same_length_scales():
    x, y = smooth_data(25)
    one = fit(*plain(x, y), starts=1)
    latents = {"f": Latent(SquaredExponential(1e12, (1.0, 1.0)))}
    other = fit(latents, [observe("data", x, "f", 1e6 * y, constant_noise(0.3e6, 25))], starts=1)
    for name in ("f.length_scales[1]", "f.length_scales[2]"):
        assert other.parameters[name] == pytest.approx(one.parameters[name], rel=1e-2)
    assert other.value - 25 * np.log(1e6) == pytest.approx(one.value, abs=1e-6)

"""Predictions one after another against those of the posterior."""

import numpy as np
import pytest

from fmus.errors import MisfitError
from orchestrator.gp.covariance import Latent
from orchestrator.gp.kernels import Constant, Linear, Matern32, Matern52, OnInputs, Periodic, SquaredExponential
from orchestrator.gp.observations import observe
from orchestrator.gp.posterior import condition
from orchestrator.gp.predictor import Predictor

LATENTS = {
    "statics": Latent(SquaredExponential(2.0, (0.9, 1.6)), lambda x: 3.0 * x),
    "strong": Latent(Matern52(1.5, (1.2, 0.7)) + Linear((0.3, 0.2)) + Constant(0.5)),
    "weak": Latent(OnInputs((1,), Matern32(0.5, (0.8,))) * Periodic(0.6, (2.0, 3.0), (1.1, 0.9))),
    "unseen": Latent(SquaredExponential(1.0, (1.0, 1.0))),
}


@pytest.fixture
def posterior():
    rng = np.random.default_rng(0)
    a = rng.uniform(size=(2, 9)) * (rng.uniform(size=(2, 9)) > 0.3)  # a coefficient of 0 now and then
    of = {"statics": -1.0, "strong": -a[0], "weak": -a[1]}
    seen = observe("both", rng.normal(size=(9, 2)), of, rng.normal(size=(9, 2)), 0.2)
    return condition(LATENTS, [seen])


def test_a_predictor_says_what_the_posterior_says(posterior):
    predictor = Predictor(posterior, list(LATENTS))
    for x in np.random.default_rng(1).normal(size=(5, 2)):
        assert np.allclose(predictor(x), [posterior.mean(name, x)[0] for name in LATENTS], rtol=1e-12, atol=1e-13)


def test_a_combination_has_the_mean_and_variance_of_the_posterior(posterior):
    predictor, of = Predictor(posterior, list(LATENTS)), {"statics": -1.0, "strong": 0.4, "unseen": 2.0}
    for x in np.random.default_rng(2).normal(size=(5, 2)):
        mean, variance = predictor.combined(of, x)
        assert np.allclose(mean, posterior.mean(of, x)[0], rtol=1e-12)
        assert variance == pytest.approx(posterior.variance(of, x)[0], rel=1e-12)


def test_what_a_predictor_says_does_not_depend_on_what_was_asked_before(posterior):
    predictor, x = Predictor(posterior, ["strong", "weak"]), np.array([0.3, -0.2])
    before = predictor(x)
    predictor(-x)
    first = predictor.combined({"weak": 1.0}, x)
    assert np.array_equal(predictor(x), before)
    assert predictor.combined({"weak": 2.0}, x)[1] == pytest.approx(4.0 * first[1], rel=1e-12)
    assert predictor.combined({"weak": 1.0}, -x)[1] != first[1]


def test_a_function_without_data_is_predicted_as_expected_before(posterior):
    assert np.array_equal(Predictor(posterior, ["unseen"])(np.ones(2)), np.zeros((1, 2)))


@pytest.mark.parametrize("x", [np.ones(3), np.array([1.0, np.nan]), np.ones((1, 2))])
def test_what_is_no_point_is_refused(posterior, x):
    with pytest.raises(MisfitError, match="expected 2 finite inputs"):
        Predictor(posterior, ["strong"])(x)


def test_unknown_functions_are_refused(posterior):
    with pytest.raises(MisfitError, match="no latent function 'tendon'"):
        Predictor(posterior, ["tendon"])

"""Many data: a sparse posterior against the exact one, its bound, and a message before memory runs out."""

import numpy as np
import pytest

from fmus.errors import MisfitError
from orchestrator.gp import room
from orchestrator.gp.covariance import Latent
from orchestrator.gp.fit import MOST, fit
from orchestrator.gp.kernels import Matern52, SquaredExponential
from orchestrator.gp.likelihood import Likelihood
from orchestrator.gp.noise import constant_noise
from orchestrator.gp.observations import Observation, observe
from orchestrator.gp.posterior import condition
from orchestrator.gp.sparse import condition_sparse

LATENTS = {
    "rest": Latent(SquaredExponential(1.0, (1.0, 1.5)), lambda x: 0.5 * x[:, :1]),
    "muscle": Latent(Matern52(0.5, (2.0, 2.0))),
}
QUERY = np.random.default_rng(1).uniform(-2, 2, (20, 2))


def mixed(count: int) -> list[Observation]:
    rng = np.random.default_rng(2)
    x, a = rng.uniform(-2, 2, (count, 2)), rng.uniform(size=count)
    y = np.sin(x[:, 0]) + a * np.cos(x[:, 1]) + 0.2 * rng.normal(size=count)
    return [observe("d", x, {"rest": 1.0, "muscle": a}, y, 0.2)]


def test_a_sparse_posterior_of_all_rows_is_the_exact_one_with_the_same_evidence():
    data = mixed(80)
    found, exact = condition_sparse(LATENTS, data, 80), condition(LATENTS, data)
    likelihood = Likelihood(LATENTS, data)
    assert found.evidence == pytest.approx(-likelihood(likelihood.start)[0], abs=1e-3)
    assert found.lost < 1e-3
    of = {"rest": 1.0, "muscle": 0.5}
    assert found.posterior.mean(of, QUERY) == pytest.approx(exact.mean(of, QUERY), abs=1e-4)
    assert found.posterior.variance(of, QUERY) == pytest.approx(exact.variance(of, QUERY), abs=1e-5)


def test_fewer_rows_lose_no_more_evidence_than_they_say():
    data = mixed(400)
    likelihood = Likelihood(LATENTS, data)
    exact = -likelihood(likelihood.start)[0]
    lost = []
    for count in (10, 40, 120):
        found = condition_sparse(LATENTS, data, count)
        assert found.evidence <= exact + 1e-3
        lost.append(exact - found.evidence)
        assert lost[-1] < found.lost + 1e-3
    assert lost[0] > lost[1] > lost[2]
    assert lost[2] < 0.5


def test_thirty_thousand_data_are_conditioned_on_two_hundred_rows_within_their_intervals():
    data = mixed(30_000)
    found = condition_sparse(LATENTS, data, 120).posterior
    truth = np.sin(QUERY[:, 0]) + 0.5 * np.cos(QUERY[:, 1])
    of = {"rest": 1.0, "muscle": 0.5}
    off = found.mean(of, QUERY)[:, 0] - truth
    assert np.sqrt(np.mean(off**2)) < 0.02
    assert len(found.weights) <= 120


def test_more_data_than_fit_into_memory_are_refused_with_the_memory_needed(monkeypatch):
    monkeypatch.setattr(room, "_free", lambda: 1e6)
    with pytest.raises(MisfitError, match=r"1000 data need 0\.0 GB of memory .* condition_sparse"):
        condition(LATENTS, mixed(1000))


def test_hyperparameters_of_many_data_are_those_of_a_random_share_and_the_data_stay_whole():
    rng = np.random.default_rng(4)
    x = rng.uniform(-2, 2, (MOST + 500, 1))
    data = observe("d", x, "f", np.sin(2 * x[:, 0]) + 0.1 * rng.normal(size=len(x)), constant_noise(1.0, len(x)))
    found = fit({"f": Latent(SquaredExponential(1.0, (1.0,)))}, [data], starts=1, promise=1.0)
    assert len(found.observations[0].inputs) == MOST + 500
    assert found.observations[0].deviation[0] == pytest.approx(0.1, rel=0.05)

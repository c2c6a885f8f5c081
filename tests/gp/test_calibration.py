"""Intervals against functions that are known: with integrated hyperparameters, of one function and of mixtures, at any scale."""

import numpy as np
import pytest

from misfit import Block
from orchestrator.gp.covariance import Latent
from orchestrator.gp.fit import fit
from orchestrator.gp.integrated import integrate
from orchestrator.gp.kernels import SquaredExponential
from orchestrator.gp.likelihood import Likelihood
from orchestrator.gp.limits import Limits, Units, box, weak_priors
from orchestrator.gp.noise import constant_noise
from orchestrator.gp.observations import Observation, observe
from orchestrator.gp.posterior import condition

Z90 = 1.6449
LATENTS = {"f": Latent(SquaredExponential(1.0, (1.0, 1.0)))}


def drawn(seed: int, count: int, scale: float = 1.0) -> tuple[Observation, np.ndarray, np.ndarray]:
    """A function drawn with length scales between 0.5 and 1.5, `count` noisy data of it, 60 points and its values there."""
    rng = np.random.default_rng(seed)
    x = rng.uniform(-2, 2, (count + 60, 2))
    matrix = SquaredExponential(1.0, tuple(rng.uniform(0.5, 1.5, 2)))(x, x) + 1e-9 * np.eye(len(x))
    f = scale * np.linalg.cholesky(matrix) @ rng.normal(size=len(x))
    y = f[:count] + 0.1 * scale * rng.normal(size=count)
    return observe("d", x[:count], "f", y, constant_noise(0.1, count)), x[count:], f[count:]


def inside(mean: np.ndarray, variance: np.ndarray, truth: np.ndarray) -> float:
    return float(np.mean(np.abs(mean.ravel() - truth) <= Z90 * np.sqrt(variance.ravel())))


@pytest.mark.parametrize(("count", "sets"), [(12, 24), (40, 12)])
def test_ninety_percent_intervals_hold_about_ninety_percent_where_those_of_the_best_fit_hold_fewer(count, sets):
    plugged, whole = [], []
    for seed in range(sets):
        data, at, truth = drawn(seed, count)
        best = fit(LATENTS, [data])
        one, many = condition(best.latents, best.observations), integrate(LATENTS, [data], starts=2)
        plugged.append(inside(one.mean("f", at), one.variance("f", at), truth))
        whole.append(inside(many.mean("f", at), many.variance("f", at), truth))
    # The mean of so many sets has a standard error of 2.5 %.
    assert 0.83 < np.mean(whole) < 0.97
    assert np.mean(plugged) < np.mean(whole) - 0.03


def test_functions_that_are_only_seen_in_sums_have_intervals_that_hold():
    found = []
    latents = {name: Latent(SquaredExponential(1.0, (1.0,))) for name in ("rest", "muscle")}
    for seed in range(12):
        rng = np.random.default_rng(seed)
        x, a = rng.uniform(-2, 2, (70, 1)), rng.uniform(size=70)
        matrix = SquaredExponential(1.0, (1.0,))(x, x) + 1e-9 * np.eye(70)
        rest, muscle = (np.linalg.cholesky(matrix) @ rng.normal(size=(70, 2)) * [0.5, 2.0]).T
        y = (rest + a * muscle)[:40] + 0.1 * rng.normal(size=40)
        data = observe("d", x[:40], {"rest": 1.0, "muscle": a[:40]}, y, constant_noise(0.1, 40))
        many = integrate(latents, [data], starts=2)
        found.append(inside(many.mean("muscle", x[40:]), many.variance("muscle", x[40:]), muscle[40:]))
    assert 0.82 < np.mean(found) < 0.98


@pytest.mark.parametrize("scale", [1e-6, 1e4])
def test_a_fit_that_begins_at_one_finds_the_same_optimum_at_any_scale_of_the_values(scale):
    for seed in range(4):
        (data, _, _), (same, _, _) = drawn(seed, 40), drawn(seed, 40, scale)
        one, other = fit(LATENTS, [data]), fit(LATENTS, [same])
        assert other.value - 40 * np.log(scale) == pytest.approx(one.value, abs=1e-4)


def test_what_is_expected_of_a_function_does_not_depend_on_the_unit_of_its_coefficient():
    rng = np.random.default_rng(2)
    x, activation, y = rng.uniform(-2, 2, (40, 1)), rng.uniform(size=40), rng.normal(size=40)
    latents = {name: Latent(SquaredExponential(1.0, (1.0,))) for name in ("rest", "muscle")}
    expected = []
    for each in (activation, 100.0 * activation):  # as a share and in percent
        data = [observe("d", x, {"rest": 1.0, "muscle": each}, y, constant_noise(0.1, 40))]
        likelihood = Likelihood(latents, data)
        means = weak_priors(likelihood, data, box(likelihood, data, {}, Units())).mean
        expected.append(dict(zip(likelihood.names, means, strict=True)))
    share, percent = expected
    assert percent.pop("muscle.variance") == pytest.approx(share.pop("muscle.variance") - np.log(100.0**2))
    assert percent == pytest.approx(share)


def test_a_mixture_of_one_set_of_hyperparameters_is_its_posterior():
    data, at, _ = drawn(1, 20)
    likelihood = Likelihood(LATENTS, [data])
    fixed = {name: Limits(value, value) for name, value in zip(likelihood.names[:3], (1.0, 1.0, 1.0), strict=True)}
    fixed["d.log deviation"] = Limits(np.log(0.1), np.log(0.1))
    many, one = integrate(LATENTS, [data], fixed), condition(LATENTS, [data])
    assert many.mean("f", at) == pytest.approx(one.mean("f", at))
    assert many.variance("f", at)[:, 0] == pytest.approx(one.variance("f", at))


def test_intervals_of_a_block_hold_with_a_dozen_data_where_those_of_the_best_fit_do_not():
    plugged, found = [], []
    for seed in range(100, 124):
        data, at, truth = drawn(seed, 12)
        best = fit(LATENTS, [data])
        one = condition(best.latents, best.observations)
        columns = {"a": data.inputs[:, 0], "b": data.inputs[:, 1]}
        block = Block.fit(columns, {"f": data.values[:, 0]}).learned.posterior
        plugged.append(inside(one.mean("f", at), one.variance("f", at), truth))
        found.append(inside(block.mean("f", at), block.variance("f", at), truth))
    assert 0.81 < np.mean(found) < 0.97
    assert np.mean(plugged) < np.mean(found) - 0.1


def test_the_representative_of_a_mixture_is_the_set_that_is_nearest_to_all_of_them():
    data, at, _ = drawn(3, 12)
    whole = integrate(LATENTS, [data])
    means, variance = whole.mean("f", at), whole.variance("f", at)

    def lost(k: int) -> float:
        """Kullback-Leibler divergence, but for what all sets share."""
        own = whole.posteriors[k].variance("f", at)[:, None]
        off = (whole.posteriors[k].mean("f", at) - means) ** 2
        return float(np.mean(np.log(own) + (variance + off) / own))

    chosen = whole.representative("f", at)
    assert all(lost(chosen) <= lost(k) for k in range(len(whole.posteriors)))

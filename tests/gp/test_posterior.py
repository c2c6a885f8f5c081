"""The joint posterior of mixed data against a dense conditioning written here, and what must hold of any posterior."""

import os
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fmus.errors import MisfitError
from orchestrator.gp.covariance import Latent
from orchestrator.gp.kernels import Constant, Linear, Matern32, Matern52, Periodic, SquaredExponential
from orchestrator.gp.noise import growing_noise
from orchestrator.gp.observations import Observation, observe
from orchestrator.gp.posterior import Posterior, condition
from orchestrator.gp.printed import condition_printed

SCALES = np.array([0.9, 1.6])


def plane(x):
    return np.column_stack([2.0 * x[:, 0], 1.0 - x[:, 1]])


def plane_gradient(x):
    return np.broadcast_to(np.array([[2.0, 0.0], [0.0, -1.0]]), (len(x), 2, 2))


LATENTS = {
    "statics": Latent(SquaredExponential(2.0, tuple(SCALES)), plane, plane_gradient),
    "strong": Latent(SquaredExponential(1.5, (1.2, 0.7))),
    "weak": Latent(Matern52(0.1, (0.8, 2.0))),
}
RNG = np.random.default_rng(5)


def data(name: str, count: int, of: dict | str, noise: float, rng: np.random.Generator = RNG) -> Observation:
    return observe(name, rng.normal(size=(count, 2)), of, rng.normal(size=(count, 2)), noise)


def mixed() -> list[Observation]:
    rng = np.random.default_rng(11)
    a, b = rng.uniform(size=(2, 9))
    return [
        data("statics", 6, "statics", 0.1, rng),
        data("strong", 5, "strong", 0.05, rng),
        data("weak", 5, "weak", 0.02, rng),
        data("corrections", 9, {"statics": -1.0, "strong": -a, "weak": -b}, 0.5, rng),
    ]


QUERY = np.random.default_rng(12).normal(size=(7, 2))


def kernel_by_hand(name: str, x: np.ndarray, y: np.ndarray) -> float:
    if name == "weak":
        r = np.sqrt(5.0 * (((x - y) / [0.8, 2.0]) ** 2).sum())
        return 0.1 * (1.0 + r + r * r / 3.0) * np.exp(-r)
    scale, variance = ((0.9, 1.6), 2.0) if name == "statics" else ((1.2, 0.7), 1.5)
    return variance * np.exp(-0.5 * (((x - y) / scale) ** 2).sum())


def dense(observations: list[Observation], name: str, query: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Mean and covariance of one latent function, element by element and by a general solver."""
    rows = [
        (x, {n: c[k] for n, c in each.coefficients.items()}, each.values[k], each.deviation[k])
        for each in observations
        for k, x in enumerate(each.inputs)
    ]
    joint = np.array(
        [[sum(c[n] * e[n] * kernel_by_hand(n, x, y) for n in c if n in e) for y, e, *_ in rows] for x, c, *_ in rows]
    )
    joint += np.diag([noise**2 for *_, noise in rows])
    expected = np.array([c.get("statics", 0.0) * plane(x[None])[0] for x, c, *_ in rows])
    cross = np.array([[c.get(name, 0.0) * kernel_by_hand(name, q, x) for x, c, *_ in rows] for q in query])
    prior = np.array([[kernel_by_hand(name, q, p) for p in query] for q in query])
    gain = np.linalg.solve(joint, cross.T).T
    start = plane(query) if name == "statics" else 0.0
    return start + gain @ (np.array([v for *_, v, _ in rows]) - expected), prior - gain @ cross.T


@pytest.fixture(scope="module")
def posterior() -> Posterior:
    return condition(LATENTS, mixed())


@pytest.mark.parametrize("name", LATENTS)
def test_every_latent_function_agrees_with_dense_conditioning(posterior, name):
    mean, covariance = dense(mixed(), name, QUERY)
    scale = np.abs(mean).max()
    assert np.allclose(posterior.mean(name, QUERY), mean, rtol=1e-9, atol=1e-12 * scale)
    assert np.allclose(posterior.variance(name, QUERY), np.diag(covariance), rtol=1e-9)
    found = posterior.covariance(name, QUERY, name, QUERY)
    assert np.allclose(found, covariance, rtol=1e-9, atol=1e-12 * np.abs(covariance).max())


def test_a_combination_is_predicted_as_the_combination_of_its_parts(posterior):
    of = {"statics": -1.0, "strong": 0.3 * np.arange(7), "weak": 2.0}
    parts = {name: posterior.mean(name, QUERY) for name in of}
    expected = sum(np.broadcast_to(c, 7)[:, None] * parts[name] for name, c in of.items())
    assert np.allclose(posterior.mean(of, QUERY), expected, rtol=1e-10, atol=1e-12)
    variance = sum(
        np.broadcast_to(a, 7) * np.broadcast_to(b, 7) * np.diag(posterior.covariance(one, QUERY, other, QUERY))
        for one, a in of.items()
        for other, b in of.items()
    )
    assert np.allclose(posterior.variance(of, QUERY), variance, rtol=1e-10)


@pytest.mark.parametrize("name", LATENTS)
def test_the_gradient_is_the_slope_of_the_mean(posterior, name):
    step = 1e-5
    for k in range(2):
        move = step * np.eye(2)[k]
        slope = (posterior.mean(name, QUERY + move) - posterior.mean(name, QUERY - move)) / (2 * step)
        # central differences: error step^2, rounding 1e-16 / step
        assert np.allclose(posterior.gradient(name, QUERY)[:, :, k], slope, rtol=1e-7, atol=1e-8)


@pytest.mark.parametrize("of", [*LATENTS, {"statics": -1.0, "strong": 0.4}], ids=str)
def test_the_gradient_of_the_variance_is_its_slope(posterior, of):
    step = 1e-5
    for k in range(2):
        move = step * np.eye(2)[k]
        slope = (posterior.variance(of, QUERY + move) - posterior.variance(of, QUERY - move)) / (2 * step)
        assert np.allclose(posterior.variance_gradient(of, QUERY)[:, k], slope, rtol=1e-6, atol=1e-8)


def test_the_variance_of_a_straight_line_grows_as_its_formula_says():
    # One datum y = x w + e of a slope w ~ N(0, 2): var(w) = 2 s^2 / (2 x^2 + s^2), and that of the line var(w) q^2.
    found = condition({"f": Latent(Linear((2.0,)))}, [observe("datum", [[3.0]], "f", [1.0], 0.5)])
    slope = 2.0 * 0.25 / (2.0 * 9.0 + 0.25)
    assert found.variance("f", [[4.0]])[0] == pytest.approx(16.0 * slope, rel=1e-12)
    assert found.variance_gradient("f", [[4.0]])[0, 0] == pytest.approx(8.0 * slope, rel=1e-12)


@settings(deadline=None, max_examples=10)
@given(seed=st.integers(0, 10**6))
def test_the_order_of_observations_changes_nothing(seed):
    rng = np.random.default_rng(seed)
    shuffled = [each.rows(rng.permutation(len(each.inputs))) for each in mixed()]
    rng.shuffle(shuffled)
    one, other = condition(LATENTS, mixed()), condition(LATENTS, shuffled)
    assert np.allclose(one.mean("weak", QUERY), other.mean("weak", QUERY), rtol=1e-10, atol=1e-13)
    assert np.allclose(one.variance("weak", QUERY), other.variance("weak", QUERY), rtol=1e-10)


@pytest.mark.parametrize(
    "useless",
    [
        data("nothing", 4, {"strong": 0.0}, 0.3),
        data("noise", 4, "strong", 1e12),
        observe("elsewhere", np.full((3, 2), 1e3) + np.arange(3)[:, None], "strong", np.ones((3, 2)), 0.1),
    ],
    ids=["coefficient 0", "endless noise", "far away"],
)
def test_an_uninformative_datum_changes_nothing(posterior, useless):
    more = condition(LATENTS, [*mixed(), useless])
    for name in LATENTS:
        assert np.allclose(more.mean(name, QUERY), posterior.mean(name, QUERY), rtol=1e-10, atol=1e-12)
        assert np.allclose(more.variance(name, QUERY), posterior.variance(name, QUERY), rtol=1e-10)


@settings(deadline=None, max_examples=10)
@given(seed=st.integers(0, 10**6), noise=st.floats(0.01, 10.0))
def test_more_data_never_make_a_variance_larger(seed, noise):
    rng = np.random.default_rng(seed)
    more = data("more", 3, {"statics": 1.0, "weak": rng.normal()}, noise, rng)
    before, after = condition(LATENTS, mixed()), condition(LATENTS, [*mixed(), more])
    for name in LATENTS:
        assert np.all(after.variance(name, QUERY) <= before.variance(name, QUERY) * (1 + 1e-12))


def test_a_datum_seen_twice_counts_as_one_of_half_the_variance():
    one = data("one", 5, "strong", 0.2)
    twice = condition(LATENTS, [one, replace(one, name="again")])
    sharper = condition(LATENTS, [replace(one, noise=one.deviation / np.sqrt(2.0))])
    assert np.allclose(twice.mean("strong", QUERY), sharper.mean("strong", QUERY), rtol=1e-9, atol=1e-12)


def test_every_process_finds_the_same_bits():
    """Python shuffles sets anew in each process; sums of seven functions must not."""
    code = (
        "from orchestrator.gp.covariance import Latent\n"
        "from orchestrator.gp.kernels import SquaredExponential\n"
        "from orchestrator.gp.observations import observe\n"
        "from orchestrator.gp.posterior import condition\n"
        "latents = {n: Latent(SquaredExponential(1.3 + k, (0.7 + k,))) for k, n in enumerate('abcdefg')}\n"
        "seen = observe('d', [[0.1 * k] for k in range(9)], {n: 0.3 + k for k, n in enumerate('abcdefg')}, range(9), 0.1)\n"
        "print(condition(latents, [seen]).mean('c', [[0.33]])[0, 0].hex())"
    )
    found = {
        subprocess.run(
            [sys.executable, "-c", code],
            env={**os.environ, "PYTHONHASHSEED": seed},
            cwd=Path(__file__).parents[2],
            capture_output=True,
            text=True,
            check=True,
        ).stdout
        for seed in ("1", "2", "3")
    }
    assert len(found) == 1


def test_components_that_mix_are_latent_functions_of_their_own():
    # A torque J' f seen for a latent force of two components, against the block form of the same.
    latents = {"fx": Latent(SquaredExponential(1.0, (1.0, 1.0))), "fy": Latent(SquaredExponential(3.0, (0.5, 2.0)))}
    x, jacobian, torque = RNG.normal(size=(6, 2)), RNG.normal(size=(6, 2)), RNG.normal(size=6)
    found = condition(latents, [observe("torque", x, {"fx": jacobian[:, 0], "fy": jacobian[:, 1]}, torque, 0.1)])
    kx, ky = (latents[name].kernel(x, x) for name in ("fx", "fy"))
    joint = np.outer(jacobian[:, 0], jacobian[:, 0]) * kx + np.outer(jacobian[:, 1], jacobian[:, 1]) * ky
    expected = ky @ (jacobian[:, 1] * np.linalg.solve(joint + 0.01 * np.eye(6), torque))
    assert np.allclose(found.mean("fy", x)[:, 0], expected, rtol=1e-9)


def test_noise_that_grows_is_what_its_formula_says():
    force = np.array([0.0, 10.0, 90.0])
    noise = growing_noise(2.0, force, floor=10.0)
    assert np.allclose(noise.deviation, 2.0 * (force + 10.0) / 10.0, rtol=1e-14)


def test_scales_a_million_apart_do_not_hurt():
    large = {"f": Latent(SquaredExponential(1e12, (1e6, 1e-6)))}
    small = {"f": Latent(SquaredExponential(1.0, (1.0, 1.0)))}
    x, y = RNG.normal(size=(12, 2)), RNG.normal(size=12)
    one = condition(small, [observe("data", x, "f", y, 0.1)])
    other = condition(large, [observe("data", x * [1e6, 1e-6], "f", 1e6 * y, 1e5)])
    assert np.allclose(other.mean("f", QUERY * [1e6, 1e-6]), 1e6 * one.mean("f", QUERY), rtol=1e-9, atol=1e-3)


def test_a_strong_and_a_weak_function_a_million_apart_agree_with_their_own_data():
    latents = {"big": Latent(SquaredExponential(1e12, (1.0,))), "small": Latent(SquaredExponential(1.0, (1.0,)))}
    x = np.linspace(0, 3, 5)[:, None]
    alone = observe("small", x, "small", np.sin(x), 0.01)
    both = observe("both", x + 0.1, {"big": 1.0, "small": 1.0}, 1e6 * np.cos(x), 1e3)
    one, other = condition(latents, [alone]), condition(latents, [alone, both])
    # The sum is known to 1e3 at best, so it can say no more than 1e-6 of the variance about the small part.
    assert np.allclose(one.mean("small", x), other.mean("small", x), atol=1e-5)


def test_repeated_points_without_noise_are_refused_with_what_to_do():
    x = np.array([[0.0, 1.0], [0.0, 1.0]])
    with pytest.raises(
        MisfitError, match=r"observation 2 of 2 follows from the ones before .* give observations a noise"
    ):
        condition(LATENTS, [observe("data", x, "strong", [[1.0, 1.0], [2.0, 2.0]], 0.0)])


def test_the_noise_that_a_refusal_asks_for_is_enough():
    x = np.zeros((60, 2))
    with pytest.raises(MisfitError) as refusal:
        condition(LATENTS, [observe("data", x, "strong", np.ones(60), 0.0)])
    noise = float(re.search(r"at least (\S+),", str(refusal.value))[1])
    found = condition(LATENTS, [observe("data", x, "strong", np.ones(60), noise)])
    assert found.mean("strong", x[:1])[0, 0] == pytest.approx(1.0, rel=1e-4)  # rounding grows with 1 / noise share


def test_constant_inputs_and_fewer_points_than_inputs_give_the_mean_of_the_data():
    found = condition(
        {"f": Latent(SquaredExponential(1e6, (1.0,) * 5))}, [observe("d", np.ones((3, 5)), "f", [1, 2, 6], 1)]
    )
    assert found.mean("f", np.ones((1, 5)))[0, 0] == pytest.approx(3.0, rel=1e-6)


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"inputs": [[1.0, np.nan]]}, r"wrist: inputs in row 1 is nan; leave out"),
        ({"values": [[np.inf, 1.0]]}, r"wrist: values in row 1 is inf"),
        ({"values": [[1.0], [2.0]]}, r"wrist: 1 rows of inputs and 2 rows of values"),
        ({"noise": -1.0}, r"wrist: noise = -1; expected standard deviations"),
        ({"noise": [1.0, 2.0]}, r"wrist: noise of shape \(2,\); expected a number or \(1,\)"),
        ({"of": {}}, r"wrist: no latent function"),
        ({"inputs": []}, r"wrist: inputs of shape \(0, 1\)"),
    ],
)
def test_a_bad_observation_is_refused_by_name(values, message):
    good = {"inputs": [[1.0, 2.0]], "of": "strong", "values": [[1.0, 2.0]], "noise": 0.1}
    with pytest.raises(MisfitError, match=message):
        observe("wrist", **{**good, **values})


def test_an_unknown_latent_function_is_refused_with_those_there_are(posterior):
    with pytest.raises(MisfitError, match="no latent function 'tendon'; there are 'statics', 'strong', 'weak'"):
        posterior.mean("tendon", QUERY)


def test_the_printed_form_with_one_function_is_the_joint_posterior():
    own = [data("own", 4, "strong", 0.1), data("seen", 3, {"strong": -0.4}, 0.2)]
    joint = condition(LATENTS, own).mean("strong", QUERY)
    for reading in ("raw", "residual", "sum"):
        found = condition_printed(LATENTS, own, "strong", reading).mean("strong", QUERY)
        assert np.allclose(found, joint, rtol=1e-12, atol=1e-14)


def test_the_printed_form_takes_a_correction_for_the_muscle_alone():
    x, a = np.array([[0.2, 0.4]]), 0.5
    seen = observe("seen", x, {"statics": -1.0, "strong": -a}, [[3.0, -1.0]], 0.3)
    found = condition_printed(LATENTS, [seen], "strong", "raw").mean("strong", x)
    assert np.allclose(found, [[-a * 1.5 * 3.0 / (a * a * 1.5 + 0.09), a * 1.5 / (a * a * 1.5 + 0.09)]], rtol=1e-12)
    total = condition_printed(LATENTS, [seen], "strong", "sum").mean("strong", x)
    assert np.allclose(total, -a * 1.5 / (2.0 + a * a * 1.5 + 0.09) * (np.array([[3.0, -1.0]]) + plane(x)), rtol=1e-12)


def test_the_residual_reading_takes_away_what_the_others_say_alone():
    x = np.array([[0.2, 0.4]])
    own = observe("statics", x, "statics", [[1.0, 2.0]], 1e-3)
    seen = observe("seen", x, {"statics": -1.0, "strong": -0.5}, [[3.0, -1.0]], 0.3)
    found = condition_printed(LATENTS, [own, seen], "strong", "residual").mean("strong", x)
    left = np.array([[3.0 + 1.0, -1.0 + 2.0]])
    assert np.allclose(found, -0.5 * 1.5 / (0.25 * 1.5 + 0.09) * left, rtol=1e-5)


@pytest.mark.parametrize(
    "kind", ["squared exponential", "matern 3/2", "matern 5/2", "sum with a plane", "product with a wave"]
)
def test_the_plain_problem_agrees_with_scikit_learn(kind):
    theirs_by = pytest.importorskip("sklearn.gaussian_process")
    k, x, y = theirs_by.kernels, RNG.normal(size=(15, 2)), RNG.normal(size=15)
    smooth, wave = SquaredExponential(1.5, (1.2, 0.7)), Periodic(1.0, (2.0,), (0.8,))
    pairs = {
        "squared exponential": (smooth, 1.5 * k.RBF([1.2, 0.7])),
        "matern 3/2": (Matern32(1.5, (1.2, 0.7)), 1.5 * k.Matern([1.2, 0.7], nu=1.5)),
        "matern 5/2": (Matern52(1.5, (1.2, 0.7)), 1.5 * k.Matern([1.2, 0.7], nu=2.5)),
        "sum with a plane": (
            smooth + Linear((0.3, 0.3)) + Constant(0.3),
            1.5 * k.RBF([1.2, 0.7]) + 0.3 * k.DotProduct(1.0),
        ),
        "product with a wave": (SquaredExponential(1.5, (1.2,)) * wave, 1.5 * k.RBF(1.2) * k.ExpSineSquared(0.8, 2.0)),
    }
    ours_by, kernel = pairs[kind]
    inputs = 1 if kind == "product with a wave" else 2
    theirs = theirs_by.GaussianProcessRegressor(kernel, alpha=0.04, optimizer=None).fit(x[:, :inputs], y)
    mean, deviation = theirs.predict(QUERY[:, :inputs], return_std=True)
    ours = condition({"f": Latent(ours_by)}, [observe("data", x[:, :inputs], "f", y, 0.2)])
    assert np.allclose(ours.mean("f", QUERY[:, :inputs])[:, 0], mean, rtol=1e-9, atol=1e-12)
    assert np.allclose(ours.variance("f", QUERY[:, :inputs]), deviation**2, rtol=1e-9)

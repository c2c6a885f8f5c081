"""Learning datum by datum against conditioning on all data at once."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fmus.errors import MisfitError
from orchestrator.gp.covariance import Latent, covariance
from orchestrator.gp.kernels import Constant, Matern52, SquaredExponential
from orchestrator.gp.observations import Observation, observe, stacked
from orchestrator.gp.online import Learner
from orchestrator.gp.posterior import condition

LATENTS = {
    "statics": Latent(SquaredExponential(2.0, (0.9, 1.6)), lambda x: 3.0 * x),
    "strong": Latent(Matern52(1.5, (1.2, 0.7))),
}
QUERY = np.random.default_rng(1).normal(size=(6, 2))


def mixed(rng: np.random.Generator, count: int = 30) -> list[Observation]:
    a = rng.uniform(size=count)
    return [
        observe("alone", rng.normal(size=(5, 2)), "strong", rng.normal(size=(5, 2)), 0.1),
        observe("both", rng.normal(size=(count, 2)), {"statics": -1.0, "strong": -a}, rng.normal(size=(count, 2)), 0.3),
    ]


def learnt(observations: list[Observation], budget: int = 60) -> Learner:
    learner = Learner(LATENTS, 2, 2, budget)
    for each in observations:
        learner.add(each)
    return learner


def check_equal(learner: Learner, observations: list[Observation]) -> None:
    one, other = learner.posterior(), condition(LATENTS, observations)
    for name in LATENTS:
        assert np.allclose(one.mean(name, QUERY), other.mean(name, QUERY), rtol=1e-9, atol=1e-11)
        assert np.allclose(one.variance(name, QUERY), other.variance(name, QUERY), rtol=1e-9)


def exact_information(observations: list[Observation]) -> np.ndarray:
    rows = stacked(observations)
    noise = np.concatenate([each.deviation for each in observations]) ** 2
    inverse = np.linalg.inv(covariance(LATENTS, rows, rows) + np.diag(noise))
    return 0.5 * np.log(1.0 / (np.diag(inverse) * noise))


def test_learning_one_by_one_is_learning_all_at_once():
    observations = mixed(np.random.default_rng(2))
    check_equal(learnt(observations), observations)


@settings(deadline=None, max_examples=15)
@given(seed=st.integers(0, 10**6), places=st.lists(st.integers(0, 14), max_size=10))
def test_forgetting_is_never_having_learnt(seed, places):
    observations = mixed(np.random.default_rng(seed), count=20)
    learner, kept = learnt(observations), list(range(25))
    for place in places:
        learner.forget(place)
        del kept[place]
    first, rest = [k for k in kept if k < 5], [k - 5 for k in kept if k >= 5]
    left = [each.rows(np.array(k)) for each, k in zip(observations, (first, rest), strict=True) if k]
    check_equal(learner, left)
    assert np.allclose(learner.information(), exact_information(left), rtol=1e-8, atol=1e-10)


def test_a_learner_without_data_knows_what_was_expected():
    found = Learner(LATENTS, 2, 2, 4).posterior()
    assert np.array_equal(found.mean("statics", QUERY), 3.0 * QUERY)
    assert np.array_equal(found.variance("strong", QUERY), np.full(6, 1.5))


def test_forgetting_all_is_having_no_data():
    learner = learnt(mixed(np.random.default_rng(3), count=3))
    for _ in range(8):
        learner.forget(0)
    assert learner.count == 0
    assert np.allclose(learner.posterior().mean("strong", QUERY), 0.0, atol=0.0)


def test_a_full_learner_forgets_the_least_informative_of_all():
    observations = mixed(np.random.default_rng(4), count=20)
    learner = Learner(LATENTS, 2, 2, budget=24, compresses=False)
    for each in (observations[0], observations[1].rows(np.arange(19))):
        learner.add(each)
    last = observations[1].rows(np.array([19]))
    least = int(np.argmin(exact_information(observations)))
    learner.add(last)
    kept = [k for k in range(25) if k != least]
    left = [
        observations[0].rows(np.array([k for k in kept if k < 5])),
        observations[1].rows(np.array([k - 5 for k in kept if k >= 5])),
    ]
    assert learner.count == 24
    check_equal(learner, left)


def test_data_that_say_nothing_are_forgotten_first():
    observations = mixed(np.random.default_rng(5), count=10)
    learner = learnt(observations, budget=15)
    learner.add(observe("nothing", QUERY, {"strong": 0.0}, np.ones((6, 2)), 0.1))
    check_equal(learner, observations)


def test_a_thousand_exchanges_leave_the_posterior_exact():
    rng = np.random.default_rng(6)
    learner, kept = Learner(LATENTS, 2, 2, 20), []
    for k in range(1000):
        datum = observe(
            "d", rng.normal(size=(1, 2)), {"statics": 1.0, "strong": rng.normal()}, rng.normal(size=(1, 2)), 0.1
        )
        if k >= 15:
            place = int(rng.integers(15))
            learner.forget(place)
            del kept[place]
        learner.add(datum)
        kept.append(datum)
    check_equal(learner, kept)
    assert np.allclose(learner.information(), exact_information(kept), rtol=1e-8)


def smooth(seed: int, count: int, noise: float = 0.2) -> tuple[dict[str, Latent], Observation, np.ndarray, np.ndarray]:
    """A function drawn from its prior over four inputs, `count` data of it, and 300 points with its values."""
    rng = np.random.default_rng(seed)
    latents = {"f": Latent(SquaredExponential(1.0, (2.0,) * 4))}
    x = rng.normal(size=(count + 300, 4))
    matrix = latents["f"].kernel(x, x) + 1e-9 * np.eye(len(x))
    f = np.linalg.cholesky(matrix) @ rng.normal(size=len(x))
    data = observe("f", x[:count], "f", f[:count] + noise * rng.normal(size=count), noise)
    return latents, data, x[count:], f[count:]


def test_a_full_learner_keeps_what_data_said_and_not_only_some_of_them():
    latents, data, at, truth = smooth(1, 1200)
    compressed, forgetting = Learner(latents, 4, 1, 60), Learner(latents, 4, 1, 60, compresses=False)
    for each in (compressed, forgetting):
        each.add(data)
    errors = [
        np.sqrt(np.mean((posterior.mean("f", at)[:, 0] - truth) ** 2))
        for posterior in (condition(latents, [data]), compressed.posterior(), forgetting.posterior())
    ]
    full, kept, forgotten = errors
    assert compressed.count == 60
    assert kept < 0.6 * forgotten  # 0.12 of 0.23, the data all together 0.08
    assert kept < 2.0 * full
    deviation = np.sqrt(compressed.posterior().variance("f", at))
    assert 0.8 < np.mean(np.abs(compressed.posterior().mean("f", at)[:, 0] - truth) < 1.645 * deviation) <= 1.0


def test_a_compressed_learner_is_exact_where_its_rows_say_all():
    """Of a function that is constant one row holds all data: the mean and deviation of the average."""
    latents = {"level": Latent(Constant(4.0))}
    rng = np.random.default_rng(3)
    values = 1.0 + 0.5 * rng.normal(size=50)
    learner = Learner(latents, 1, 1, 5)
    learner.add(observe("level", rng.normal(size=(50, 1)), "level", values, 0.5))
    precision = 50 / 0.25 + 1 / 4.0
    found = learner.posterior()
    assert found.mean("level", [[0.0]])[0, 0] == pytest.approx(values.sum() / 0.25 / precision, rel=1e-6)
    assert found.variance("level", [[0.0]])[0] == pytest.approx(1.0 / precision, rel=1e-3)


@pytest.mark.parametrize("budget", [20, 200])
def test_a_wild_value_moves_nothing_and_many_that_agree_are_learned(budget):
    latents, data, at, _ = smooth(2, 100)
    learner = Learner(latents, 4, 1, budget, gate=6.0)
    learner.add(data)
    before = learner.posterior().mean("f", at)
    learner.add(observe("wild", at[:1], "f", [[1e6]], 0.2))
    assert np.max(np.abs(learner.posterior().mean("f", at) - before)) < 1e-3
    assert learner.doubted == 1
    learner.add(observe("moved", np.tile(at[:1], (60, 1)), "f", np.full(60, 8.0), 0.2))
    assert learner.posterior().mean("f", at[:1])[0, 0] == pytest.approx(8.0, abs=0.5)


def test_a_compressed_learner_says_that_its_data_are_no_longer_apart():
    latents, data, _, _ = smooth(4, 30)
    learner = Learner(latents, 4, 1, 10)
    learner.add(data)
    with pytest.raises(MisfitError, match="forget: the learner is full and has compressed its data"):
        learner.forget(0)


def test_memory_stays_the_same_however_much_is_learnt():
    learner = Learner(LATENTS, 2, 2, 10)
    sizes = set()
    rng = np.random.default_rng(7)
    for _ in range(5):
        for each in mixed(rng, count=10):
            learner.add(each)
        sizes.add(sum(a.nbytes for a in vars(learner).values() if isinstance(a, np.ndarray)))
    assert len(sizes) == 1
    assert learner.count == 10


def test_a_posterior_does_not_change_when_its_learner_goes_on():
    observations = mixed(np.random.default_rng(8))
    learner = learnt(observations[:1])
    before = learner.posterior()
    mean = before.mean("strong", QUERY)
    learner.add(observations[1])
    learner.forget(0)
    assert np.array_equal(before.mean("strong", QUERY), mean)


def test_the_live_posterior_is_the_one_of_the_data_kept():
    observations = mixed(np.random.default_rng(10))
    learner = learnt(observations)
    live, kept = learner.live(), learner.posterior()
    for name in LATENTS:
        assert np.allclose(live.mean(name, QUERY), kept.mean(name, QUERY), rtol=1e-12)
        assert np.allclose(live.variance(name, QUERY), kept.variance(name, QUERY), rtol=1e-11)
    assert live.lower is learner.live().lower


def test_a_repeated_datum_without_noise_is_refused_and_changes_nothing():
    learner = learnt(mixed(np.random.default_rng(9)))
    exact = observe("exact", [[0.5, 0.5]], "strong", [[1.0, 2.0]], 0.0)
    learner.add(exact)
    mean = learner.posterior().mean("strong", QUERY)
    with pytest.raises(MisfitError, match="exact: the datum follows from the 36 before it .* give it a noise"):
        learner.add(exact)
    assert learner.count == 36
    assert np.array_equal(learner.posterior().mean("strong", QUERY), mean)


@pytest.mark.parametrize(
    ("observation", "message"),
    [
        (observe("d", [[1.0]], "strong", [[1.0, 2.0]], 0.1), "d has 1 inputs, the learner 2"),
        (observe("d", [[1.0, 2.0]], "strong", [1.0], 0.1), "d has 1 components, the learner 2"),
        (observe("d", [[1.0, 2.0]], "tendon", [[1.0, 2.0]], 0.1), "no latent function 'tendon'"),
    ],
)
def test_data_that_do_not_fit_are_refused(observation, message):
    with pytest.raises(MisfitError, match=message):
        Learner(LATENTS, 2, 2, 5).add(observation)


def test_wrong_budgets_and_places_are_refused():
    with pytest.raises(MisfitError, match="a budget of 0 observations"):
        Learner(LATENTS, 2, 2, 0)
    with pytest.raises(MisfitError, match="there is no datum 0 to forget; there are 0"):
        Learner(LATENTS, 2, 2, 1).forget(0)

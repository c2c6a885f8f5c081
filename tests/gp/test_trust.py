"""Posteriors that say how far they may be off, and data that are worse than they are said to be."""

from dataclasses import replace

import numpy as np
import pytest

from fmus.errors import MisfitError
from orchestrator.gp.check import coverage, left_out
from orchestrator.gp.covariance import Latent, covariance
from orchestrator.gp.fit import fit
from orchestrator.gp.kernels import SquaredExponential
from orchestrator.gp.noise import constant_noise, growing_noise
from orchestrator.gp.observations import Observation, Rows, observe
from orchestrator.gp.posterior import condition
from orchestrator.gp.robust import trusted
from orchestrator.gp.selection import informative

SIZES = {"statics": 20.0, "strong": 50.0, "weak": 3.0}  # N
LATENTS = {name: Latent(SquaredExponential(size**2, (0.7, 0.7))) for name, size in SIZES.items()}
GRID = np.random.default_rng(99).uniform(-1, 1, size=(100, 2))


class Bench:
    """A strong and a weak muscle beside statics, as random smooth functions, seen alone and in corrections."""

    def __init__(self, seed: int) -> None:
        self.rng = np.random.default_rng(seed)
        self._waves = {name: self._wave(size) for name, size in SIZES.items()}
        self.base = [self._alone(name) for name in SIZES]

    def _wave(self, size: float) -> tuple[np.ndarray, ...]:
        rng = self.rng
        return 1.5 * rng.normal(size=(2, 30)), rng.uniform(0, 6.28, 30), size / 15**0.5 * rng.normal(size=(30, 2))

    def truth(self, name: str, x: np.ndarray) -> np.ndarray:
        frequency, phase, amplitude = self._waves[name]
        return np.cos(x @ frequency + phase) @ amplitude

    def _alone(self, name: str) -> Observation:
        x = self.rng.uniform(-1, 1, size=(12, 2))
        return observe(name, x, name, self.truth(name, x) + 0.3 * self.rng.normal(size=(12, 2)), 0.3)

    def corrections(self, count: int) -> tuple[Observation, np.ndarray]:
        """Corrections without error, said to have a deviation of 1 N, and their force without it."""
        x, a = self.rng.uniform(-1, 1, size=(count, 2)), self.rng.uniform(size=(2, count))
        of = {"statics": -np.ones(count), "strong": -a[0], "weak": -a[1]}
        force = sum(c[:, None] * self.truth(name, x) for name, c in of.items())
        return observe("corrections", x, of, force, 1.0), force

    def improvement(self, observations: list[Observation]) -> dict[str, float]:
        """Share of the error over a grid that observations take away beside the base."""
        before, after = condition(LATENTS, self.base), condition(LATENTS, observations)
        return {name: 1.0 - self._error(after, name) / self._error(before, name) for name in SIZES}

    def _error(self, posterior, name: str) -> float:
        return float(np.sqrt(np.mean((posterior.mean(name, GRID) - self.truth(name, GRID)) ** 2)))


@pytest.fixture(scope="module")
def harmed() -> list[tuple[Bench, Observation]]:
    """Corrections of which a third is off by 20 N, all said to be good to 1 N."""
    found = []
    for seed in range(6):
        bench = Bench(seed)
        given, force = bench.corrections(150)
        spread = np.where(bench.rng.uniform(size=150) < 0.33, 20.0, 1.0)[:, None]
        found.append((bench, replace(given, values=force + spread * bench.rng.normal(size=force.shape))))
    return found


def test_understated_noise_of_corrections_harms_a_weak_function_and_trusted_noise_does_not(harmed):
    plain = [bench.improvement([*bench.base, seen]) for bench, seen in harmed]
    robust = [bench.improvement(list(trusted(LATENTS, [*bench.base, seen], ["corrections"]))) for bench, seen in harmed]
    assert np.median([each["weak"] for each in plain]) < -1.0
    assert np.median([each["weak"] for each in robust]) > 0.0
    assert min(each["weak"] for each in robust) > -0.25
    assert np.median([each["strong"] for each in robust]) > 0.5
    assert min(each["strong"] for each in robust) > 0.2


def test_few_informative_corrections_do_nearly_what_all_do_and_more_than_the_first_ones(harmed):
    gained: dict[str, list[float]] = {"all": [], "chosen": [], "first": []}
    for bench, seen in harmed:
        base, last = bench.base, trusted(LATENTS, [*bench.base, seen], ["corrections"])[-1]
        chosen = informative(LATENTS, base, last, 60)
        for name, rows in (("all", np.arange(150)), ("chosen", chosen), ("first", np.arange(60))):
            gained[name].append(float(np.mean(list(bench.improvement([*base, last.rows(rows)]).values()))))
    assert np.mean(gained["chosen"]) > np.mean(gained["all"]) - 0.05
    assert np.mean(gained["chosen"]) > np.mean(gained["first"]) + 0.05


def test_good_data_are_trusted_as_they_are_said_to_be():
    bench = Bench(7)
    given, force = bench.corrections(80)
    seen = replace(given, values=force + bench.rng.normal(size=force.shape))
    found = trusted(LATENTS, [*bench.base, seen], ["corrections"], freedom=1e6)
    assert np.allclose(found[-1].deviation, 1.0, atol=0.25)
    assert found[0] is bench.base[0]


@pytest.mark.parametrize("about", [(), ("weak",), ("strong", "weak")])
def test_each_datum_chosen_says_most_of_those_that_are_left(about):
    """Against entropies from dense covariances, step by step."""
    bench = Bench(8)
    given, _ = bench.corrections(12)
    seen = replace(given, noise=bench.rng.uniform(0.5, 5.0, 12))
    chosen = informative(LATENTS, bench.base, seen, 6, about)

    def entropy(places: list[int], known: tuple[str, ...]) -> float:
        kept = [*bench.base, seen.rows(np.array(places, dtype=int))] if places else bench.base
        inputs = np.vstack([each.inputs for each in kept])
        names = [name for name in SIZES if name not in known]
        parts = {
            n: np.concatenate([each.coefficients.get(n, np.zeros(len(each.inputs))) for each in kept]) for n in names
        }
        stacked = Rows(inputs, parts)
        noise = np.concatenate([each.deviation for each in kept]) ** 2
        return np.linalg.slogdet(covariance(LATENTS, stacked, stacked) + np.diag(noise))[1]

    everything = about or tuple(SIZES)
    for step in range(6):
        before = list(chosen[:step])
        says = [
            entropy([*before, k], ()) - entropy([*before, k], everything) if k not in before else -np.inf
            for k in range(12)
        ]
        assert says[chosen[step]] == pytest.approx(max(says), abs=1e-9)


def test_noisy_data_about_a_weak_function_come_last():
    bench = Bench(9)
    given, _ = bench.corrections(10)
    noise = np.where(np.arange(10) < 5, 50.0, 0.5)
    chosen = informative(LATENTS, bench.base, replace(given, noise=noise), 10, ("weak",))
    assert set(chosen[:5]) == set(range(5, 10))


def surprises(posterior, held_out):
    """Distance of new values from what is expected of them, (n, p), in standard deviations with their noise."""
    expected = posterior.mean(held_out.coefficients, held_out.inputs)
    variance = posterior.variance(held_out.coefficients, held_out.inputs) + held_out.deviation**2
    return (held_out.values - expected) / np.sqrt(variance)[:, None]


def test_left_out_is_what_all_others_say_of_a_datum():
    bench = Bench(3)
    given, force = bench.corrections(10)
    observations = [*bench.base, replace(given, values=force + bench.rng.normal(size=force.shape))]
    found = left_out(condition(LATENTS, observations))
    for place in (36, 41, 45):
        rest = np.delete(np.arange(10), place - 36)
        others = condition(LATENTS, [*bench.base, observations[-1].rows(rest)])
        assert np.allclose(found[place], surprises(others, observations[-1].rows(np.array([place - 36]))), rtol=1e-8)


def test_intervals_cover_held_out_corrections_whose_noise_grows_with_force():
    inside = []
    for seed in range(4):
        bench = Bench(20 + seed)
        given, force = bench.corrections(200)
        size = np.linalg.norm(force, axis=1)
        spread = 0.5 + 0.1 * size
        noisy = replace(given, values=force + spread[:, None] * bench.rng.normal(size=force.shape))
        # What a bench knows of the force is what the models without corrections expect.
        before = condition(LATENTS, bench.base)
        expected = np.linalg.norm(before.mean(given.coefficients, given.inputs), axis=1)
        noisy = replace(noisy, noise=growing_noise(1.0, expected, 5.0))
        train, test = noisy.rows(np.arange(110)), noisy.rows(np.arange(110, 200))
        best = fit(LATENTS, [*bench.base, train], starts=1)
        learnt = best.observations[-1].noise
        held_out = replace(test, noise=test.noise.with_weights(learnt.weights))
        inside.append(coverage(surprises(condition(best.latents, best.observations), held_out)))
    assert 0.80 <= np.mean(inside) <= 0.97
    assert min(inside) > 0.75


@pytest.mark.parametrize(
    ("action", "message"),
    [
        (lambda b, c: trusted(LATENTS, [*b, c], ["forces"]), "no observations 'forces'; there are 'statics', 'strong'"),
        (lambda b, c: trusted(LATENTS, [replace(c, noise=np.zeros(3))], ["corrections"]), "'corrections': noise of 0"),
        (lambda b, c: informative(LATENTS, b, c, 4), "corrections: 4 of 3 data to choose"),
        (lambda b, c: informative(LATENTS, b, c, 1, ("tendon",)), "no latent function 'tendon'"),
        (
            lambda b, c: informative(LATENTS, b, replace(c, noise=np.zeros(3)), 1),
            "corrections: noise of 0, which says all",
        ),
    ],
)
def test_what_cannot_be_chosen_or_trusted_is_told(action, message):
    bench = Bench(1)
    with pytest.raises(MisfitError, match=message):
        action(bench.base, bench.corrections(3)[0])


def test_without_a_base_the_prior_says_what_is_informative():
    given, _ = Bench(2).corrections(5)
    assert sorted(informative(LATENTS, [], given, 5)) == list(range(5))


def bad(kind: str) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(0)
    x = rng.uniform(-1, 1, size=(30, 2))
    y = np.sin(2 * x[:, 0]) + 0.05 * rng.normal(size=30)
    match kind:
        case "duplicates":
            return np.vstack([x, x[:10]]), np.concatenate([y, y[:10] + 0.05])
        case "constant values":
            return x, np.full(30, 3.0)
        case "fewer points than inputs":
            return rng.uniform(-1, 1, size=(3, 5)), np.array([1.0, 2.0, 3.0])
        case "inputs a million apart":
            return x * [1e6, 1e-6], y
        case _:
            return x, 1e6 * y


@pytest.mark.parametrize(
    "kind",
    ["duplicates", "constant values", "fewer points than inputs", "inputs a million apart", "values a million large"],
)
def test_odd_data_give_a_sound_fit_from_a_first_guess_that_knows_nothing_of_them(kind):
    x, y = bad(kind)
    latents = {"f": Latent(SquaredExponential(1.0, (1.0,) * x.shape[1]))}
    best = fit(latents, [observe("d", x, "f", y, constant_noise(0.1, len(x)))])
    posterior = condition(best.latents, best.observations)
    error = posterior.mean("f", x)[:, 0] - y
    assert np.isfinite(best.value)
    assert np.sqrt(np.mean(error**2)) < 0.15 * max(np.abs(y).max(), 1e-9)
    inside = np.abs(left_out(posterior)) < 3.0
    assert inside.mean() > 0.9

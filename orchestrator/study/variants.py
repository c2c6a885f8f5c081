"""Ways to learn from the same corrections: the exact joint posterior, what fails, and what goes beyond the study."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from orchestrator.gp.observations import Observation, observe
from orchestrator.gp.printed import Reading, condition_printed
from orchestrator.gp.robust import trusted
from orchestrator.gp.selection import informative
from orchestrator.study.conditioned import GRID, Conditioned, coefficients, given_bench, size_over_grid
from orchestrator.study.corrections import SENSOR_N, Corrections
from orchestrator.study.draws import Problem
from orchestrator.study.initial import Initial
from orchestrator.study.muscles import MUSCLES, capabilities
from orchestrator.study.noise_models import learn, refit

Array = NDArray[Any]
# A deviation that says nothing: beside it, no correction moves a prediction by more than 1e-8 of the force.
EXCLUDED_N = 1e6
SETTLED_RAD = 0.15


def clear_of_stops(corrections: Corrections) -> Array:
    """Mask of corrections during which no joint touched an end: there only the hand holds the arm, (n,)."""
    return ~corrections.at_stop


def settled(corrections: Corrections) -> Array:
    """Mask of those that in addition hardly moved, (n,)."""
    return clear_of_stops(corrections) & (corrections.moved < SETTLED_RAD)


def only(deviation: Array, kept: Array) -> Array:
    """Deviations of kept corrections in the places of `kept`, (n,) mask; others are excluded."""
    whole = np.full(len(kept), EXCLUDED_N)
    whole[kept] = deviation
    return whole


INFORMATIVE = 200


@dataclass(frozen=True, eq=False)
class Setting:
    """What a variant may use: models with and without joint speeds as inputs, and the corrections."""

    initial: Initial
    blind: Initial
    corrections: Corrections

    @cached_property
    def given(self) -> Conditioned:
        """The corrections given the bench data."""
        return given_bench(self.initial, self.corrections)

    @cached_property
    def learnt(self) -> tuple[Problem, float]:
        """All corrections with noise learnt from force, motion and stops, and its -log likelihood."""
        return _with_noise("observed", self.initial, self.corrections, self.given)

    @cached_property
    def freed(self) -> tuple[Problem, float]:
        """Those clear of the ends, less the force that motion took, noise learnt, and its -log likelihood."""
        corrections = self.corrections.compensated()
        return _learnt(self.initial, corrections, clear_of_stops(corrections))

    def initial_of(self, problem: Problem) -> Initial:
        """The models that a problem began with: those with as many inputs."""
        return self.blind if problem.initial.inputs == self.blind.inputs else self.initial


@dataclass(frozen=True, eq=False)
class Outcome:
    """Improvement of each muscle, (6,), by `used` corrections, as a share of the errors `before`, (6,) N.

    `value` is -log likelihood of these where noise was learnt, `coverage` the share of their components inside 90 % intervals
    predicted without their trial, `problem` what was solved where draws can be made of it.
    """

    improvement: Array
    before: Array
    used: int
    value: float | None = None
    coverage: float | None = None
    problem: Problem | None = None


def joint(setting: Setting) -> tuple[Problem, float]:
    """All corrections, noise learnt from force, motion and stops: the study's joint posterior as it should be."""
    return setting.learnt


def without_velocity(setting: Setting) -> tuple[Problem, float]:
    """The same with models that do not see joint speeds; noise learnt anew."""
    given = given_bench(setting.blind, setting.corrections)
    return _with_noise("observed", setting.blind, setting.corrections, given)


def one_noise(setting: Setting) -> tuple[Problem, float]:
    """One noise variance for all corrections."""
    return _with_noise("constant", setting.initial, setting.corrections, setting.given)


def force_noise(setting: Setting) -> tuple[Problem, float]:
    """Noise that grows with the predicted force only."""
    return _with_noise("force", setting.initial, setting.corrections, setting.given)


def clear(setting: Setting) -> tuple[Problem, float]:
    """Only corrections during which no joint touched an end, noise learnt."""
    return _learnt(setting.initial, setting.corrections, clear_of_stops(setting.corrections))


def settled_only(setting: Setting) -> tuple[Problem, float]:
    """Only corrections that hardly moved, away from the ends, noise learnt."""
    return _learnt(setting.initial, setting.corrections, settled(setting.corrections))


def compensated(setting: Setting) -> tuple[Problem, float]:
    """Clear of the ends, less the force that motion took, noise learnt."""
    return setting.freed


def shared(setting: Setting) -> tuple[Problem, float]:
    """All corrections, all muscles with the same hyperparameters (geometric means), noise learnt: a guess at the paper's model."""
    logs = [np.log(setting.initial.latents[name].kernel.values) for name in MUSCLES]
    values = np.exp(np.mean(logs, axis=0))
    latents = {
        name: replace(each, kernel=each.kernel.with_values(values)) if name in MUSCLES else each
        for name, each in setting.initial.latents.items()
    }
    initial = replace(setting.initial, latents=latents)
    return _with_noise("observed", initial, setting.corrections, given_bench(initial, setting.corrections))


def without_outliers(setting: Setting) -> tuple[Problem, float | None]:
    """All corrections, errors with Student's distribution; nothing else is looked at."""
    initial, seen = setting.initial, _observed(setting.corrections, np.full(len(setting.corrections), SENSOR_N))
    *_, believed = trusted(initial.latents, [*initial.observations, seen], [seen.name])
    return Problem(initial, setting.corrections, believed.deviation), None


def most_informative(setting: Setting) -> tuple[Problem, float]:
    """Of the compensated ones the 200 that say most."""
    problem, value = setting.freed
    usable = np.flatnonzero(problem.deviation < EXCLUDED_N)
    seen, initial = _observed(problem.corrections.rows(usable), problem.deviation[usable]), problem.initial
    chosen = informative(initial.latents, initial.observations, seen, min(INFORMATIVE, len(usable)))
    kept = np.isin(np.arange(len(problem.deviation)), usable[chosen])
    return Problem(problem.initial, problem.corrections, only(problem.deviation[kept], kept)), value


def refitted(setting: Setting) -> tuple[Problem, float]:
    """As compensated, with the hyperparameters of all subsystems fitted anew to bench data and corrections together."""
    corrections = setting.corrections.compensated()
    kept = clear_of_stops(corrections)
    chosen = corrections.rows(kept)
    found = refit(setting.initial, chosen, given_bench(setting.initial, chosen))
    deviation = found.observations[-1].deviation
    initial = replace(setting.initial, latents=found.latents)
    return Problem(initial, corrections, only(deviation, kept)), found.value


LEARNERS: dict[str, Callable[[Setting], tuple[Problem, float | None]]] = {
    "joint": joint,
    "without velocity": without_velocity,
    "one noise": one_noise,
    "force noise": force_noise,
    "shared hyperparameters": shared,
    "clear of stops": clear,
    "settled only": settled_only,
    "no outliers": without_outliers,
    "compensated": compensated,
    "informative 200": most_informative,
    "refitted": refitted,
}
READINGS: dict[str, Reading] = {"printed raw": "raw", "printed residual": "residual", "printed sum": "sum"}
VARIANTS = (*LEARNERS, *READINGS)


def outcome(name: str, setting: Setting) -> Outcome:
    """What a variant gains from all corrections."""
    if name in READINGS:
        return _printed(setting, READINGS[name])
    problem, value = LEARNERS[name](setting)
    given = given_bench(problem.initial, problem.corrections)
    errors = given.errors(problem.deviation, np.arange(len(problem.deviation)))
    before = given_bench(setting.initial_of(problem), setting.corrections.rows(np.arange(1))).before
    used = problem.deviation < EXCLUDED_N
    covered = given.rows(used).coverage(problem.deviation[used], setting.corrections.trial[used])
    return Outcome(1.0 - errors / before, before, int(used.sum()), value, covered, problem)


def _with_noise(kind: str, initial: Initial, corrections: Corrections, given: Conditioned) -> tuple[Problem, float]:
    found = learn(kind, given, corrections)
    return Problem(initial, corrections, found.noise.deviation), found.value


def _learnt(initial: Initial, corrections: Corrections, kept: Array) -> tuple[Problem, float]:
    chosen = corrections.rows(kept)
    found = learn("observed", given_bench(initial, chosen), chosen)
    return Problem(initial, corrections, only(found.noise.deviation, kept)), found.value


def _observed(corrections: Corrections, deviation: Array) -> Observation:
    """Corrections as data of all subsystems."""
    return observe("corrections", corrections.state, coefficients(corrections), corrections.force, deviation)


def _printed(setting: Setting, reading: Reading) -> Outcome:
    """The single-muscle form as printed, muscle by muscle, with the noise of the joint posterior."""
    problem, _ = setting.learnt
    corrections = _observed(setting.corrections, problem.deviation)
    true = capabilities(GRID, setting.initial.limb)
    before = given_bench(setting.initial, setting.corrections.rows(np.arange(1))).before
    after = []
    for place, muscle in enumerate(MUSCLES):
        observations = [*setting.initial.observations, corrections]
        mean = condition_printed(setting.initial.latents, observations, muscle, reading).mean(muscle, GRID)
        after.append(size_over_grid(mean - true[:, place]))
    return Outcome(1.0 - np.array(after) / before, before, len(problem.deviation))

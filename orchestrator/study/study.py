"""The whole study over several seeds: trials, initial models, all variants, thousands of draws."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from orchestrator.study.corrections import Corrections, collect
from orchestrator.study.design import Caregiver, draw_caregivers, draw_trials
from orchestrator.study.draws import SIZES, tasks
from orchestrator.study.initial import Initial, initial_models
from orchestrator.study.regression import Errors, errors_at
from orchestrator.study.researcher import SETS, measure
from orchestrator.study.variants import VARIANTS, Outcome, Setting, outcome
from orchestrator.study.work import digest, do_all
from orchestrator.work import Work


@dataclass(frozen=True)
class CollectTask:
    """All trials of a seed with so many caregivers of a median strength limit in N."""

    seed: int
    limit: float
    caregivers: int

    @property
    def key(self) -> str:
        """Content hash."""
        return digest(self)

    def run(self) -> Corrections:
        """The corrections, four a trial."""
        people = draw_caregivers(self.seed, Caregiver(limit=self.limit), self.caregivers)
        return collect(self.seed, draw_trials(self.seed, self.caregivers), people)


@dataclass(frozen=True)
class ModelsTask:
    """Initial models from so many holds at each position, with or without joint speeds as inputs."""

    seed: int
    holds: int
    velocity: bool

    @property
    def key(self) -> str:
        """Content hash."""
        return digest(self)

    def run(self) -> Initial:
        """The fitted models."""
        bench = measure(self.seed, self.holds)
        return initial_models(bench if self.velocity else {k: each.without_velocity() for k, each in bench.items()})


@dataclass(frozen=True, eq=False)
class OutcomeTask:
    """What every way to learn gains from all corrections of a setting."""

    setting: Setting

    @property
    def key(self) -> str:
        """Content hash."""
        return digest(self)

    def run(self) -> dict[str, Outcome]:
        """The outcomes by name."""
        return {name: outcome(name, self.setting) for name in VARIANTS}


Array = NDArray[Any]
Say = Callable[[str], None]
# Median of the caregivers' strength limits, N. The first was chosen on seeds that are not reported (docs/study.md) so that
# the error of corrections grows with the required force as the study found; the second is the hard case.
LIMITS = (140.0, 90.0)
# What is drawn 4096 times: variant and initial set.
GROWTHS = (("joint", "small"), ("joint", "full"), ("refitted", "small"))


@dataclass(frozen=True, eq=False)
class Case:
    """A variant of learning in one setting of one seed."""

    seed: int
    initial: str
    limit: float
    variant: str
    outcome: Outcome


@dataclass(frozen=True, eq=False)
class Growth:
    """Improvement by the number of corrections, one of `sizes`, (draws, sizes, 6), and with all of them, (6,)."""

    seed: int
    initial: str
    variant: str
    sizes: tuple[int, ...]
    improvement: Array
    whole: Array


@dataclass(frozen=True, eq=False)
class Study:
    """All that was found from `count` corrections a seed.

    `errors` by (seed, limit): at the actual state, and at the goal posture.
    """

    count: int
    seeds: tuple[int, ...]
    draws: int
    errors: dict[tuple[int, float], tuple[Errors, Errors]]
    cases: tuple[Case, ...]
    growths: tuple[Growth, ...]


def run_study(seeds: tuple[int, ...], draws: int, caregivers: int, work: Work, say: Say) -> Study:
    """Run the study for some seeds; every step may be done by many hands.

    Args:
        seeds: of the study, one run each.
        draws: draws of corrections for each number of them.
        caregivers: number of people.
        work: who does it.
        say: called with one line now and then.
    """
    places = [(seed, limit) for seed in seeds for limit in LIMITS]
    collected = dict(
        zip(places, _do(work, [CollectTask(*place, caregivers) for place in places], say, "trials"), strict=True)
    )
    kinds = [(seed, name, sees) for seed in seeds for name in SETS for sees in (True, False)]
    fits = [ModelsTask(seed, SETS[name], sees) for seed, name, sees in kinds]
    models = dict(zip(kinds, _do(work, fits, say, "initial models"), strict=True))
    settings = {
        (seed, name, limit): Setting(models[seed, name, True], models[seed, name, False], collected[seed, limit])
        for seed, limit in places
        for name in SETS
    }
    outcomes = _do(work, [OutcomeTask(setting) for setting in settings.values()], say, "ways to learn")
    cases = tuple(
        Case(*place, variant, found[variant])
        for place, found in zip(settings, outcomes, strict=True)
        for variant in VARIANTS
    )
    growths = tuple(
        _grown(case, draws, work, say)
        for case in cases
        if case.limit == LIMITS[0] and (case.variant, case.initial) in GROWTHS
    )
    count = len(next(iter(collected.values())))
    return Study(count, seeds, draws, {place: _errors(each) for place, each in collected.items()}, cases, growths)


def _errors(corrections: Corrections) -> tuple[Errors, Errors]:
    return errors_at(corrections, corrections.state), errors_at(corrections, corrections.goal)


def _grown(case: Case, draws: int, work: Work, say: Say) -> Growth:
    problem = case.outcome.problem
    assert problem is not None
    sizes = tuple(size for size in SIZES if size < len(problem.corrections))
    what = f"draws for seed {case.seed}, {case.variant}, {case.initial} initial set"
    errors = np.concatenate(_do(work, tasks(problem, sizes, draws, case.seed), say, what))
    improvement = 1.0 - errors / case.outcome.before
    return Growth(case.seed, case.initial, case.variant, sizes, improvement, case.outcome.improvement)


def _do(work: Work, todo: list[Any], say: Say, what: str) -> list[Any]:
    return do_all(work, todo, lambda done, total: say(f"{what}: {done} of {total}"))

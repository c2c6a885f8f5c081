"""The parts of the study as tasks: each holds all that it needs and gives the same numbers wherever it runs."""

from dataclasses import dataclass

from orchestrator.study.contents import digest
from orchestrator.study.corrections import Corrections, collect
from orchestrator.study.design import Caregiver, draw_caregivers, draw_trials
from orchestrator.study.initial import Initial, initial_models
from orchestrator.study.researcher import measure
from orchestrator.study.variants import VARIANTS, Outcome, Setting, outcome


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

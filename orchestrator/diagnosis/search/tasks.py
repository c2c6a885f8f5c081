"""Tasks of a search: fit a set, follow the trials with it, screen the candidates of a card; each holds all that it needs."""

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from orchestrator.blackbox.source import Source
from orchestrator.diagnosis.fit.candidates import EffectSet
from orchestrator.diagnosis.fit.evidence import LearningData, Refit, refit, with_nuisances
from orchestrator.diagnosis.fit.extensible import extensible, model_of
from orchestrator.diagnosis.fit.start_values import StartValues
from orchestrator.diagnosis.fit.thresholds import TOLERANCE
from orchestrator.diagnosis.search.screening import Explanation, Screener
from orchestrator.diagnosis.search.stretches import Followed, follow_stretches
from orchestrator.library.cards import Candidate
from orchestrator.models.estimation import Fit, Record
from orchestrator.work import Work, program_digest


@dataclass(frozen=True)
class Wanted:
    """A set to fit: `first` values of its parameters (k,), or rows of them, and of the nuisances.

    The fit ends when the misfit changes by less than the share `tolerance`; start values and clocks begin at those of an
    `earlier` one of the same set, or may begin where those of a set do that it is `near`; first values that are `settled`
    are those of a fit.
    """

    candidates: Sequence[Candidate]
    first: np.ndarray
    nuisances: np.ndarray
    tolerance: float = TOLERANCE
    earlier: Fit | None = None
    near: StartValues | None = None
    settled: bool = False


@dataclass(frozen=True)
class RefitTask:
    """Fit a set of candidates by free runs."""

    base: Source
    signals: tuple[str, ...]
    learning: LearningData
    wanted: Wanted

    @property
    def candidates(self) -> tuple[Candidate, ...]:
        """The effects of the set."""
        return tuple(self.wanted.candidates)

    @property
    def key(self) -> str:
        """Hash over model, effects, data, first values and program."""
        wanted = self.wanted
        begun = [] if wanted.earlier is None else [[wanted.earlier.shift], *wanted.earlier.starts]
        begun += [] if wanted.near is None else [[wanted.near.shift], *wanted.near.starts]
        settings = [wanted.tolerance, float(wanted.settled)]
        values = np.concatenate([wanted.first.ravel(), wanted.nuisances, settings, *begun])
        return _digest(self.base, self.candidates, self.signals, self.learning, values.tobytes())

    def run(self) -> tuple[Fit, tuple[Record, ...], int]:
        """The fit, the records as it saw them, and its integration steps in a sample."""
        wanted, effects = self.wanted, EffectSet(self.base, self.candidates, self.signals)
        found = refit(
            effects,
            self.learning,
            wanted.first,
            wanted.nuisances,
            tolerance=wanted.tolerance,
            earlier=wanted.earlier,
            near=wanted.near,
            settled=wanted.settled,
        )
        return found.fit, found.records, found.substeps


@dataclass(frozen=True)
class FollowTask:
    """Follow the trials with a fitted set over stretches of growing length."""

    base: Source
    signals: tuple[str, ...]
    learning: LearningData
    candidates: tuple[Candidate, ...]
    fit: Fit

    @property
    def key(self) -> str:
        """Hash over model, effects, data, fitted values and program."""
        return _digest(self.base, self.candidates, self.signals, self.learning, b"follow" + self.fit.values.tobytes())

    def run(self) -> Followed | None:
        """The last stretch that the set follows; None if not even the first."""
        effects = EffectSet(self.base, self.candidates, self.signals)
        return follow_stretches(Refit(effects, with_nuisances(effects, self.learning), (), self.fit, 1), self.learning)


@dataclass(frozen=True)
class ScreenTask:
    """Explain the correction residual by each candidate of one card."""

    base: Source
    signals: tuple[str, ...]
    learning: LearningData
    group: tuple[Candidate, ...]

    @property
    def key(self) -> str:
        """Hash over model, effects, data and program."""
        return _digest(self.base, self.group, self.signals, self.learning, b"screen")

    def run(self) -> list[Explanation]:
        """One explanation for each candidate."""
        same = _Same(_digest(self.base, (), self.signals, self.learning, b""), self)
        return _screener(same).explain(self.group)


@dataclass(frozen=True)
class _Same:
    """A task as a key: tasks of one search share their screener."""

    key: str
    task: ScreenTask

    def __hash__(self) -> int:
        return hash(self.key)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Same) and self.key == other.key


@lru_cache(maxsize=2)
def _screener(same: _Same) -> Screener:
    task = same.task
    return Screener(task.base, model_of(task.base, task.base.compile(), task.signals), task.learning)


def done_by(work: Work, base: Source, signals: Sequence[str], learning: LearningData, wanted: Wanted) -> Refit:
    """Refit a set of candidates, wherever the work is done.

    Args:
        work: who does it: this process or others.
        base: the model without effects.
        signals: outputs that it shows.
        learning: the trials in their metrics.
        wanted: the set, and where its fit begins.

    Raises:
        ComponentError: if the set cannot be simulated.
    """
    effects = EffectSet(base, wanted.candidates, signals)
    found, records, substeps = work.do(RefitTask(base, tuple(signals), learning, wanted))
    return Refit(effects, with_nuisances(effects, learning), records, found, substeps)


def _digest(
    base: Source, candidates: Sequence[Candidate], signals: Sequence[str], learning: LearningData, rest: bytes
) -> str:
    """SHA-256 over contents, which are the same in every process; pickled objects are not."""
    digest = hashlib.sha256(program_digest() + extensible(base).identity.encode())
    for candidate in candidates:
        digest.update(repr(candidate).encode() + candidate.card.class_text.encode())
    digest.update(repr(signals).encode() + learning.content + rest)
    return digest.hexdigest()

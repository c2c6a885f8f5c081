"""Who does the work of a search: this process, or a Dask cluster; and what is kept so that it can go on after a kill.

A task holds all that it needs, so it gives the same numbers wherever it runs. Results are kept by the content of the task
and of the program in a folder of the cache until the diagnosis is finished.
"""

import hashlib
import pickle
import shutil
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache, lru_cache
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from fmus.catalogue import ModelicaModel
from fmus.files import cache_folder, write_atomically
from fmus.frontend.compile import fingerprint
from orchestrator.cluster import client_of
from orchestrator.diagnosis.begun import Begun
from orchestrator.diagnosis.candidates import Candidate, EffectSet, as_fmu, model_of
from orchestrator.diagnosis.evidence import TOLERANCE, LearningData, Refit, refit, with_nuisances
from orchestrator.diagnosis.screening import Explanation, Screener
from orchestrator.diagnosis.stretches import Followed, follow_stretches
from orchestrator.models.estimation import Fit, Record


class Task(Protocol):
    """Something to compute, with all that it needs."""

    def run(self) -> Any:
        """Compute it; the same task gives the same result everywhere."""
        ...

    @property
    def key(self) -> str:
        """Content hash of all that the result depends on, the program included."""
        ...


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
    near: Begun | None = None
    settled: bool = False


@dataclass(frozen=True)
class RefitTask:
    """Fit a set of candidates by free runs."""

    base: ModelicaModel
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

    base: ModelicaModel
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

    base: ModelicaModel
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


class Work(Protocol):
    """Runs tasks one at a time for each caller; callers may be many threads."""

    def do(self, task: Task) -> Any:
        """Result of a task.

        Raises:
            ComponentError: if a model fails on the way.
        """
        ...

    @property
    def callers(self) -> int | None:
        """Threads that should call at a time, None for as many as the search likes."""
        ...


class Here:
    """Work in this process."""

    callers: int | None = None

    def do(self, task: Task) -> Any:
        """Run a task."""
        return task.run()


class Cluster:
    """Work on a Dask cluster.

    Raises:
        MisfitError: if Dask is not installed or no scheduler answers at the address.
    """

    callers: int | None = 64

    def __init__(self, address: str) -> None:
        self._client = client_of(address)

    def do(self, task: Task) -> Any:
        """Send a task to some worker and wait for it."""
        return self._client.submit(_run_alone, task, pure=False).result()

    def close(self) -> None:
        """Leave the cluster."""
        self._client.close()


def _run_alone(task: Task) -> Any:
    """Run a task on a worker, whose BLAS must not use threads of its own."""
    from threadpoolctl import threadpool_limits

    with threadpool_limits(limits=1, user_api="blas"):
        return task.run()


class Resumable:
    """Work that remembers finished tasks in a folder."""

    def __init__(self, inner: Work, folder: Path) -> None:
        self._inner, self._folder = inner, folder
        self.remembered = 0

    @property
    def callers(self) -> int | None:
        """As the inner work says."""
        return self._inner.callers

    def do(self, task: Task) -> Any:
        """Result of a task, from the folder if it was finished before."""
        file = self._folder / f"{task.key}.pickle"
        if file.is_file():
            self.remembered += 1
            return pickle.loads(file.read_bytes())
        result = self._inner.do(task)
        write_atomically(file, pickle.dumps(result))
        return result


@contextmanager
def resumable(name: str, scheduler: str | None = None) -> Iterator[Work]:
    """Work that goes on where an interrupted run with the same tasks stopped; forgotten once it ends well.

    Args:
        name: what the diagnosis is of; another name starts afresh.
        scheduler: address of a Dask scheduler, None for this process.
    """
    inner: Work = Here() if scheduler is None else Cluster(scheduler)
    folder = cache_folder("resume") / hashlib.sha256(name.encode()).hexdigest()[:24]
    try:
        yield Resumable(inner, folder)
    finally:
        if isinstance(inner, Cluster):
            inner.close()
    shutil.rmtree(folder, ignore_errors=True)


def done_by(work: Work, base: ModelicaModel, signals: Sequence[str], learning: LearningData, wanted: Wanted) -> Refit:
    """Refit a set of candidates, wherever the work is done."""
    effects = EffectSet(base, wanted.candidates, signals)
    found, records, substeps = work.do(RefitTask(base, tuple(signals), learning, wanted))
    return Refit(effects, with_nuisances(effects, learning), records, found, substeps)


def _digest(
    base: ModelicaModel, candidates: Sequence[Candidate], signals: Sequence[str], learning: LearningData, rest: bytes
) -> str:
    """SHA-256 over contents, which are the same in every process; pickled objects are not."""
    source = repr(base) if as_fmu(base) is not None else fingerprint(base.class_name, base.file)
    digest = hashlib.sha256(_program() + source.encode())
    for candidate in candidates:
        digest.update(repr(candidate).encode() + candidate.card.class_text.encode())
    digest.update(repr(signals).encode() + learning.content + rest)
    return digest.hexdigest()


@cache
def _program() -> bytes:
    root = Path(__file__).parents[1]
    files = sorted(path for pattern in ("**/*.py", "**/*.c", "**/*.toml", "**/*.mo") for path in root.glob(pattern))
    return hashlib.sha256(b"".join(path.read_bytes() for path in files)).digest()

"""A study on disk: a folder that is one Parquet data set, with what is needed to go on after an interruption.

    FOLDER/run=0/part.parquet     rows of a run; `run` and the varied values are columns of the data set
    FOLDER/_runs.parquet          one row a run: what was varied, how it ended, first and last values
    FOLDER/_study.json            what the study is of;  _done/0.json  what became of a run

Readers of data sets leave out names that begin with an underscore.
"""

import hashlib
import json
import shutil
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import as_completed
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from fmus.children import BrokenWorker, Workers
from fmus.errors import MisfitError
from fmus.files import write_atomically
from orchestrator.cluster import connected
from orchestrator.cosim.run import RunOptions
from orchestrator.cosim.sweep.grid import Case, Done, run_here, run_there, system_for
from orchestrator.cosim.system import System

Progress = Callable[[int, int], None]


@dataclass(frozen=True)
class StudyOutcome:
    """How a study ended: all runs in order, and how many of them had been done before."""

    runs: tuple[Done, ...]
    done_before: int

    @property
    def failed(self) -> tuple[Done, ...]:
        """Runs that failed."""
        return tuple(run for run in self.runs if run.failure)


@dataclass(frozen=True)
class Study:
    """What to run, and the folder for it."""

    system: System
    cases: Sequence[Case]
    options: RunOptions
    folder: Path

    def run(self, workers: int = 1, scheduler: str | None = None, progress: Progress | None = None) -> StudyOutcome:
        """Do all runs that are not done yet; runs that failed before are tried again.

        Args:
            workers: processes.
            scheduler: address of a Dask scheduler, instead of processes here.
            progress: is called with the number of runs done and of all runs.

        Raises:
            MisfitError: if the folder holds something else, or cannot be written.
        """
        self._check()
        self._open()
        before = {number: done for number, done in self._known().items() if not done.failure}
        missing = [case for case in self.cases if case.number not in before]
        found = dict(before)
        tell = progress or (lambda done, total: None)
        tell(len(found), len(self.cases))
        doing = self._on_cluster(missing, scheduler) if scheduler else self._in_processes(missing, workers)
        for done in doing:
            found[done.number] = done
            self._note(done)
            tell(len(found), len(self.cases))
        shutil.rmtree(self.folder / "_working", ignore_errors=True)
        runs = tuple(found[case.number] for case in self.cases)
        self._index(runs)
        return StudyOutcome(runs, len(before))

    def _check(self) -> None:
        """Raise MisfitError where not even the first run fits, before anything is written."""
        from orchestrator.cosim.connections import wire
        from orchestrator.cosim.kinds import describe

        first = system_for(self.system, self.cases[0])
        wire(first, {name: describe(spec, first.folder) for name, spec in first.components.items()})

    @property
    def key(self) -> str:
        """Hash of all that the results depend on: the system, the contents of its FMUs, the cases and the options."""
        from orchestrator.cosim.fmu import read_description

        parts = [repr(replace(self.system, folder=Path())), repr(list(self.cases)), repr(self.options.simulation)]
        files = [self.system.folder / spec.source for spec in self.system.components.values() if spec.kind == "fmu"]
        files += [Path(file) for file in sorted({file for case in self.cases for file in case.fmus.values()})]
        parts += [read_description(file).digest for file in files]
        return hashlib.sha256("\0".join(parts).encode()).hexdigest()

    def _open(self) -> None:
        note = self.folder / "_study.json"
        if self.folder.exists() and not note.exists() and (not self.folder.is_dir() or any(self.folder.iterdir())):
            raise MisfitError(f"{self.folder} exists and is no study; choose another --out")
        if note.exists() and json.loads(note.read_text()).get("key") != self.key:
            raise MisfitError(f"{self.folder} holds another study; delete it or choose another --out")
        try:
            (self.folder / "_working").mkdir(parents=True, exist_ok=True)
            about = {"schema": "misfit.sweep/1", "key": self.key, "system": self.system.name, "runs": len(self.cases)}
            write_atomically(note, json.dumps(about).encode())
        except OSError as error:
            raise MisfitError(f"{self.folder} cannot be written: {error.strerror}; choose another --out") from error

    def _known(self) -> dict[int, Done]:
        found = {}
        for file in (self.folder / "_done").glob("*.json"):
            done = Done(**json.loads(file.read_text()))
            found[done.number] = done
        return found

    def _note(self, done: Done) -> None:
        content = json.dumps(asdict(done), default=str)
        write_atomically(self.folder / "_done" / f"{done.number}.json", content.encode())

    def _in_processes(self, cases: Sequence[Case], workers: int) -> Iterator[Done]:
        if workers < 2 or len(cases) < 2:
            for case in cases:
                yield run_here(self.system, case, self.options, self.folder)
            return
        with Workers(min(workers, len(cases))) as pool:
            waiting = {pool.submit(run_here, self.system, case, self.options, self.folder): case for case in cases}
            apart = []
            for future in as_completed(waiting):
                try:
                    yield future.result()
                except (
                    BrokenWorker
                ):  # a trusted FMU took its process along; on its own, the failure is a row of the study
                    apart.append(waiting[future])
            options = replace(self.options, isolate=True)
            for future in as_completed([pool.submit(run_here, self.system, c, options, self.folder) for c in apart]):
                yield future.result()

    def _on_cluster(self, cases: Sequence[Case], scheduler: str) -> Iterator[Done]:
        with connected(scheduler) as client:
            from distributed import as_completed as completed

            system, files = _packed(self.system)
            shipped = client.scatter(files, broadcast=True, hash=False)
            futures = [client.submit(run_there, system, shipped, case, self.options, pure=False) for case in cases]
            for future in completed(futures, loop=client.loop):
                done, content = future.result()
                if content is not None:
                    write_atomically(self.folder / f"run={done.number}" / "part.parquet", content)
                yield done

    def _index(self, runs: Sequence[Done]) -> None:
        """Write the table of runs."""
        import pyarrow as pa
        import pyarrow.parquet as pq

        rows: list[dict[str, Any]] = []
        numeric = {name for name in self.cases[0].numbers if all(name in case.numbers for case in self.cases)}
        for case, run in zip(self.cases, runs, strict=True):
            row: dict[str, Any] = {"run": run.number, **case.words}
            row |= {name: value for name, value in case.numbers.items() if name in numeric}
            row |= {"rows": run.rows, "end_s": run.end, "seconds": run.seconds, "failure": run.failure}
            for name, values in run.signals.items():
                row |= {f"{name}.{what}": values[what] for what in ("last", "min", "max")}
            rows.append(row)
        names = dict.fromkeys(name for row in rows for name in row)
        table = pa.table({name: [row.get(name) for row in rows] for name in names})
        pq.write_table(table, self.folder / "_runs.parquet")


def _packed(system: System) -> tuple[System, dict[str, bytes]]:
    """The system with its FMUs named by content, and the contents."""
    files, components = {}, {}
    for name, spec in system.components.items():
        if spec.kind == "fmu":
            content = (system.folder / spec.source).read_bytes()
            source = f"{hashlib.sha256(content).hexdigest()}.fmu"
            files[source] = content
            spec = replace(spec, source=source)
        components[name] = spec
    return replace(system, components=components), files

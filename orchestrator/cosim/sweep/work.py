"""One run of a study, wherever it is done: here, in a process, or on a cluster."""

import tempfile
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fmus.errors import MisfitError
from fmus.files import cache_folder, write_atomically
from orchestrator.cosim.run import RunOptions, run_system
from orchestrator.cosim.summary import SummaryRecorder
from orchestrator.cosim.sweep.grid import Case, system_for
from orchestrator.cosim.system import System
from orchestrator.results.column import Column
from orchestrator.results.recorder import Recorder, recorder_for


@dataclass(frozen=True)
class Done:
    """What became of a run: rows, simulated time at its end in s, seconds it took, its signals in brief, why it failed."""

    number: int
    rows: int
    end: float
    seconds: float
    signals: Mapping[str, Mapping[str, Any]]
    failure: str = ""


class _WithCase:
    """Adds the values of the case as columns, so that the data set can be asked for them."""

    def __init__(self, onward: Recorder, case: Case) -> None:
        self._onward, self._case = onward, case
        self._added: NDArray[np.float64] = np.zeros(0)

    def begin(self, columns: Sequence[Column], provenance: Mapping[str, Any]) -> None:
        taken = {column.name for column in columns}
        numbers = {name: value for name, value in self._case.numbers.items() if name not in taken}
        self._added = np.array(list(numbers.values()))
        units = {name: text.partition(" ")[2] for name, text in self._case.values.items()}
        added = [Column(name, units.get(name, "")) for name in numbers]
        self._onward.begin([*columns, *added], {**provenance, "run": self._case.number, "varied": self._case.words})

    def rows(self, times: NDArray[np.float64], values: NDArray[np.float64]) -> None:
        added = np.broadcast_to(self._added, (len(times), len(self._added)))
        self._onward.rows(times, np.hstack([values, added]))

    def finish(self, failure: str = "") -> None:
        self._onward.finish(failure)


def run_case(system: System, case: Case, options: RunOptions, target: Path) -> Done:
    """Run a case into a file; a failure of the model is part of the answer."""
    began = time.perf_counter()
    summary = SummaryRecorder(_WithCase(recorder_for(target), case))
    end, failure = float("nan"), ""
    try:
        outcome = run_system(system_for(system, case), summary, options)
        end = outcome.end
    except MisfitError as error:
        failure = str(error)
    return Done(case.number, summary.count, end, time.perf_counter() - began, summary.to_json(), failure)


def run_here(system: System, case: Case, options: RunOptions, folder: Path) -> Done:
    """Run a case into the folder of a data set; its file appears there when it is complete."""
    working = folder / "_working" / f"{case.number:06d}.parquet"
    done = run_case(system, case, options, working)
    if working.exists():
        place = folder / f"run={case.number}" / "part.parquet"
        place.parent.mkdir(exist_ok=True)
        working.replace(place)
    return done


def run_there(system: System, files: Mapping[str, bytes], case: Case, options: RunOptions) -> tuple[Done, bytes | None]:
    """Run a case on a machine that has the FMUs in a message only; gives the result file back."""
    folder = cache_folder("cluster")
    for name, content in files.items():
        if not (folder / name).exists():
            write_atomically(folder / name, content)
    with tempfile.TemporaryDirectory(prefix="misfit-run-") as work:
        target = Path(work) / "run.parquet"
        done = run_case(replace(system, folder=folder), case, options, target)
        return done, target.read_bytes() if target.exists() else None

"""The runs of a study: every combination of the values, seeds and FMUs that were given."""

import re
import tempfile
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fmus.errors import MisfitError
from fmus.files import cache_folder, write_atomically
from orchestrator.cosim.kinds import describe
from orchestrator.cosim.run import RunOptions, run_system
from orchestrator.cosim.summary import SummaryRecorder
from orchestrator.cosim.system import System, Value
from orchestrator.results.column import Column
from orchestrator.results.recorder import Recorder, recorder_for

_RANGE = re.compile(r"(linspace|logspace)\(([^,()]+),([^,()]+),([^,()]+)\)\s*(.*)")
_NUMBER = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)")
MOST_RUNS = 1_000_000
SEEDS = ("seed", "fixedseed", "randomseed")


@dataclass(frozen=True)
class Case:
    """One run: its number, values by address as text with units, the seed, and FMUs by component."""

    number: int
    values: Mapping[str, str] = field(default_factory=dict)
    seed: int | None = None
    fmus: Mapping[str, str] = field(default_factory=dict)

    @property
    def numbers(self) -> dict[str, float]:
        """What can be a column of numbers: values without their units, and the seed."""
        found = {name: float(match[1]) for name, text in self.values.items() if (match := _NUMBER.match(text))}
        return found if self.seed is None else {**found, "seed": float(self.seed)}

    @property
    def words(self) -> dict[str, str]:
        """All that was varied, as text."""
        seed = {} if self.seed is None else {"seed": str(self.seed)}
        return {**self.values, **seed, **self.fmus}


def parse_values(text: str) -> list[str]:
    """Values of `a,b,c`, `linspace(first,last,count)` or `logspace(first,last,count)`, each with the unit behind it.

    `logspace` divides the way from first to last into equal factors.

    Raises:
        MisfitError: if a range has no numbers, no positive count, or a list has an empty place.

    Example:
        >>> parse_values("linspace(0, 2, 3) mm")
        ['0.0 mm', '1.0 mm', '2.0 mm']
        >>> parse_values("1 kg, 2 kg")
        ['1 kg', '2 kg']
        >>> parse_values("logspace(1, 100, 3)")
        ['1.0', '10.0', '100.0']
    """
    found = _RANGE.fullmatch(text.strip())
    if found is None:
        parts = [part.strip() for part in text.split(",")]
        if "" in parts or "(" in text:
            why = "an empty place" if "" in parts else "a range that cannot be read"
            raise MisfitError(f"values {text!r}: {why}; expected a,b,c or linspace(first,last,count)")
        return parts
    kind, first, last, count, unit = found.groups()
    try:
        low, high, number = float(first), float(last), int(count)
        if number < 1 or (kind == "logspace" and not (low > 0 and high > 0)):
            raise ValueError
    except ValueError:
        raise MisfitError(
            f"values {text!r}: expected {kind}(first,last,count) with a count of 1 or more"
            + (" and positive ends" if kind == "logspace" else "")
        ) from None
    grid = np.linspace(low, high, number) if kind == "linspace" else np.geomspace(low, high, number)
    return [f"{float(value)!r} {unit}".strip() for value in grid]


def cases_of(
    values: Mapping[str, Sequence[str]], seeds: Sequence[int] = (), fmus: Mapping[str, Sequence[str]] | None = None
) -> list[Case]:
    """Every combination; what was named first changes slowest.

    Args:
        values: values, as text, of each variable.
        seeds: seeds of each combination.
        fmus: files that a component may have, by component.

    Raises:
        MisfitError: if there are more than a million.

    Example:
        >>> [case.words for case in cases_of({"a.x": ["1", "2"]}, seeds=[7])]
        [{'a.x': '1', 'seed': '7'}, {'a.x': '2', 'seed': '7'}]
    """
    swaps = dict(fmus or {})
    axes: list[Sequence[str | int | None]] = [*swaps.values(), *values.values(), list(seeds) or [None]]
    count = int(np.prod([len(axis) for axis in axes], dtype=float))
    if count > MOST_RUNS:
        raise MisfitError(f"the study would have {count} runs; the limit is {MOST_RUNS}, give fewer values")
    found = []
    for number, combination in enumerate(product(*axes)):
        *texts, seed = combination
        names = dict(zip([*swaps, *values], map(str, texts), strict=True))
        given = {name: names[name] for name in values}
        chosen = {name: names[name] for name in swaps}
        found.append(Case(number, given, int(seed) if seed is not None else None, chosen))
    return found


def seed_addresses(system: System) -> list[str]:
    """Parameters that seed random numbers: those called seed, fixedSeed or randomSeed.

    Raises:
        MisfitError: if no component has one.
    """
    found = [
        f"{name}.{port.name}"
        for name, spec in system.components.items()
        for port in describe(spec, system.folder).ports
        if port.name.rpartition(".")[2].lower() in SEEDS and port.causality in ("parameter", "structuralParameter")
    ]
    if not found:
        raise MisfitError(
            f"--seeds: no component of {system.name!r} has a parameter called seed; use --set COMP.VAR=..."
        )
    return found


def system_for(system: System, case: Case) -> System:
    """The system with the values, seed and FMUs of a case.

    Raises:
        MisfitError: if a value, component or FMU does not fit.
    """
    from orchestrator.cosim.swap import swap

    for name, file in case.fmus.items():
        found = swap(system, name, Path(file))
        if found.system is None or found.report.questions:
            why = (*found.report.problems, "similar names; make a system file for it")[0]
            raise MisfitError(f"swap of {name} by {file} cannot work: {why}")
        system = found.system
    values = {address: Value(text) for address, text in case.values.items()}
    if case.seed is not None:
        values |= {address: Value(case.seed) for address in seed_addresses(system)}
    return system.with_values(values)


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
    """Run a case into a file; a failure of the model is part of the answer.

    Args:
        system: the system.
        case: what is different.
        options: of the run.
        target: the result file, whose ending says its format.
    """
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
    """Run a case into the folder of a data set; its file appears there when it is complete.

    Args:
        system: the system.
        case: what is different.
        options: of the run.
        folder: of the data set.
    """
    working = folder / "_working" / f"{case.number:06d}.parquet"
    done = run_case(system, case, options, working)
    if working.exists():
        place = folder / f"run={case.number}" / "part.parquet"
        place.parent.mkdir(exist_ok=True)
        working.replace(place)
    return done


def run_there(system: System, files: Mapping[str, bytes], case: Case, options: RunOptions) -> tuple[Done, bytes | None]:
    """Run a case on a machine that has the FMUs in a message only; gives the result file back.

    Args:
        system: the system.
        files: the FMUs by name.
        case: what is different.
        options: of the run.

    Returns:
        How it ended, and the result file; None if there is none.
    """
    folder = cache_folder("cluster")
    for name, content in files.items():
        if not (folder / name).exists():
            write_atomically(folder / name, content)
    with tempfile.TemporaryDirectory(prefix="misfit-run-") as work:
        target = Path(work) / "run.parquet"
        done = run_case(replace(system, folder=folder), case, options, target)
        return done, target.read_bytes() if target.exists() else None

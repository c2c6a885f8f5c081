"""Results over time: a folder with a Parquet file for each run, written once and never changed, and how the runs compare."""

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from typing import Any

from fmus.errors import MisfitError
from fmus.files import write_atomically
from orchestrator.regress.outcome import Outcome, plain
from orchestrator.report.html import render
from orchestrator.report.page import Page, PageTable, Picture, Section
from orchestrator.report.summary import Fact

COLUMNS = {
    "run": "string",  # when it was made, UTC, to the microsecond
    "case": "string",
    "file": "string",
    "verdict": "string",
    "signal": "string",  # "" in the row of the case itself and of checks of the whole model
    "check": "string",
    "passed": "bool",
    "exceed": "double",  # worst error over tolerance
    "would_have_passed": "double",
    "event_shift_s": "double",
    "cpu_seconds": "double",
    "model_sha256": "string",
    "reason": "string",
    "misfit": "string",
}


@dataclass(frozen=True)
class Entry:
    """One row of the history, see `COLUMNS`."""

    values: dict[str, Any]

    def __getattr__(self, name: str) -> Any:
        """The value of a column."""
        try:
            return self.values[name]
        except KeyError:
            raise AttributeError(name) from None


def append(folder: Path, outcomes: Sequence[Outcome], now: datetime | None = None) -> Path:
    """Write the outcomes of a run as a new file of the folder: a row for each case, and one for each check.

    Args:
        folder: the history.
        outcomes: of all cases of the run.
        now: when it was; this moment by default.

    Returns:
        The new file.

    Raises:
        MisfitError: if the folder cannot be written.
    """
    import io

    import pyarrow as pa
    import pyarrow.parquet as pq

    moment = now or datetime.now(UTC)
    rows = [row for outcome in outcomes for row in _rows(outcome)]
    common = {"run": moment.isoformat(timespec="microseconds"), "misfit": version("misfit-fmu")}
    schema = pa.schema(
        [
            (name, getattr(pa, {"double": "float64", "bool": "bool_"}.get(kind, kind))())
            for name, kind in COLUMNS.items()
        ]
    )
    table = pa.Table.from_pylist([{**dict.fromkeys(COLUMNS), **common, **row} for row in rows], schema=schema)
    buffer = io.BytesIO()
    pq.write_table(table, buffer)
    path = folder / f"{moment.strftime('%Y%m%dT%H%M%S%f')}-{os.getpid()}.parquet"
    try:
        if path.exists():
            raise MisfitError(f"{path} exists; a run that is written is never changed")
        write_atomically(path, buffer.getvalue())
    except OSError as error:
        raise MisfitError(f"{folder} cannot be written: {error.strerror}; choose another --history") from error
    return path


def read(folder: Path) -> list[Entry]:
    """All rows, the oldest run first.

    Raises:
        MisfitError: if there is no history, or a file of it cannot be read.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    files = sorted(folder.glob("*.parquet"))
    if not files:
        raise MisfitError(f"{folder} holds no history; misfit regress --history {folder} begins one")
    found = []
    for file in files:
        try:
            rows = pq.read_table(file).to_pylist()
        except (pa.ArrowException, OSError) as error:
            raise MisfitError(
                f"{file} cannot be read: {' '.join(str(error).split())}; take it out of the folder"
            ) from error
        found += [Entry({**dict.fromkeys(COLUMNS), **row}) for row in rows]
    return sorted(found, key=lambda entry: entry.run)


def _rows(outcome: Outcome) -> list[dict[str, Any]]:
    common: dict[str, Any] = {
        "case": outcome.name,
        "file": outcome.file,
        "verdict": outcome.verdict,
        "model_sha256": outcome.model_sha256,
        "cpu_seconds": outcome.seconds,
        "signal": "",
        "check": "",
    }
    rows = [{**common, "passed": outcome.verdict == "passed", "reason": outcome.reason}]
    for verdict in outcome.signals:
        names = ("check", "passed", "exceed", "would_have_passed", "event_shift_s", "reason")
        rows.append({**common, "signal": verdict.name, **{name: getattr(verdict, name) for name in names}})
    for whole in outcome.wholes:
        rows.append({**common, "check": whole.check, "passed": whole.passed, "reason": whole.reason})
    return rows


SCHEMA = "misfit.regress.trend/1"
_MOST_PICTURES = 40
# A signal this much nearer to its limit than at first is drifting.
_DRIFT = 0.25


@dataclass(frozen=True)
class Line:
    """A check of a signal over the runs: worst error over tolerance in each, None where it was not made."""

    case: str
    signal: str
    check: str
    exceed: tuple[float | None, ...]

    @property
    def drift(self) -> float:
        """How much nearer to the limit (1) the last run is than the first."""
        known = [x for x in self.exceed if x is not None]
        return known[-1] - known[0] if len(known) > 1 else 0.0

    @property
    def highest(self) -> float:
        """The nearest to the limit, or the farthest above it."""
        return max((x for x in self.exceed if x is not None), default=0.0)


@dataclass(frozen=True)
class Trend:
    """Everything over time: `runs` are moments in UTC, oldest first."""

    runs: tuple[str, ...]
    verdicts: Mapping[str, tuple[str, ...]]
    seconds: Mapping[str, tuple[float | None, ...]]
    lines: tuple[Line, ...]

    @property
    def drifting(self) -> tuple[Line, ...]:
        """Signals that pass but come nearer to their limits, the worst first."""
        found = [line for line in self.lines if line.drift > _DRIFT and (line.exceed[-1] or 0.0) <= 1.0]
        return tuple(sorted(found, key=lambda line: -line.drift))

    def to_json(self) -> Any:
        """The trend as plain data."""
        lines = [{**vars(line), "exceed": list(line.exceed), "drift": line.drift} for line in self.lines]
        cases = {n: {"verdicts": list(v), "cpu_seconds": list(self.seconds[n])} for n, v in self.verdicts.items()}
        drifting = [f"{line.case}: {line.signal}" for line in self.drifting]
        found = {"schema": SCHEMA, "runs": list(self.runs), "cases": cases, "signals": lines, "drifting": drifting}
        return plain(found)


def trend_of(entries: Sequence[Entry]) -> Trend:
    """Sort the rows of a history by case and signal."""
    runs = tuple(dict.fromkeys(entry.run for entry in entries))
    place = {run: k for k, run in enumerate(runs)}
    verdicts: dict[str, list[str]] = {}
    seconds: dict[str, list[float | None]] = {}
    lines: dict[tuple[str, str, str], list[float | None]] = {}
    for entry in entries:
        k = place[entry.run]
        if entry.signal:
            line = lines.setdefault((entry.case, entry.signal, entry.check), [None] * len(runs))
            line[k] = entry.exceed
        elif not entry.check:
            verdicts.setdefault(entry.case, [""] * len(runs))[k] = entry.verdict
            seconds.setdefault(entry.case, [None] * len(runs))[k] = entry.cpu_seconds
    return Trend(
        runs,
        {name: tuple(values) for name, values in verdicts.items()},
        {name: tuple(values) for name, values in seconds.items()},
        tuple(Line(*names, tuple(values)) for names, values in lines.items()),
    )


def trend_page(trend: Trend, where: str) -> str:
    """The trend as one HTML file."""
    last = {name: next((v for v in reversed(values) if v), "") for name, values in trend.verdicts.items()}
    wrong = [name for name, verdict in last.items() if verdict != "passed"]
    runs = f"{len(trend.runs)} run{'s' if len(trend.runs) > 1 else ''}"
    outcome = f"{len(wrong)} of {len(last)} did not pass at last" if wrong else "all passed at last"
    verdict = f"{len(last)} case{'s' if len(last) > 1 else ''} over {runs}: {outcome}"
    drifting = tuple(f"{x.case}: {x.signal} came nearer to its limit, {_row(x.exceed)}" for x in trend.drifting)
    rows = tuple(
        (name, last[name], _marks(values), _row(trend.seconds[name], 3)) for name, values in trend.verdicts.items()
    )
    table = PageTable("Cases, oldest run first", ("case", "last", "verdicts", "CPU seconds"), rows)
    signals = tuple((x.case, x.signal, x.check, _row(x.exceed)) for x in trend.lines)
    headings = ("case", "signal", "check", "worst error / tolerance, oldest run first")
    sections = (
        Section("Drifting", drifting, warns=True),
        Section("Cases", tables=(table,)),
        Section("Pictures", pictures=_pictures(trend)),
        Section("Signals", tables=(PageTable("Signals", headings, signals),)),
        Section("Provenance", pairs=(("history", where), ("first run", trend.runs[0]), ("last run", trend.runs[-1]))),
    )
    facts = (
        Fact("Cases", str(len(last)), f"over {runs}"),
        Fact("Did not pass at last", str(len(wrong)), ", ".join(wrong[:3]), "bad" if wrong else "good"),
        Fact("Drifting", str(len(trend.drifting)), "signals that come nearer to their limits"),
    )
    return render(Page("Regression tests over time", verdict, None, sections, facts=facts))


def _pictures(trend: Trend) -> tuple[Picture, ...]:
    """A picture for each case, those nearest to a limit first."""
    from orchestrator.regress.page import trend_figure

    cases: dict[str, list[Line]] = {}
    for line in trend.lines:
        cases.setdefault(line.case, []).append(line)
    order = sorted(cases, key=lambda name: -max(line.highest for line in cases[name]))
    return tuple(
        Picture(
            trend_figure(name, [(x.signal, x.exceed) for x in cases[name]]), f"{name}: worst error / tolerance by run"
        )
        for name in order[:_MOST_PICTURES]
    )


def _marks(values: Sequence[str]) -> str:
    return "".join({"passed": "·", "failed": "F", "error": "E"}.get(value, " ") for value in values)


def _row(values: Sequence[float | None], digits: int = 2) -> str:
    shown = values[-12:]
    text = ", ".join("-" if value is None else f"{value:.{digits}g}" for value in shown)
    return f"..., {text}" if len(values) > len(shown) else text

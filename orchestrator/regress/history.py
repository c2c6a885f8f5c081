"""Results over time: a folder with a Parquet file for each run, which is written once and never changed."""

import os
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from typing import Any

from fmus.errors import MisfitError
from fmus.files import write_atomically
from orchestrator.regress.outcome import Outcome

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

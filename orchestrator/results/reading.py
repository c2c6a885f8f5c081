"""Reading results and measurements back, whatever the format."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from fmus.errors import MisfitError
from orchestrator.results.formats import Content, format_of
from orchestrator.results.result import Result


def read_columns(path: Path, wanted: Sequence[str] | None = None) -> tuple[Content, bool]:
    """Numeric columns of a file, and whether it is complete; also of one that a run is writing or left when it was killed.

    Raises:
        MisfitError: if the file cannot be read; says what to do.
    """
    chosen = format_of(path)
    unfinished = path.with_name(path.name + ".unfinished")
    if unfinished.exists():
        from orchestrator.results.file_recorder import finish_abandoned
        from orchestrator.results.journal import read_journal

        finish_abandoned(path)
        try:
            with unfinished.open("rb") as file:
                return read_journal(file, path, wanted), False
        except FileNotFoundError:
            pass  # it has just been finished
    if not path.exists():
        raise MisfitError(f"{path} does not exist; expected a file of results")
    return chosen.read(path, wanted), True


def read_result(path: str | Path, columns: Sequence[str] | None = None) -> Result:
    """Read a result that `misfit run` wrote, or any table with a column `time` in s.

    Args:
        path: .parquet, .csv, .h5 or .mf4. If the run that writes it goes on, what is there is read; if it was killed,
            its side file is made into a proper file first.
        columns: names to read; all if None.

    Raises:
        MisfitError: if there is no such file, or it holds no column `time`.
    """
    path = Path(path)
    content, complete = read_columns(path, None if columns is None else ["time", *columns])
    arrays = dict(content.arrays)
    time = arrays.pop("time", None)
    if time is None:
        raise MisfitError(f"{path} has no column 'time'; columns are {', '.join(list(arrays)[:8])}")
    header = content.header
    kept = tuple(column for column in header.columns if column.name != "time")
    time = np.asarray(time, dtype=float)
    return Result(time, kept, arrays, header.provenance, header.failure, complete and not header.failure)

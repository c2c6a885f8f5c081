"""A csv file as numbers under column names, or the line on which it is none."""

import csv
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from fmus.errors import MisfitError
from orchestrator.measurements.trial import Array
from orchestrator.measurements.wording import listed, shown
from orchestrator.results.result import read_columns

# Beyond this a cell is a marker for "no value" or damage, and arithmetic on it would overflow.
_LARGEST = 1e100


@dataclass(frozen=True, eq=False)
class Table:
    """Cells of a file: `values` has shape (n_rows, n_names); row i stands on line `lines[i]`.

    `units` and `frame` hold what the file itself says, which a csv file does not; `notes` what was changed in reading it.
    """

    path: Path
    names: tuple[str, ...]
    values: Array
    lines: tuple[int, ...]
    units: Mapping[str, str] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    frame: str = ""


def read_table(path: Path, content: bytes) -> Table:
    """Parse the content of a csv file: one header line, commas, decimal points, UTF-8.

    Args:
        path: where the content comes from, for messages only.
        content: the bytes of the file. Blank lines are skipped.

    Raises:
        MisfitError: names the file, line and column of the first cell that is no finite number, the
            first row of another length, or says what is wrong with the header or the encoding.

    Example:
        >>> read_table(Path("swing.csv"), b"time,q1\\n0,1.5\\n0.1,1.25\\n").values.tolist()
        [[0.0, 1.5], [0.1, 1.25]]
    """
    text = _decoded(path, content).replace("\r\n", "\n").replace("\r", "\n")
    filled = [(n, line) for n, line in enumerate(text.split("\n"), 1) if line.strip()]
    if not filled:
        raise MisfitError(f"{path}: the file is empty; expected a line of column names and rows of numbers")
    names = _header(path, *filled[0])
    lines, rows = [n for n, _ in filled[1:]], [line for _, line in filled[1:]]
    if not rows:
        raise MisfitError(
            f"{path}, line {filled[0][0]}: column names but no rows of numbers follow; record the trial again or remove the file"
        )
    values = _numbers(path, names, lines, rows)
    require_finite(path, names, lines, values)
    return Table(path, names, values, tuple(lines))


def _decoded(path: Path, content: bytes) -> str:
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        byte = content[error.start]
        raise MisfitError(
            f"{path}: byte 0x{byte:02x} at position {error.start} is not UTF-8 text; save the file as csv in UTF-8"
        ) from error
    if "\0" in text:
        raise MisfitError(f"{path}: a binary file (it contains zero bytes); save it as csv in UTF-8")
    return text


def _cells(path: Path, number: int, line: str) -> list[str]:
    try:
        return [cell.strip() for cell in next(csv.reader([line]))]
    except csv.Error as error:
        raise MisfitError(f"{path}, line {number}: not a csv line ({error}); expected cells between commas") from error


def _header(path: Path, number: int, line: str) -> tuple[str, ...]:
    names = _cells(path, number, line)
    where = f"{path}, line {number}"
    if all(_is_number(name) for name in names):
        raise MisfitError(
            f"{where}: numbers ({shown(names[0])}, ...) where column names were expected; put the names in the first line"
        )
    if len(names) == 1 and (";" in line or "\t" in line):
        raise MisfitError(
            f"{where}: cells are not separated by commas: {shown(line)}; save the file with commas and decimal points"
        )
    for position, name in enumerate(names, 1):
        if not name:
            raise MisfitError(f"{where}: column {position} has no name; give it one")
        if names.index(name) != position - 1:
            raise MisfitError(f"{where}: two columns are named {shown(name)}; rename one of them")
    return tuple(names)


def _numbers(path: Path, names: tuple[str, ...], lines: list[int], rows: list[str]) -> Array:
    try:
        values: Array = np.loadtxt(rows, delimiter=",", quotechar='"', comments=None, ndmin=2)
    except ValueError as error:
        _explain(path, names, lines, rows)
        raise MisfitError(f"{path}: the rows are not plain numbers; write them like 1.5 or -2e-3") from error
    if values.shape != (len(rows), len(names)):
        _explain(path, names, lines, rows)
        raise MisfitError(
            f"{path}: {len(rows)} lines hold {values.shape[0]} rows of {values.shape[1]} numbers under {len(names)} names; remove the quotation marks"
        )
    return values


def _explain(path: Path, names: tuple[str, ...], lines: list[int], rows: list[str]) -> None:
    """Raise for the first row that is too short, too long or not made of numbers."""
    for number, row in zip(lines, rows, strict=True):
        cells = _cells(path, number, row)
        if len(cells) != len(names):
            raise MisfitError(
                f"{path}, line {number}: {len(cells)} cells, but the header names {len(names)} columns ({listed(names)}); complete or remove the line"
            )
        for name, cell in zip(names, cells, strict=True):
            if not _is_number(cell):
                raise MisfitError(
                    f"{path}, line {number}: column {shown(name)} holds {shown(cell)}, expected a number; correct or remove the line"
                )


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    # Python reads 1_000 as a number, csv files do not mean one by it.
    return "_" not in cell


def require_finite(path: Path, names: Sequence[str], lines: Sequence[int], values: Array) -> None:
    """Raise MisfitError for the first cell that is no finite number, or too large to be one.

    Args:
        path: the file, for messages.
        names: names of the k columns.
        lines: line of the file for each of the n rows.
        values: (n, k).
    """
    # Written so that NaN, which is never smaller than anything, counts as bad.
    bad = np.argwhere(~(np.abs(values) < _LARGEST))
    if bad.size:
        row, column = bad[0]
        raise MisfitError(
            f"{path}, line {lines[row]}: column {shown(names[column])} is {values[row, column]:g}, expected a finite number; fill the gap or remove the line"
        )


def read_typed_table(path: Path, *, holes: bool = False) -> Table:
    """Read all numeric columns; columns of text are left out. A row's line is its number, counted from 1.

    With `holes`, cells that are not finite become NaN instead of an error.

    Raises:
        MisfitError: if the file is damaged, holds no numbers, columns of different length, or a cell that is not finite.
    """
    content, _ = read_columns(path)
    arrays = content.arrays
    if not arrays:
        raise MisfitError(f"{path}: no column of numbers; expected time and signals")
    rows = {len(values) for values in arrays.values()}
    if len(rows) > 1:
        raise MisfitError(f"{path}: columns have {min(rows)} to {max(rows)} rows; expected one length")
    if rows == {0}:
        raise MisfitError(f"{path}: column names but no rows; record the trial again or remove the file")
    names, values = tuple(arrays), np.column_stack([np.asarray(part, dtype=float) for part in arrays.values()])
    lines = tuple(range(1, len(values) + 1))
    if holes:
        values[~np.isfinite(values)] = np.nan
    else:
        require_finite(path, names, lines, values)
    units = {column.name: column.unit for column in content.header.columns if column.unit}
    said = content.header.provenance
    return Table(path, names, values, lines, units, frame=str(said.get("frame", "")) if isinstance(said, dict) else "")

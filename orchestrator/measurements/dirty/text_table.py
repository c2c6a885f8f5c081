"""A text file of any make as numbers under column names, read as [reading] says."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fmus.errors import MisfitError
from orchestrator.measurements.dirty.cells import MISSING, as_number, decoded, split_line
from orchestrator.measurements.dirty.clock import seconds_of
from orchestrator.measurements.dirty.long_table import widened
from orchestrator.measurements.dirty.reading import SEPARATORS, Reading
from orchestrator.measurements.table import Table
from orchestrator.measurements.trial import Array
from orchestrator.measurements.wording import listed, shown

# A remark, or a line drawn below a header.
COMMENT = re.compile(r"^\s*(?:(?:#|%|//|!)\s*|(?=.*----)[\s|+:=-]+$)")
# More stray lines than this share mean that the file is not what [reading] says.
MOST_STRAY = 0.05
# A column with fewer readable cells than this share is text.
FEWEST_NUMBERS = 0.5


@dataclass(frozen=True)
class Rows:
    """Rows of cells of one width, the lines on which they stand, and the lines that were no such row."""

    cells: list[list[str]]
    lines: list[int]
    stray: list[int]


def read_text_table(path: Path, content: bytes, reading: Reading) -> Table:
    """Read a text file; cells without a number are NaN, columns without numbers are left out, time stamps are in s.

    Args:
        path: the file, for messages.
        content: its bytes.
        reading: how it is read.

    Raises:
        MisfitError: the file does not look as [reading] says.
    """
    lines = decoded(path, content, reading.encoding)
    names = header_names(path, lines, reading)
    rows = rows_of(lines, reading, len(names))
    if not rows.cells:
        raise MisfitError(
            f"{path}: no row of {len(names)} cells from line {reading.first_line} on; run `misfit import` again"
        )
    _require_few_stray(path, rows)
    if reading.signal:
        unknown = [name for name in (reading.signal, reading.value, *reading.time) if name not in names]
        if unknown:
            raise MisfitError(
                f"{path}: no column {shown(unknown[0])}, which [reading] names; columns found: {listed(names)}"
            )
        names, cells, numbers = widened(names, rows.cells, rows.lines, reading)
        rows = Rows(cells, numbers, rows.stray)
    columns, notes = _columns(path, names, rows, reading)
    if rows.stray:
        notes.append(
            f"{path.name}: {len(rows.stray)} lines are no rows of the table and left out (first: line {rows.stray[0]})"
        )
    table = Table(path, tuple(columns), np.column_stack(list(columns.values())), tuple(rows.lines), notes=tuple(notes))
    return table


def header_names(path: Path, lines: Sequence[str], reading: Reading) -> tuple[str, ...]:
    """The names of all columns: of the line that holds them, or as [reading] gives them; each is unique.

    Args:
        path: the file, for messages.
        lines: its lines.
        reading: how it is read.

    Raises:
        MisfitError: the line does not exist.
    """
    if not reading.names_line:
        return unique_names(reading.names)
    if reading.names_line > len(lines):
        raise MisfitError(
            f"{path}: names_line = {reading.names_line}, but the file has {len(lines)} lines; correct [reading]"
        )
    line = COMMENT.sub("", lines[reading.names_line - 1])
    return unique_names(split_line(line, SEPARATORS[reading.separator]))


def unique_names(names: Sequence[str]) -> tuple[str, ...]:
    """Give every column a name of its own.

    >>> unique_names(["t", "q", "q", ""])
    ('t', 'q', 'q (2)', 'column 4')
    """
    found: list[str] = []
    for place, name in enumerate(names, 1):
        own = name or f"column {place}"
        number = 2
        while own in found:
            own, number = f"{name} ({number})", number + 1
        found.append(own)
    return tuple(found)


def rows_of(lines: Sequence[str], reading: Reading, width: int) -> Rows:
    """Split the lines from `first_line` on; empty cells beyond the width are dropped, other widths are stray.

    A header that stands again between the rows, as in logs that were joined, is passed over.

    Args:
        lines: the lines of the file.
        reading: how it is read.
        width: number of columns.
    """
    cells, numbers, stray = [], [], []
    separator = SEPARATORS[reading.separator]
    header = lines[reading.names_line - 1] if 0 < reading.names_line <= len(lines) else ""
    for number in range(reading.first_line, len(lines) + 1):
        line = lines[number - 1]
        if not line.strip() or line == header or COMMENT.match(line):
            continue
        row = split_line(line, separator)
        while len(row) > width and not row[-1]:
            row.pop()
        if len(row) == width:
            cells.append(row)
            numbers.append(number)
        else:
            stray.append(number)
    return Rows(cells, numbers, stray)


def _require_few_stray(path: Path, rows: Rows) -> None:
    if len(rows.stray) > max(MOST_STRAY * len(rows.cells), 3):
        raise MisfitError(
            f"{path}, line {rows.stray[0]}: {len(rows.stray)} of {len(rows.stray) + len(rows.cells)} lines have another number of cells than the header; correct the file, or run `misfit import` on it again"
        )


def _columns(path: Path, names: tuple[str, ...], rows: Rows, reading: Reading) -> tuple[dict[str, Array], list[str]]:
    columns: dict[str, Array] = {}
    notes: list[str] = []
    unknown = [name for name in reading.time if name not in names]
    if unknown:
        raise MisfitError(
            f"{path}: no column {shown(unknown[0])}, which [reading] names as time; columns found: {listed(names)}"
        )
    for place, name in enumerate(names):
        cells = [row[place] for row in rows.cells]
        if reading.time_kind == "stamps" and name in reading.time:
            if name == reading.time[0]:
                columns[name], note = seconds_of(_joined(names, rows, reading))
                notes.extend([f"{path.name}: {note}"] if note else [])
            continue
        values, odd = numbers_of(cells, reading.decimal)
        if np.mean(np.isnan(values)) > 1.0 - FEWEST_NUMBERS and odd or np.all(np.isnan(values)):
            continue
        if odd:
            notes.append(
                f"{path.name}: {len(odd)} cells of column {shown(name)} hold no number (first: {shown(odd[0])})"
            )
        for marker in reading.missing:
            values[values == marker] = np.nan
        columns[name] = values
    if not columns:
        raise MisfitError(f"{path}: no column of numbers; run `misfit import` again")
    return columns, notes


def _joined(names: tuple[str, ...], rows: Rows, reading: Reading) -> list[str]:
    places = [names.index(name) for name in reading.time]
    return [" ".join(row[place] for place in places) for row in rows.cells]


def numbers_of(cells: Sequence[str], decimal: str) -> tuple[Array, list[str]]:
    """Cells (n,) as numbers, NaN where there is none, and the cells that hold something else than a number or nothing.

    >>> numbers_of(["1,5", "", "x"], ",")
    (array([1.5, nan, nan]), ['x'])
    """
    if decimal == "." or not any("," in cell or "." in cell for cell in cells[:50]):
        try:
            quick: Array = np.array(cells, dtype=float)
            if np.all(np.isfinite(quick)) and not any("_" in cell for cell in cells) and decimal == ".":
                return quick, []
        except ValueError:
            pass
    odd, values = [], np.full(len(cells), np.nan)
    for place, cell in enumerate(cells):
        value = as_number(cell, decimal)
        if value is not None:
            values[place] = value
        elif cell.lower() not in MISSING:
            odd.append(cell)
    return values, odd

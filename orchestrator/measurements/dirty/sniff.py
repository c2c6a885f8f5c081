"""How a text file is made: separator, decimal sign, lines of the header, units, and which columns hold time."""

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from fmus.errors import MisfitError
from orchestrator.measurements.dirty.cells import as_number, decoded, encoding_of, kind_of, split_line
from orchestrator.measurements.dirty.header_units import read_unit, split_header
from orchestrator.measurements.dirty.reading import SEPARATORS, Reading
from orchestrator.measurements.dirty.text_table import COMMENT, header_names, numbers_of, rows_of, unique_names

# Lines that are looked at to find separator and decimal sign, from all over the file.
LOOKED_AT = 600
# Numbers that loggers write where a sensor gave nothing.
MARKERS = (-9999.0, -999.0, -99999.0, 9999.0, 99999.0, -999.25, 1e30, 1e31, -1e30, 9.96921e36)
# What `unique_names` puts behind a name that stands twice.
_NUMBERED = re.compile(r" \(\d+\)$")
_BEGINS_AS_A_NUMBER = re.compile(r"[+\-.,]?\d")
_RATE = re.compile(
    r"(?:rate|freq\w*|abtastrate|\bfs\b)[^\d\n]{0,30}?(?P<rate>\d+(?:[.,]\d+)?(?:e\d+)?)\s*(?P<unit>k?hz|1/s|samples)?",
    re.I,
)
_PERIOD = re.compile(
    r"(?:\bdt\b|interval|period|sample\s*time|delta)[^\d\n]{0,30}?(?P<step>\d+(?:[.,]\d+)?(?:e-?\d+)?)\s*(?P<unit>[mu]?s)\b",
    re.I,
)


@dataclass(frozen=True)
class Sniffed:
    """How a file is to be read, what its columns are called and their units where the header says so.

    `rate_hz` is what a line above the table says about the sampling, if any does.
    """

    reading: Reading
    names: tuple[str, ...]
    units: dict[str, str] = field(default_factory=dict)
    rate_hz: float | None = None


def sniff(path: Path, content: bytes) -> Sniffed:
    """Find out how a text file is made.

    The separator and the decimal sign are those with which most cells are numbers and the rows have one width. The
    table starts at the first such row; names and units stand in the lines right above it.

    Raises:
        MisfitError: there is no table of numbers in the file.
    """
    encoding = encoding_of(path, content)
    lines = decoded(path, content, encoding)
    separator, decimal, width = _separator(path, lines)
    texts = _text_columns(lines, separator, decimal, width)
    first = _first_line(path, lines, separator, decimal, width, texts)
    names_line, units_line = _header_lines(lines[: first - 1], separator, decimal, width)
    named = next(name for name, sign in SEPARATORS.items() if sign == separator)
    reading = Reading(encoding, named, decimal, names_line, first)
    if names_line:
        names = header_names(path, lines, reading)
        # Rows that end in a separator have an empty cell more than the header.
        if len(names) == width - 1 and all(row[-1] == "" for row in rows_of(lines, reading, width).cells):
            width = len(names)
        if len(names) != width:
            names = unique_names([*names, *[""] * width][:width])
            reading = replace(reading, names_line=0, names=names)
    else:
        names = unique_names([""] * width)
        reading = replace(reading, names=names)
    units = _units(names, split_line(COMMENT.sub("", lines[units_line - 1]), separator) if units_line else [])
    reading = _with_markers(lines, reading, width)
    return Sniffed(reading, names, units, _rate(lines[: first - 1]))


def _separator(path: Path, lines: Sequence[str]) -> tuple[str, str, int]:
    body = [line for line in lines if line.strip() and not COMMENT.match(line)]
    sample = body[:: max(len(body) // LOOKED_AT, 1)]
    quoted = any('"' in line for line in sample)
    best, score = None, 0.0
    for separator in ("\t", ";", ",", "|", " "):
        for decimal in (".", ","):
            if separator == decimal and not quoted:
                continue
            width, found = _score(sample, separator, decimal)
            if found > score:
                best, score = (separator, decimal, width), found
    if best is None:
        raise MisfitError(f"{path}: no table of numbers; expected a line of column names and rows of numbers")
    return best


def _score(sample: Sequence[str], separator: str, decimal: str) -> tuple[int, float]:
    """The usual width of rows and how many cells of such rows are numbers, less what is text."""
    counts: Counter[int] = Counter()
    values: Counter[int] = Counter()
    for line in sample:
        cells = split_line(line, separator)
        kinds = [kind_of(cell, decimal) for cell in cells]
        numbers = sum(kind in ("number", "stamp") for kind in kinds)
        if numbers:
            counts[len(cells)] += 1
            # Text that begins as a number was cut in the wrong place; a word may be a remark, a mode or `joint1`.
            cut = sum(
                kind == "text" and bool(_BEGINS_AS_A_NUMBER.match(cell))
                for kind, cell in zip(kinds, cells, strict=True)
            )
            values[len(cells)] += numbers - 2 * cut
    if not counts:
        return 0, 0.0
    width, _ = counts.most_common(1)[0]
    # One column alone is a table only if nothing else fits, and so are blanks: they also cut a date from its time.
    return width, values[width] * (1.0 if width > 1 and separator != " " else 0.5)


def _text_columns(lines: Sequence[str], separator: str, decimal: str, width: int) -> set[int]:
    """Columns that hold text in most rows, such as remarks."""
    rows = [row for row in (split_line(line, separator) for line in lines[-LOOKED_AT:]) if len(row) == width]
    return {
        place
        for place in range(width)
        if rows and sum(kind_of(row[place], decimal) == "text" for row in rows) > 0.5 * len(rows)
    }


def _first_line(path: Path, lines: Sequence[str], separator: str, decimal: str, width: int, texts: set[int]) -> int:
    for number, line in enumerate(lines, 1):
        if not line.strip() or COMMENT.match(line):
            continue
        row = split_line(line, separator)
        while len(row) > width and not row[-1]:
            row.pop()
        kinds = [kind_of(cell, decimal) for place, cell in enumerate(row) if place not in texts]
        if len(row) == width and "text" not in kinds and ("number" in kinds or "stamp" in kinds):
            return number
    raise MisfitError(f"{path}: no row of numbers; expected a line of column names and rows of numbers")


def _header_lines(above: Sequence[str], separator: str, decimal: str, width: int) -> tuple[int, int]:
    """The lines, counted from 1, of the names and of the units; 0 for none."""
    block: list[tuple[int, list[str]]] = []
    for number in range(len(above), 0, -1):
        line = COMMENT.sub("", above[number - 1])
        if not line.strip():
            if block:
                break
            continue
        row = split_line(line, separator)
        while len(row) > width and not row[-1]:
            row.pop()
        if len(row) not in (width, width - 1) or not any(_says_something(cell, decimal) for cell in row):
            break
        block.append((number, row))
    if not block:
        return 0, 0
    (bottom, cells), *others = block[:3]
    if others and _are_units(cells) and _tell_apart(others[0][1]):
        return others[0][0], bottom
    # Names, units, and one more line such as the channel numbers.
    if len(others) > 1 and _are_units(others[0][1]):
        return others[1][0], others[0][0]
    return bottom, 0


def _tell_apart(cells: Sequence[str]) -> bool:
    """Whether cells may be names: some may stand twice, but not the same in most columns, as a device's would."""
    filled = [cell for cell in cells if cell]
    return len(set(filled)) > 0.5 * len(filled)


def _says_something(cell: str, decimal: str) -> bool:
    return bool(cell) and as_number(cell, decimal) is None


def _are_units(cells: Sequence[str]) -> bool:
    filled = [cell for cell in cells if cell]
    known = sum(read_unit(cell) is not None for cell in filled)
    return bool(filled) and known >= max(0.6 * len(filled), 1)


def _units(names: Sequence[str], cells: Sequence[str]) -> dict[str, str]:
    """Units by column: of the line of units, else of the header itself."""
    units: dict[str, str] = {}
    for place, name in enumerate(names):
        stated = read_unit(cells[place]) if place < len(cells) else None
        stated = stated or split_header(_NUMBERED.sub("", name))[1]
        if stated is not None:
            units[name] = stated
    return units


def _rate(above: Sequence[str]) -> float | None:
    for line in above:
        found = _RATE.search(line)
        if found and float(found["rate"].replace(",", ".")) > 0:
            return float(found["rate"].replace(",", ".")) * (1000.0 if (found["unit"] or "").lower() == "khz" else 1.0)
        found = _PERIOD.search(line)
        if found and float(found["step"].replace(",", ".")) > 0:
            step = float(found["step"].replace(",", "."))
            return 1.0 / (step * {"s": 1.0, "ms": 1e-3, "us": 1e-6}[found["unit"].lower()])
    return None


def _with_markers(lines: Sequence[str], reading: Reading, width: int) -> Reading:
    """Add the numbers that stand for no value: known markers that lie far outside of the rest of their column."""
    rows = rows_of(lines, reading, width).cells
    found = set()
    for place in range(width):
        values, _ = numbers_of([row[place] for row in rows], reading.decimal)
        for marker in MARKERS:
            there = values == marker
            rest = values[~there & ~np.isnan(values)]
            if there.any() and rest.size > 2 and abs(marker) > 5 * np.max(np.abs(rest)):
                found.add(marker)
    return replace(reading, missing=tuple(sorted(found)))

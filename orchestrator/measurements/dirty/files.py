"""One file as found: how it is read, its columns with units, its clock, and its holes."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from fmus.errors import MisfitError
from orchestrator.measurements.dirty.cells import decoded, kind_of
from orchestrator.measurements.dirty.clock import with_clock
from orchestrator.measurements.dirty.long_table import long_form
from orchestrator.measurements.dirty.reading import Reading
from orchestrator.measurements.dirty.repair import in_order, repaired
from orchestrator.measurements.dirty.sniff import Sniffed, sniff
from orchestrator.measurements.dirty.text_table import rows_of
from orchestrator.measurements.load import TYPED_ENDINGS, read_any_table
from orchestrator.measurements.table import Table
from orchestrator.measurements.trial import Array
from orchestrator.measurements.wording import shown

# Holes of at most so many samples are bridged, longer ones are cut out.
BRIDGED_SAMPLES = 6
# A column that is empty in more rows than this is sampled slower than the others: its holes are bridged as they are.
SLOW = 0.2


@dataclass(frozen=True)
class FoundFile:
    """A file, how it is read, its columns (n,) without time with NaN in holes, their units, and what was assumed."""

    path: Path
    reading: Reading
    columns: Mapping[str, Array]
    units: Mapping[str, str]
    rate_hz: float | None
    notes: tuple[str, ...]

    def table(self, needed: tuple[str, ...], interpolation: Mapping[str, str]) -> Table:
        """The file as it will be used, in the order of time and without holes."""
        return repaired(
            read_any_table(self.path, self.path.read_bytes(), self.reading), self.reading, needed, interpolation
        )


def find_file(path: Path, rate_hz: float | None = None, time: str | None = None) -> FoundFile:
    """Find out how a file is to be read.

    Args:
        path: a text file of any make, or parquet, mf4 or h5.
        rate_hz: the sampling rate, for files without a clock.
        time: the column that holds time, if the user says it.

    Raises:
        MisfitError: it is no table of numbers, or has no time.
    """
    content = path.read_bytes()
    if not content:
        raise MisfitError(f"{path}: the file is empty; expected column names and rows of numbers")
    typed = path.suffix.lower() in TYPED_ENDINGS
    sniffed, stamps, cells = (Sniffed(Reading(), ()), [], []) if typed else _text(path, content)
    table = read_any_table(path, content, sniffed.reading)
    values = {name: table.values[:, place] for place, name in enumerate(table.names)}
    units = {**table.units, **sniffed.units}
    rate = rate_hz or sniffed.rate_hz
    try:
        reading, notes = with_clock(sniffed.reading, values, stamps, units, rate, time)
    except MisfitError as error:
        raise MisfitError(f"{path}: {error}") from error
    reading, own_units = long_form(sniffed.names, cells, reading)
    units |= own_units
    if reading.signal:
        notes = (*notes, f"{path.name}: a row holds one value; {shown(reading.signal)} says of which signal")
    table = read_any_table(path, content, reading)
    columns = {name: table.values[:, place] for place, name in enumerate(table.names) if name not in reading.time}
    if not columns:
        raise MisfitError(f"{path}: no column of numbers beside the time")
    reading = replace(reading, bridge_up_to_s=_longest_bridge(table, reading))
    notes = (*notes, *table.notes)
    return FoundFile(path, reading, columns, {n: units[n] for n in columns if n in units}, rate, notes)


def _text(path: Path, content: bytes) -> tuple[Sniffed, list[str], list[list[str]]]:
    """How a text file is read, which of its columns hold dates or times of the day, and its rows."""
    sniffed = sniff(path, content)
    rows = rows_of(decoded(path, content, sniffed.reading.encoding), sniffed.reading, len(sniffed.names)).cells
    sample = rows[:: max(len(rows) // 200, 1)]
    stamps = []
    for place, name in enumerate(sniffed.names):
        kinds = [kind_of(row[place], sniffed.reading.decimal) for row in sample]
        if kinds.count("stamp") > 0.5 * len(kinds):
            stamps.append(name)
    return sniffed, stamps, rows


def _longest_bridge(table: Table, reading: Reading) -> float:
    """How long a hole may be bridged, in s: a few samples, or the usual distance of values in a slow column."""
    if reading.time_kind == "counted" or not np.isnan(table.values).any():
        return 0.0
    table, time = in_order(table, reading, [])
    longest = BRIDGED_SAMPLES * float(np.median(np.diff(time)))
    for place, name in enumerate(table.names):
        known = ~np.isnan(table.values[:, place])
        if name in reading.time or np.mean(~known) < SLOW or known.sum() < 3:
            continue
        longest = max(longest, 1.5 * float(np.median(np.diff(time[known]))))
    return float(f"{longest:.4g}")


def separator_words(reading: Reading) -> str:
    """How a file is made, in words."""
    decimal = ", decimal comma" if reading.decimal == "," else ""
    return f"{reading.separator} between columns{decimal}, {reading.encoding.removesuffix('-sig').upper()}"

"""A table with holes as one without: rows in the order of time, short holes bridged, long ones cut out."""

from collections.abc import Collection, Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from fmus.errors import MisfitError
from fmus.units import conversion
from orchestrator.measurements.cleaning import gaps
from orchestrator.measurements.dirty.reading import Reading
from orchestrator.measurements.table import Table
from orchestrator.measurements.trial import Array
from orchestrator.measurements.wording import counted, listed, shown

TIME = "time"
# A clock that repeats its stamps in more rows than this share is coarse; fewer are copies of a row.
COARSE = 0.2
# Steps back in more rows than this share, or one back to the start, are no mixed-up rows.
MOST_BACK = 0.05


def repaired(table: Table, reading: Reading, needed: Collection[str], interpolation: Mapping[str, str]) -> Table:
    """Put rows in the order of time and fill or cut samples without a value; every change is noted.

    Args:
        table: as read, NaN where a sample has no value.
        reading: says which column is time and how long a hole may be bridged.
        needed: columns whose long holes cut the row out; holes in the others are always bridged. Empty: all.
        interpolation: "hold" for columns whose last value stays; the others are bridged by straight lines.

    Returns:
        A table whose first column is `time` in s; without a clock there is none, and all holes are bridged.

    Raises:
        MisfitError: the file holds two recordings one behind the other, or nothing is left.
    """
    notes = list(table.notes)
    columns: dict[str, Array] = {}
    time = np.arange(float(len(table.lines)))
    limit = np.inf
    if reading.time_kind != "counted":
        table, time = in_order(table, reading, notes)
        columns[TIME], limit = time, reading.bridge_up_to_s
        notes += _pauses(table.path.name, time)
    keep = np.ones(len(time), bool)
    for place, name in enumerate(table.names):
        if name in reading.time:
            continue
        values = table.values[:, place]
        holes = np.isnan(values)
        columns[name], cut = _bridged(time, values, limit, interpolation.get(name) == "hold")
        cut &= not needed or name in needed
        keep &= ~cut
        if holes.any():
            notes.append(_words(table.path.name, name, int(holes.sum()), int(cut.sum()), float(time[holes][0])))
    return _kept(table, columns, keep, notes)


def _kept(table: Table, columns: Mapping[str, Array], keep: NDArray[np.bool_], notes: list[str]) -> Table:
    if keep.sum() < 2:
        raise MisfitError(
            f"{table.path}: no two rows have a value in every column that is used; leave a column out of [variables], or raise bridge_up_to_s in [reading]"
        )
    lines = tuple(line for line, kept in zip(table.lines, keep, strict=True) if kept)
    values = np.column_stack([values[keep] for values in columns.values()])
    units = {**table.units, TIME: "s"}
    return replace(table, names=tuple(columns), values=values, lines=lines, units=units, notes=tuple(notes))


def in_order(table: Table, reading: Reading, notes: list[str]) -> tuple[Table, Array]:
    """Rows with a time in s, sorted, each time once.

    Args:
        table: as read.
        reading: says which column is time.
        notes: gets a line for each change.

    Raises:
        MisfitError: the file holds two recordings one behind the other, or no times.
    """
    time = _seconds(table, reading)
    known = ~np.isnan(time)
    if not known.all():
        notes.append(f"{table.path.name}: {int((~known).sum())} rows without a time are left out")
    order = np.flatnonzero(known)
    if len(order) < 2:
        raise MisfitError(
            f"{table.path}: fewer than two rows have a time in column {shown(reading.time[0])}; correct [reading]"
        )
    back = np.flatnonzero(np.diff(time[order]) < 0)
    if back.size:
        _require_one_recording(table, time[order], back, reading.time[0])
        notes.append(
            f"{table.path.name}: the rows are not in the order of time; they are sorted ({back.size} steps back)"
        )
        order = order[np.argsort(time[order], kind="stable")]
    if reading.time_kind == "epoch":
        time = time - time[order[0]]
    repeats = np.diff(time[order]) == 0
    if not repeats.any():
        return _rows(table, order), time[order]
    copies = repeats & np.all(np.diff(_rows(table, order).values, axis=0) == 0, axis=1)
    if np.mean(repeats) > COARSE and not np.array_equal(copies, repeats):
        notes.append(
            f"{table.path.name}: the clock repeats its stamps; rows of one stamp are spread evenly up to the next"
        )
        return _rows(table, order), _spread(time[order])
    first = np.r_[True, ~repeats]
    notes.append(
        f"{table.path.name}: {counted(int(repeats.sum()), 'row')} with the time of the row before {'is' if repeats.sum() == 1 else 'are'} left out"
    )
    return _rows(table, order[first]), time[order[first]]


def _seconds(table: Table, reading: Reading) -> Array:
    name = reading.time[0]
    if name not in table.names:
        raise MisfitError(
            f"{table.path}: no column {shown(name)} of numbers, which [reading] names as time; columns found: {listed(table.names)}"
        )
    time: Array = table.values[:, table.names.index(name)]
    return time if reading.time_kind == "stamps" else time * conversion(reading.time_unit, "s")


def _require_one_recording(table: Table, time: Array, back: NDArray[np.intp], name: str) -> None:
    place = int(back[0])
    restarts = time[place + 1] <= time[0] + 0.01 * (time.max() - time[0]) and place > 10
    if restarts or back.size > max(MOST_BACK * len(time), 1):
        raise MisfitError(
            f"{table.path}, line {table.lines[place + 1]}: time (column {shown(name)}) goes back from {time[place]:.9g} s to {time[place + 1]:.9g} s; expected one recording in a file; cut the file there, or name another column as time"
        )


def _rows(table: Table, order: NDArray[np.intp]) -> Table:
    return replace(table, values=table.values[order], lines=tuple(table.lines[place] for place in order))


def _pauses(file: str, time: Array) -> list[str]:
    """A note on times without rows, if there are any."""
    found = gaps(time)
    if not found.size:
        return []
    begin, end = time[found[0]], time[found[0] + 1]
    which = f"from {begin:.6g} to {end:.6g} s" + (
        f" and {counted(found.size - 1, 'more time')}" if found.size > 1 else ""
    )
    return [f"{file}: no rows {which}: nothing is compared there, inputs go on as between other samples"]


def _spread(time: Array) -> Array:
    """Spread rows of equal stamps evenly up to the next stamp; the first stamp's may have begun before the record did."""
    stamps, starts, counts = np.unique(time, return_index=True, return_counts=True)
    if len(stamps) < 2:
        return time
    usual_step, usual_count = float(np.median(np.diff(stamps))), float(np.median(counts))
    result = np.empty_like(time)
    for place, (stamp, start, count) in enumerate(zip(stamps, starts, counts, strict=True)):
        length = float(stamps[place + 1] - stamp) if place + 1 < len(stamps) else usual_step
        whole = count if 0 < place < len(stamps) - 1 else max(count, usual_count)
        shift = whole - count if place == 0 else 0
        result[start : start + count] = stamp + (np.arange(count) + shift) * length / whole
    return result


def _bridged(time: Array, values: Array, limit: float, hold: bool) -> tuple[Array, NDArray[np.bool_]]:
    """Values without NaN, and where a hole was too long for that, or has no value on one of its sides."""
    known = np.flatnonzero(~np.isnan(values))
    if not known.size:
        return np.zeros_like(values), np.ones(len(values), bool)
    before = np.clip(np.searchsorted(known, np.arange(len(values)), side="right") - 1, 0, None)
    after = np.clip(np.searchsorted(known, np.arange(len(values))), None, len(known) - 1)
    filled = values[known[before]] if hold else np.interp(time, time[known], values[known])
    width = time[known[after]] - time[known[before]]
    outside = (np.arange(len(values)) < known[0]) | (np.arange(len(values)) > known[-1])
    return filled, np.isnan(values) & (outside | (width > limit * (1 + 1e-9)))


def _words(file: str, column: str, holes: int, lost: int, first: float) -> str:
    done = []
    if holes - lost:
        done.append(f"{holes - lost} bridged")
    if lost:
        done.append(f"{counted(lost, 'row')} cut out")
    return f"{file}: {counted(holes, 'sample')} without a value in column {shown(column)} (first at {first:.6g} s): {', '.join(done)}"

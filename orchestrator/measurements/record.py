"""One data file as a record: its time axis in s, found and checked, and the other columns."""

from collections.abc import Mapping, Sequence

import numpy as np

from fmus.errors import MisfitError
from fmus.units import conversion
from orchestrator.measurements.case_file import CaseFile
from orchestrator.measurements.table import Table
from orchestrator.measurements.trial import Array, Record
from orchestrator.measurements.wording import listed, shown

_TIME_NAMES = ("time", "t", "time_s")
# A clock that differs by less than this from the declared rate is a tolerance, not a mistake.
_RATE_TOLERANCE = 0.01


def read_record(name: str, table: Table, case: CaseFile) -> Record:
    """Turn a table into a record, with time in s and every other column in its own unit.

    The time column is the one that [variables] maps to `time`, else one named `time`, `t` or
    `time_s`, else it is counted from `rate_hz` of [sampling].

    Args:
        name: of the trial.
        table: numbers as they were read, with the numbers of their lines.
        case: units, names and sampling.

    Raises:
        MisfitError: a column named in case.toml is missing, there is no time, its unit is none of
            time, it does not increase from row to row, or there are fewer than two rows.
    """
    _require_columns(table, case)
    if len(table.lines) < 2:
        raise MisfitError(f"{table.path}: one row of numbers; a trial needs at least two samples")
    time_name = time_column(table.names, case.variables)
    columns = {column: np.ascontiguousarray(table.values[:, i]) for i, column in enumerate(table.names)}
    if time_name is None:
        time = _counted_time(table, case)
    else:
        time = _recorded_time(table, time_name, case, columns.pop(time_name))
    units = {column: case.units.get(column) or table.units.get(column, "") for column in columns}
    return Record(name, time, columns, units)


def time_column(names: Sequence[str], variables: Mapping[str, str]) -> str | None:
    """Find the column that holds time; None if there is none.

    Example:
        >>> time_column(("Time [s]", "q1"), {"Time [s]": "time"})
        'Time [s]'
    """
    for name in names:
        if variables.get(name) == "time":
            return name
    candidates = [name for name in names if name.lower() in _TIME_NAMES]
    return min(candidates, key=lambda name: _TIME_NAMES.index(name.lower()), default=None)


def rate_notes(record: Record, rate_hz: float | None) -> tuple[str, ...]:
    """Say so if the time column contradicts the declared sampling rate by more than 1 %."""
    if rate_hz is None:
        return ()
    seen = 1.0 / float(np.median(np.diff(record.time)))
    if abs(seen / rate_hz - 1.0) <= _RATE_TOLERANCE:
        return ()
    return (
        f"{record.name}: the time column runs at {seen:g} Hz, [sampling] says {rate_hz:g} Hz; the time column is used",
    )


def _require_columns(table: Table, case: CaseFile) -> None:
    for section, named in (("columns", case.units), ("variables", case.variables)):
        for column in named:
            if column not in table.names:
                raise MisfitError(
                    f"{table.path}: no column {shown(column)}, which case.toml names in [{section}]; columns found: {listed(table.names)}; correct case.toml or the header"
                )


def _counted_time(table: Table, case: CaseFile) -> Array:
    if case.rate_hz is None:
        raise MisfitError(
            f"{table.path}: no time column; expected one named time, t or time_s, or one that [variables] of case.toml maps to time; columns found: {listed(table.names)}; 'misfit import' reads headers of other kinds"
        )
    return np.arange(len(table.lines)) / case.rate_hz


def _recorded_time(table: Table, name: str, case: CaseFile, values: Array) -> Array:
    unit = case.units.get(name) or table.units.get(name) or "s"
    try:
        time: Array = values * conversion(unit, "s")
    except MisfitError as error:
        raise MisfitError(
            f"{table.path}: time column {shown(name)} has the unit {shown(unit)}, expected a unit of time such as s or ms; correct [columns] in case.toml"
        ) from error
    backwards = np.flatnonzero(time[1:] <= time[:-1])
    if backwards.size:
        row = int(backwards[0])
        raise MisfitError(
            f"{table.path}, line {table.lines[row + 1]}: time {values[row + 1]:.9g} {unit} follows {values[row]:.9g} {unit}; time must increase from row to row; sort the rows or remove the repeated ones"
        )
    return time

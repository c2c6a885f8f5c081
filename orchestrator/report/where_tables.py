"""The rows of `Comparison.where` as tables: the worst of each kind, in words and units."""

from collections.abc import Mapping, Sequence
from typing import Any

from orchestrator.report.numbers import digits, quantity
from orchestrator.report.page import PageTable

ROWS = 8
_CAPTIONS = {
    "signal": "By signal",
    "time": "In time",
    "state": "Against measured state",
    "frequency": "In frequency",
}
_HEADINGS = {
    "rmse": "error (rms)",
    "over_floor": "times the floor",
    "floor": "noise floor",
    "count": "samples",
    "low": "chance from",
    "high": "chance to",
    "p_value": "p",
}
_BOUNDS = {"from_s": "s", "to_s": "s", "from_hz": "Hz", "to_hz": "Hz"}
_IN_SIGNAL_UNIT = frozenset({"rmse", "floor", "bias", "low", "high"})


def where_tables(
    where: Mapping[str, Sequence[Mapping[str, Any]]], units: Mapping[str, str], floor: Mapping[str, float]
) -> tuple[PageTable, ...]:
    """Return a table for each kind of place that has rows, the largest errors (in floors) first.

    Keys that a row lacks are left empty; keys that are not known here appear as they are.

    Args:
        where: rows by the kind of place.
        units: unit of each signal.
        floor: noise floor of each signal, in its unit.
    """
    return tuple(_table(kind, rows, units, floor) for kind, rows in where.items() if rows)


def _table(
    kind: str, rows: Sequence[Mapping[str, Any]], units: Mapping[str, str], floor: Mapping[str, float]
) -> PageTable:
    worst = sorted(rows, key=lambda row: -_severity(row, floor))[:ROWS]
    keys = [
        key for key in dict.fromkeys(key for row in worst for key in row) if key not in ("unit", "depends", "strength")
    ]
    caption = _CAPTIONS.get(kind, kind)
    if len(rows) > ROWS:
        caption += f": the worst {ROWS} of {len(rows)}"
    cells = tuple(tuple(_cell(row, key, units) for key in keys) for row in worst)
    return PageTable(caption, tuple(_heading(key) for key in keys), cells)


def _severity(row: Mapping[str, Any], floor: Mapping[str, float]) -> float:
    """Size of an error in noise floors, so that signals of different units can share a table."""
    error = row.get("rmse", 0.0)
    size = floor.get(str(row.get("signal")), 1.0)
    return float(error) / (size or 1.0) if isinstance(error, int | float) else 0.0


def _heading(key: str) -> str:
    return _HEADINGS.get(key, key.removesuffix("_s").removesuffix("_hz").replace("_", " "))


def _cell(row: Mapping[str, Any], key: str, units: Mapping[str, str]) -> str:
    value = row.get(key)
    if value is None:
        return ""
    if isinstance(value, bool | str) or not isinstance(value, int | float):
        return str(value)
    if key in _IN_SIGNAL_UNIT:
        return quantity(value, units.get(str(row.get("signal")), ""))
    if key in _BOUNDS:
        return f"{digits(value)} {_BOUNDS[key]}"
    if key in ("from", "to"):
        return quantity(value, str(row.get("unit", "")))
    return str(value) if isinstance(value, int) else digits(value)

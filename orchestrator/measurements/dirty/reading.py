"""The table [reading] of a case.toml: how a text file of any make is to be read."""

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any

from fmus.errors import MisfitError
from fmus.units import conversion
from orchestrator.measurements.toml_values import TomlTable
from orchestrator.measurements.wording import shown

SEPARATORS = {"comma": ",", "semicolon": ";", "tab": "\t", "space": " ", "bar": "|"}
TIME_KINDS = ("number", "epoch", "stamps", "counted")


@dataclass(frozen=True)
class Reading:
    """How one file is read. Lines are counted from 1 as an editor shows them; 0 stands for "there is none".

    `names` stands for the names where no line holds them. `time` names the columns that hold time, which are joined (a
    date and a time of the day) and become the one column `time` in s; `time_kind` says what they hold: numbers in
    `time_unit`, such numbers since an epoch (only differences count), stamps, or nothing ("counted": at the rate of
    [sampling]). Samples without a value are bridged over up to `bridge_up_to_s`, longer stretches are cut out.
    `missing` lists numbers that stand for "no value". Where a row holds one value, `signal` and `value` name the columns that
    say of which signal it is, and which it is.
    """

    encoding: str = "utf-8"
    separator: str = "comma"
    decimal: str = "."
    names_line: int = 1
    first_line: int = 2
    names: tuple[str, ...] = ()
    time: tuple[str, ...] = ()
    time_kind: str = "number"
    time_unit: str = "s"
    missing: tuple[float, ...] = ()
    bridge_up_to_s: float = 0.0
    signal: str = ""
    value: str = ""

    def as_table(self) -> dict[str, Any]:
        """The keys and values of the TOML table."""
        values = {each.name: getattr(self, each.name) for each in fields(self)}
        return {key: list(value) if isinstance(value, tuple) else value for key, value in values.items()}


def read_reading(table: TomlTable) -> tuple[Reading | None, Mapping[str, Reading]]:
    """Read [reading], and [reading.files."NAME"] for files that differ from the others.

    Returns:
        How the files are read, None if nothing is said, and the exceptions by the names of the files.

    Raises:
        MisfitError: a key is not known, or its value is not what was expected.
    """
    if not table.values:
        return None, {}
    common = {key: value for key, value in table.values.items() if key != "files"}
    exceptions = table.get_table("files")
    files = {
        name: _reading(TomlTable(f"{exceptions.where} [{name}]", {**common, **exceptions.get_table(name).values}))
        for name in exceptions.values
    }
    return _reading(TomlTable(table.where, common)), files


def _reading(table: TomlTable) -> Reading:
    table.check_keys(each.name for each in fields(Reading))
    given: dict[str, Any] = {}
    for key in ("encoding", "separator", "decimal", "time_kind", "time_unit", "signal", "value"):
        if key in table.values:
            given[key] = table.get_text(key)
    for key in ("names", "time"):
        if key in table.values:
            given[key] = table.get_texts(key)
    for key in ("names_line", "first_line"):
        if key in table.values:
            value = table.values[key]
            if type(value) is not int or value < 0:
                raise table.wrong(key, "the number of a line, or 0")
            given[key] = value
    if "missing" in table.values:
        given["missing"] = _numbers(table)
    if "bridge_up_to_s" in table.values:
        seconds = table.get_number("bridge_up_to_s")
        if seconds is None or seconds < 0.0:
            raise table.wrong("bridge_up_to_s", "a time in s, 0 or more")
        given["bridge_up_to_s"] = seconds
    reading = Reading(**given)
    _require(table, "separator", reading.separator, tuple(SEPARATORS))
    _require(table, "decimal", reading.decimal, (".", ","))
    _require(table, "time_kind", reading.time_kind, TIME_KINDS)
    if reading.time_kind != "counted" and not reading.time:
        raise MisfitError(f"{table.where}: no key 'time'; expected the names of the columns that hold time")
    try:
        conversion(reading.time_unit, "s")
    except MisfitError as error:
        raise table.wrong("time_unit", "a unit of time such as s or ms") from error
    return reading


def _numbers(table: TomlTable) -> tuple[float, ...]:
    values = table.values["missing"]
    if not isinstance(values, list) or not all(type(value) in (int, float) for value in values):
        raise table.wrong("missing", "a list of numbers that stand for no value, such as [-9999]")
    return tuple(map(float, values))


def _require(table: TomlTable, key: str, value: str, allowed: tuple[str, ...]) -> None:
    if value not in allowed:
        raise MisfitError(f"{table.where}: {key} = {shown(value)}, expected one of {', '.join(map(shown, allowed))}")

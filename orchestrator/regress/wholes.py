"""Checks of a whole model beside its trajectories, by name; each is a module of the folder `whole` with `judge`."""

from collections.abc import Mapping
from typing import Any

from fmus.errors import MisfitError
from orchestrator.measurements.toml_values import TomlTable, number
from orchestrator.measurements.wording import nearest, shown

# Keys of each check with the value that `CHECK = true` stands for; None has to be given.
CHECKS: dict[str, dict[str, Any]] = {
    "conformance": {"accept": ()},
    "determinism": {},
    "save_restore": {"at": 0.5, "within": 0.0},
    "convergence": {"halvings": 2, "within": 1e-3},
    "release": {"fmu": None, "allow": "minor"},
    "speed": {"fmu": None, "at_most": 1.5, "memory_at_most": 1.5, "runs": 5},
}


def settings_of(table: TomlTable) -> dict[str, Mapping[str, Any]]:
    """Settings of the checks that [checks] names, complete.

    Raises:
        MisfitError: if a check or key is unknown, or a value is of another type.
    """
    found: dict[str, Mapping[str, Any]] = {}
    for name, given in table.values.items():
        if name not in CHECKS:
            raise MisfitError(f"{table.where}: unknown check {shown(name)}; {nearest(name, CHECKS)}")
        usual = CHECKS[name]
        if given is False:
            continue
        if isinstance(given, str) and "fmu" in usual:
            given = {"fmu": given}
        if given is not True and not isinstance(given, dict):
            raise table.wrong(name, "true, false or a table")
        own = TomlTable(f"{table.where} {name}", {} if given is True else given)
        found[name] = {**usual, **{key: _value(own, key, usual) for key in own.values}}
        missing = [key for key, value in found[name].items() if value is None]
        if missing:
            raise MisfitError(f"{own.where}: no {missing[0]}; expected a file to compare with")
    return found


def _value(table: TomlTable, key: str, usual: Mapping[str, Any]) -> Any:
    if key not in usual:
        raise MisfitError(f"{table.where}: unknown key {shown(key)}; {nearest(key, usual)}")
    value, like = table.values[key], usual[key]
    if isinstance(like, tuple):
        return table.get_texts(key)
    if isinstance(like, int | float):
        found = number(value)
        if found is None or found <= 0.0:
            raise table.wrong(key, "a number above 0")
        return int(found) if isinstance(like, int) else found
    if not isinstance(value, str) or not value:
        raise table.wrong(key, "a text in quotation marks")
    return value

"""A system as the text of a TOML file."""

import json
from collections.abc import Mapping
from math import isclose
from typing import Any

from fmus.errors import MisfitError
from fmus.units import SiUnit, si_exponents
from orchestrator.cosim.system import Connection, System
from orchestrator.measurements.wording import shown


def write_toml(system: System) -> str:
    """Give the text of a TOML file that reads back as the same system.

    Raises:
        MisfitError: if the system defines a unit in its own way, which TOML has no place for, or holds a value that is
            none of TOML.
    """
    _check_units(system)
    lines = [f"name = {_literal(system.name)}", ""]
    run = system.run
    pairs = {"start": run.start, "stop": run.stop, "step": run.step, "master": run.master, "tolerance": run.tolerance}
    lines += [
        "[run]",
        *_pairs(
            {
                k: v
                for k, v in {**pairs, "options": dict(run.options), "nan": dict(run.nan)}.items()
                if v not in (None, {})
            }
        ),
    ]
    for name, spec in system.components.items():
        named = {spec.kind: spec.source} if spec.source else {"kind": spec.kind}
        table = {**named, "step": spec.step, "isolate": spec.isolate}
        parameters = {key: {"value": v.value, "unit": v.unit} if v.unit else v.value for key, v in spec.values.items()}
        table = {
            k: v
            for k, v in {**table, **spec.options, "parameters": parameters, "units": dict(spec.units)}.items()
            if v not in (None, "", {})
        }
        lines += ["", f"[components.{_key(name)}]", *_pairs(table)]
    for title, mapping in (("inputs", system.inputs), ("outputs", system.outputs), ("units", system.units)):
        if mapping:
            lines += ["", f"[{title}]", *_pairs(mapping)]
    for connection in system.connections:
        lines += ["", "[[connections]]", *_pairs(_connection_table(connection))]
    return "\n".join(lines) + "\n"


def _check_units(system: System) -> None:
    """Raise MisfitError if a unit in use means something else here than its name says: TOML has names only."""
    used = [(unit, system.definitions.get(unit)) for unit in system.units.values()]
    for spec in system.components.values():
        used += [(unit, system.definitions.get(unit)) for unit in spec.units.values()]
        used += [(value.unit, value.si) for value in spec.values.values()]
    for unit, si in used:
        if si is not None and not _means_its_name(unit, si):
            raise MisfitError(f"system {system.name!r} defines the unit {unit!r} in its own way; keep it as SSP")


def _means_its_name(unit: str, si: SiUnit) -> bool:
    try:
        named = si_exponents(unit)
    except MisfitError:
        return False
    alike = isclose(si.factor, named.factor, rel_tol=1e-9) and isclose(si.offset, named.offset, abs_tol=1e-9)
    return alike and si.exponents == named.exponents


def _connection_table(connection: Connection) -> dict[str, Any]:
    table: dict[str, Any] = {"from": connection.source, "to": connection.target}
    if (connection.factor, connection.offset) != (1.0, 0.0):
        table |= {"factor": connection.factor, "offset": connection.offset}
    if connection.mapping:
        table["mapping"] = connection.mapping
    return table if connection.convert else {**table, "convert": False}


def _pairs(table: Mapping[str, Any]) -> list[str]:
    return [f"{_key(key)} = {_literal(value)}" for key, value in table.items()]


def _key(key: str) -> str:
    return key if key.isascii() and key.replace("_", "").replace("-", "").isalnum() else _literal(key)


def _literal(value: Any) -> str:
    if isinstance(value, Mapping):
        return "{ " + ", ".join(_pairs(value)) + " }" if value else "{}"
    if isinstance(value, list | tuple):
        return f"[{', '.join(_literal(each) for each in value)}]"
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int | float):
        return repr(value)
    if hasattr(value, "tolist"):  # NumPy's numbers and arrays
        return _literal(value.tolist())
    raise MisfitError(f"{shown(value)} cannot be written as TOML")

"""Values that a user gives for parameters and inputs: checked against the port and converted to its unit."""

import json
import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from fmus.errors import MisfitError
from fmus.units import SiUnit, after_number
from orchestrator.cosim.compatible import unit_scaling
from orchestrator.cosim.component import FLOATS, INTEGERS, Port
from orchestrator.cosim.system import Value
from orchestrator.measurements.toml_values import TomlTable
from orchestrator.measurements.wording import shown

_SETTABLE = ("input", "parameter", "structuralParameter")
_TRUTH = {"true": True, "false": False, "1": True, "0": False}


def port_value(port: Port, given: Value, definitions: Mapping[str, SiUnit] | None = None) -> Any:
    """Turn a value that a user gave into one for the port: of its type and shape, in its unit, within its range.

    Text is read as the port's type needs it, a number with a unit behind it included: `"2.5 mm"`. An item of an enumeration
    may be given by name, Binary as hexadecimal text.

    Args:
        port: the port.
        given: the value, with a unit if it has one.
        definitions: units that the system defines.

    Raises:
        MisfitError: if the port cannot be set or the value does not fit; the message does not name the component.
    """
    if port.causality not in _SETTABLE and port.initial not in ("exact", "approx"):
        what = f"causality {port.causality}" + (f", initial = {port.initial}" if port.initial else "")
        raise MisfitError(f"{port.name} is computed by the component ({what}); only inputs and parameters can be set")
    value, unit = _read(port, given)
    convert = _conversion(port, unit, (given.si if unit == given.unit else None) or (definitions or {}).get(unit))
    if not port.shape:
        return convert(_scalar(port, value))
    elements = np.asarray(value, dtype=object)
    if elements.shape != port.shape:
        raise MisfitError(f"{port.name} has shape {port.shape}, the value {shown(value)} has shape {elements.shape}")
    converted = [convert(_scalar(port, element)) for element in elements.ravel()]
    if port.type in ("String", "Binary"):
        return np.array(converted, dtype=object).reshape(port.shape)
    return np.array(converted).reshape(port.shape)


def _read(port: Port, given: Value) -> tuple[Any, str]:
    """The value, parsed where it is text for something that is none, and its unit."""
    if not isinstance(given.value, str) or (port.type in ("String", "Binary", "Enumeration") and not port.shape):
        return given.value, given.unit
    text, unit = given.value.strip(), given.unit
    if port.type in FLOATS and not text.startswith("["):
        number, _, behind = text.partition(" ")
        text, unit = number, behind.strip() or unit
    if port.type == "Boolean" and text.lower() in _TRUTH:
        return _TRUTH[text.lower()], unit
    try:
        return json.loads(text), unit
    except ValueError:
        raise _wrong(port, given.value) from None


def _conversion(port: Port, unit: str, si: SiUnit | None) -> Callable[[Any], Any]:
    if not unit or (unit == port.unit and (si is None or port.si is None)):
        return lambda value: _in_range(port, value, "")
    if port.type not in FLOATS:
        raise MisfitError(f"{port.name} is of type {port.type}, which has no unit; {shown(unit)} was given")
    if not port.unit:
        raise MisfitError(f"{port.name} has no unit in the component; give the value without {shown(unit)}")
    try:
        factor, offset = unit_scaling(replace(port, unit=unit, si=si), port)
    except MisfitError as error:
        raise MisfitError(f"{port.name} is in {port.unit}: {error}") from error
    return lambda value: _in_range(port, factor * value + offset, f" (given as {value:g} {unit})")


def _scalar(port: Port, value: Any) -> Any:
    if isinstance(value, np.generic):
        value = value.item()
    if port.type in FLOATS:
        if isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value):
            return float(value)
    elif port.type in INTEGERS:
        if isinstance(value, int | float) and not isinstance(value, bool) and float(value).is_integer():
            return _of_its_size(port, int(value))
    elif port.type == "Enumeration":
        return _item(port, value)
    elif port.type == "Boolean":
        if value in (0, 1):
            return bool(value)
    elif port.type == "String":
        if isinstance(value, str):
            return value
    elif port.type == "Binary":
        return _bytes(port, value)
    raise _wrong(port, value)


def _of_its_size(port: Port, value: int) -> int:
    bits, signed = int(port.type.lstrip("UInt")), not port.type.startswith("U")
    low, high = (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1) if signed else (0, 2**bits - 1)
    if not low <= value <= high:
        raise MisfitError(f"{port.name} = {value} is outside [{low}, {high}] of its type {port.type}")
    return value


def _item(port: Port, value: Any) -> int:
    items = dict(port.items)
    if isinstance(value, str) and value in items:
        return items[value]
    if isinstance(value, int) and not isinstance(value, bool) and (not items or value in items.values()):
        return value
    known = ", ".join(f"{name} ({number})" for name, number in port.items) or "a whole number"
    raise MisfitError(f"{port.name} = {shown(value)} is no item of its enumeration; expected {known}")


def _bytes(port: Port, value: Any) -> bytes:
    if isinstance(value, bytes):
        return value
    try:
        return bytes.fromhex(value)
    except (TypeError, ValueError):
        raise _wrong(port, value) from None


def _in_range(port: Port, value: Any, given: str) -> Any:
    low = -math.inf if port.minimum is None else port.minimum
    high = math.inf if port.maximum is None else port.maximum
    number = isinstance(value, int | float) and not isinstance(value, bool)
    if number and not low <= value <= high:
        unit = after_number(port.unit)
        raise MisfitError(f"{port.name} = {value:g}{unit}{given} is outside [{low:g}, {high:g}]{unit}")
    return value


def _wrong(port: Port, value: Any) -> MisfitError:
    kind = port.type if not port.shape else f"{port.type} of shape {port.shape}"
    return MisfitError(f"{port.name} = {shown(value)} is not of the type {kind}")


def value_of(table: TomlTable, key: str) -> Value:
    """A value from a TOML file, plain or with its unit: `3.0`, or `{ value = 3.0, unit = "cm" }`.

    Raises:
        MisfitError: if it is a table of another shape; names file, key and value.
    """
    value = table.values[key]
    if not isinstance(value, dict):
        return Value(value)
    if set(value) - {"value", "unit"} or "value" not in value or not isinstance(value.get("unit", ""), str):
        raise table.wrong(key, 'a value or { value = ..., unit = "..." }')
    return Value(value["value"], value.get("unit", ""))

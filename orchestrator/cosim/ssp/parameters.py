"""Parameter values (SSV) and their mappings (SSM)."""

import xml.etree.ElementTree as ET
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from fmus.errors import MisfitError
from fmus.units import SiUnit
from orchestrator.cosim.ssp.tree import Transformation
from orchestrator.cosim.ssp.xml import NAMESPACES, children, local, number, required, truth, unit_name, units
from orchestrator.cosim.system import Value
from orchestrator.measurements.wording import shown

_FLOATS = ("Real", "Float64", "Float32")
_INTEGERS = ("Integer", "Int8", "UInt8", "Int16", "UInt16", "Int32", "UInt32", "Int64", "UInt64")
_TRUTH = {"true": True, "1": True, "false": False, "0": False}


def parameter_set(root: ET.Element, where: str) -> dict[str, Value]:
    """Values of an `ssv:ParameterSet` by name.

    Raises:
        MisfitError: if a value is not of its type.
    """
    defined = units(root, "ssv", where)
    found = {}
    for parameter in children(root, "ssv:Parameters/ssv:Parameter"):
        name = required(parameter, "name", where)
        typed = next(
            (e for e in parameter if local(e) not in ("Dimension", "Annotations", "MetaData", "Signature")), None
        )
        if typed is None:
            raise MisfitError(f"{where}: parameter {shown(name)} has no value")
        sizes = [int(number(d, "size", 0.0, where) or 0) for d in children(parameter, "ssc:Dimension")]
        found[name] = _value(typed, sizes, defined, f"{where}: parameter {shown(name)}")
    return found


def mapped(values: Mapping[str, Value], mapping: ET.Element | None, where: str) -> dict[str, Value]:
    """Values under the names of an `ssm:ParameterMapping`, without those that it does not name; all without a mapping.

    Raises:
        MisfitError: if a transformation does not fit a value.
    """
    if mapping is None:
        return dict(values)
    found = {}
    for entry in children(mapping, "ssm:MappingEntry"):
        source, target = required(entry, "source", where), required(entry, "target", where)
        if source not in values:
            continue
        value = values[source]
        if truth(entry, "suppressUnitConversion"):
            value = Value(value.value)
        found[target] = transformed(value, transformation(entry, where), f"{where}: {shown(source)}")
    return found


def transformation(element: ET.Element, where: str) -> Transformation:
    """The transformation inside a connection or a mapping entry; the identity where there is none.

    Raises:
        MisfitError: if a number is none.
    """
    linear = element.find("ssc:LinearTransformation", NAMESPACES)
    if linear is not None:
        factor, offset = number(linear, "factor", 1.0, where), number(linear, "offset", 0.0, where)
        assert factor is not None and offset is not None
        return Transformation(factor, offset)
    for kind in ("Boolean", "Integer", "Enumeration"):
        found = element.find(f"ssc:{kind}MappingTransformation", NAMESPACES)
        if found is not None:
            pairs = [
                (_text(kind, required(e, "source", where), where), _text(kind, required(e, "target", where), where))
                for e in children(found, "ssc:MapEntry")
            ]
            return Transformation(pairs=tuple(pairs))
    return Transformation()


def transformed(value: Value, by: Transformation, what: str) -> Value:
    """Apply a transformation to a value.

    Raises:
        MisfitError: if it is linear and the value has a unit: the standard wants the conversion to the unit of the target
            first, which only the target knows.
    """
    if by.pairs:
        pairs = dict(by.pairs)
        return replace(value, value=pairs.get(value.value, value.value))
    if by.is_identity:
        return value
    if value.unit and by.offset:
        raise MisfitError(
            f"{what} in {value.unit} has an offset that is meant in the unit of the target; "
            f"give the value in that unit, or set suppressUnitConversion"
        )
    scaled = by.factor * np.asarray(value.value, dtype=float) + by.offset
    return replace(value, value=scaled.tolist())


def _value(typed: ET.Element, sizes: list[int], defined: Mapping[str, SiUnit], where: str) -> Value:
    kind, text = local(typed), typed.get("value")
    unit = unit_name(typed, defined)
    if kind in ("String", "Binary", "Enumeration") and sizes:
        texts = [required(each, "value", where) for each in typed if local(each) in ("Value", "Item")]
        return Value(_shaped(texts or (text or "").split(), sizes, where), unit)
    if text is None:
        raise MisfitError(f"{where} has no value")
    if sizes:
        return Value(
            _shaped([_text(kind, each, where) for each in text.split()], sizes, where), unit, defined.get(unit)
        )
    return Value(_text(kind, text, where), unit, defined.get(unit))


def _shaped(values: list[Any], sizes: list[int], where: str) -> Any:
    if len(values) != int(np.prod(sizes)):
        raise MisfitError(f"{where} has {len(values)} values, its dimensions are {tuple(sizes)}")
    return np.array(values, dtype=object).reshape(sizes).tolist()


def _text(kind: str, text: str, where: str) -> Any:
    try:
        if kind in _FLOATS:
            return float(text)
        if kind in _INTEGERS:
            return int(text)
        return _TRUTH[text] if kind == "Boolean" else text
    except (ValueError, KeyError):
        raise MisfitError(f"{where}: {shown(text)} is not of the type {kind}") from None

"""From the XML of a system structure, and of those that it names, to a tree of parts."""

import xml.etree.ElementTree as ET
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from fmus.errors import MisfitError
from fmus.units import SiUnit
from orchestrator.cosim.ssp.files import (
    NAMESPACES,
    STRUCTURE,
    children,
    local,
    located,
    number,
    parse,
    required,
    truth,
    unit_name,
    units,
    unpacked,
)
from orchestrator.cosim.ssp.tree import Connector, End, Part, Transformation, Wire
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

    Args:
        values: values by name.
        mapping: the mapping, None for none.
        where: file and element, for messages.

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

    Args:
        value: the value.
        by: a factor and an offset, or pairs of values.
        what: the value in words, for messages.

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


_FMU, _SSD, _SSP = "application/x-fmu-sharedlibrary", "application/x-ssp-definition", "application/x-ssp-package"
_DEEPEST = 50


def parse_structure(path: Path, root: Path, depth: int = 0) -> Part:
    """Read an SSD below the folder `root`, and the structures that its components name.

    Args:
        path: the SSD.
        root: the folder that nothing may lead out of.
        depth: how many structures it is nested in.

    Raises:
        MisfitError: if a file is missing, unsafe or not what SSP says; the message names file and element.
    """
    if depth > _DEEPEST:
        raise MisfitError(f"{path}: systems are nested more than {_DEEPEST} deep; does one contain itself?")
    element = parse(path.read_bytes(), path, "ssd:SystemStructureDescription")
    version = element.get("version", "")
    if version.split(".")[0] not in ("1", "2"):
        raise MisfitError(f"{path}: version {shown(version)}; SSP 1.0 and 2.0 can be read")
    system = element.find("ssd:System", NAMESPACES)
    if system is None:
        raise MisfitError(f"{path}: no System inside")
    part = _Parser(path, root, units(element, "ssd", str(path)), element, depth).part(system)
    experiment = element.find("ssd:DefaultExperiment", NAMESPACES)
    defaults = {}
    for ours, theirs in (("start", "startTime"), ("stop", "stopTime")):
        value = None if experiment is None else number(experiment, theirs, None, str(path))
        if value is not None:
            defaults[ours] = value
    return replace(part, defaults=defaults)


@dataclass(frozen=True)
class _Parser:
    path: Path
    root: Path
    definitions: Mapping[str, SiUnit]
    document: ET.Element
    depth: int

    def part(self, element: ET.Element) -> Part:
        name = required(element, "name", str(self.path))
        where = f"{self.path}: {name}"
        kind = local(element)
        if kind == "Component":
            return self._component(element, name, where)
        base = Part(
            name,
            {connector.name: connector for connector in self._connectors(element, where)},
            self.definitions,
            bindings=tuple(self._bindings(element, where)),
        )
        if kind == "SignalDictionaryReference":
            return replace(base, dictionary=required(element, "dictionary", where))
        parts = element.find("ssd:Elements", NAMESPACES)
        inside = [] if parts is None else [self.part(each) for each in parts if local(each) != "Annotations"]
        names = [each.name for each in inside]
        if len(set(names)) != len(names):
            twice = next(each for each in names if names.count(each) > 1)
            raise MisfitError(f"{where}: two elements are named {shown(twice)}")
        return replace(
            base,
            parts=tuple(inside),
            wires=tuple(self._wire(each, where) for each in children(element, "ssd:Connections/ssd:Connection")),
            dictionaries=tuple(
                required(each, "name", where)
                for each in children(element, "ssd:SignalDictionaries/ssd:SignalDictionary")
            ),
        )

    def _component(self, element: ET.Element, name: str, where: str) -> Part:
        connectors = {connector.name: connector for connector in self._connectors(element, where)}
        bindings = tuple(self._bindings(element, where))
        source, kind = element.get("source"), element.get("type", _FMU)
        if source is None:
            raise MisfitError(f"{where}: the component has no source, so there is nothing to run; give it an FMU")
        if source.startswith("#"):
            return self._again(source[1:], name, bindings, where)
        file, fragment = located(source, self.path, self.root, where)
        if kind in (_SSD, _SSP) or file.suffix.lower() in (".ssd", ".ssp"):
            inside = unpacked(file) if kind == _SSP or file.suffix.lower() == ".ssp" else None
            structure = file if inside is None else inside / (fragment or STRUCTURE)
            part = parse_structure(structure, inside or self.root, self.depth + 1)
            return replace(part, name=name, bindings=part.bindings + bindings)
        if kind != _FMU:
            raise MisfitError(f"{where}: type {shown(kind)}; only FMUs and system structures can be run")
        interface = element.get("implementation", "any")
        return Part(
            name,
            connectors,
            self.definitions,
            source=file,
            interface=None if interface == "any" else interface,
            bindings=bindings,
        )

    def _again(self, identifier: str, name: str, bindings: tuple[Mapping[str, Value], ...], where: str) -> Part:
        """Another instance of a system of the same document."""
        for each in self.document.iter():
            if each.get("id") == identifier and local(each) == "System":
                if self.depth >= _DEEPEST:
                    raise MisfitError(
                        f"{where}: systems are nested more than {_DEEPEST} deep; does one contain itself?"
                    )
                part = replace(self, depth=self.depth + 1).part(each)
                return replace(part, name=name, bindings=part.bindings + bindings)
        raise MisfitError(f"{where}: there is no system with the id {shown(identifier)}")

    def _connectors(self, element: ET.Element, where: str) -> Iterator[Connector]:
        for each in children(element, "ssd:Connectors/ssd:Connector"):
            typed = next(
                (e for e in each if e.tag.startswith("{" + NAMESPACES["ssc"]) and local(e) != "Dimension"), None
            )
            unit = "" if typed is None else unit_name(typed, self.definitions)
            yield Connector(required(each, "name", where), each.get("kind", ""), unit)

    def _wire(self, element: ET.Element, where: str) -> Wire:
        ends = []
        for side in ("start", "end"):
            indices = tuple(int(text) for text in (element.get(f"{side}Indices") or "").split() if text.isdigit())
            connector = required(element, f"{side}Connector", where)
            ends.append(End(element.get(f"{side}Element") or None, connector, indices))
        convert = not truth(element, "suppressUnitConversion")
        return Wire(ends[0], ends[1], transformation(element, where), convert)

    def _bindings(self, element: ET.Element, where: str) -> Iterator[Mapping[str, Value]]:
        for binding in children(element, "ssd:ParameterBindings/ssd:ParameterBinding"):
            at = f"{where}: parameter binding"
            values = self._content(binding, "ssd:ParameterValues", "ssv:ParameterSet", at)
            if values is None:
                raise MisfitError(f"{at} has neither a source nor values")
            prefix = binding.get("prefix", "")
            found = {f"{prefix}{name}": value for name, value in parameter_set(values, at).items()}
            place = binding.find("ssd:ParameterMapping", NAMESPACES)
            mapping = None if place is None else self._content(place, "", "ssm:ParameterMapping", at)
            yield mapped(found, mapping, at)

    def _content(self, holder: ET.Element, inline: str, tag: str, where: str) -> ET.Element | None:
        """What a binding or mapping holds: a file, or an element inside."""
        source = holder.get("source")
        if source is None:
            return holder.find(f"{inline}/{tag}" if inline else tag, NAMESPACES)
        if holder.get("sourceBase", "SSD") != "SSD":
            raise MisfitError(
                f"{where}: values inside a component cannot be read; copy {shown(source)} beside the structure"
            )
        file, _ = located(source, self.path, self.root, where)
        return parse(file.read_bytes(), file, tag)

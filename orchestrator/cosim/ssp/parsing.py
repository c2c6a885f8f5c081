"""From the XML of a system structure, and of those that it names, to a tree of parts."""

import xml.etree.ElementTree as ET
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from fmus.errors import MisfitError
from fmus.units import SiUnit
from orchestrator.cosim.ssp.files import STRUCTURE, located, unpacked
from orchestrator.cosim.ssp.parameters import mapped, parameter_set, transformation
from orchestrator.cosim.ssp.tree import Connector, End, Part, Wire
from orchestrator.cosim.ssp.xml import NAMESPACES, children, local, number, parse, required, truth, unit_name, units
from orchestrator.cosim.system import Value
from orchestrator.measurements.wording import shown

_FMU, _SSD, _SSP = "application/x-fmu-sharedlibrary", "application/x-ssp-definition", "application/x-ssp-package"
_DEEPEST = 50


def parse_structure(path: Path, root: Path, depth: int = 0) -> Part:
    """Read an SSD below the folder `root`, and the structures that its components name.

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

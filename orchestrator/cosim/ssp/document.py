"""The XML of an exported system: structure, connectors, connections, units, and the set of parameter values."""

import json
import xml.etree.ElementTree as ET
from collections.abc import Iterable, Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any
from urllib.parse import quote

import numpy as np

from fmus.description_parts import base_unit
from fmus.errors import MisfitError
from fmus.files import write_atomically
from fmus.package import zipped
from fmus.units import SiUnit, si_exponents
from orchestrator.cosim.addresses import Element, resolve
from orchestrator.cosim.component import FLOATS, Port
from orchestrator.cosim.connections import wire
from orchestrator.cosim.kinds import describe
from orchestrator.cosim.ssp.files import NAMESPACES, STRUCTURE, qualified
from orchestrator.cosim.ssp.reading import ANNOTATION
from orchestrator.cosim.system import ComponentSpec, Connection, System, Value, split_address
from orchestrator.cosim.values import port_value

PARAMETERS = "resources/parameters.ssv"
_OLD_TYPES = {"Float64": "Real", "Int32": "Integer", "Boolean": "Boolean", "String": "String", "Binary": "Binary"}


class Document:
    """Writes one system; `ports` are those of its components, `sources` the paths of their FMUs in the archive."""

    def __init__(self, system: System, ports: Mapping[str, Mapping[str, Port]], sources: Mapping[str, str]) -> None:
        self.system, self.ports, self.sources = system, ports, sources
        self.units: dict[str, SiUnit] = dict(system.definitions)
        self.enumerations: dict[str, tuple[tuple[str, int], ...]] = {}
        self.version = "1.0"
        self.connected: dict[str, dict[str, None]] = {name: {} for name in ports}
        self.parameters = self._parameter_set()

    def structure(self) -> bytes:
        """Content of SystemStructure.ssd."""
        root = ET.Element(qualified("ssd:SystemStructureDescription"), version="1.0", name=self.system.name)
        system = _sub(root, "ssd:System", name=self.system.name)
        wires = [self._wire(connection) for connection in self._connections()]
        self._outer(system)
        if self.parameters is not None:
            _sub(_sub(system, "ssd:ParameterBindings"), "ssd:ParameterBinding", source=PARAMETERS)
        elements = _sub(system, "ssd:Elements")
        for name, spec in self.system.components.items():
            self._component(elements, name, spec)
        if wires:
            _sub(system, "ssd:Connections").extend(wires)
        self._definitions(root)
        run = self.system.run
        if run.stop is not None:  # some tools need both
            _sub(root, "ssd:DefaultExperiment", startTime=repr(run.start or 0.0), stopTime=repr(run.stop))
        self._annotation(root)
        root.set("version", self.version)
        return to_bytes(root)

    def _connections(self) -> Iterable[Connection]:
        yield from self.system.connections
        for name, targets in self.system.inputs.items():
            yield from (Connection(name, target) for target in targets)
        yield from (Connection(source, name) for name, source in self.system.outputs.items())

    def _wire(self, connection: Connection) -> ET.Element:
        element = ET.Element(qualified("ssd:Connection"))
        for side, address in (("start", connection.source), ("end", connection.target)):
            if address in self.system.inputs or address in self.system.outputs:
                element.set(f"{side}Connector", address)
                continue
            component, variable = split_address(address)
            elements = resolve(self.ports[component], variable, component)
            self.connected[component][elements[0].port.name] = None
            element.set(f"{side}Element", component)
            element.set(f"{side}Connector", elements[0].port.name)
            self._indices(element, side, variable, elements)
        if not connection.convert:
            element.set("suppressUnitConversion", "true")
        self._transformation(element, connection)
        return element

    def _indices(self, element: ET.Element, side: str, variable: str, elements: list[Element]) -> None:
        port = elements[0].port
        if variable == port.name:
            return
        if len(elements) > 1:
            raise MisfitError(
                f"{variable!r} stands for {len(elements)} scalars, which SSP connects one by one; name each"
            )
        self.version = "2.0"
        position = np.unravel_index(elements[0].index, port.shape)
        element.set(f"{side}Indices", " ".join(str(int(k) + 1) for k in position))

    def _transformation(self, element: ET.Element, connection: Connection) -> None:
        if connection.mapping:
            kinds = {bool: "Boolean", str: "Enumeration"}
            kind = kinds.get(type(connection.mapping[0][0]), "Integer")
            mapping = _sub(element, f"ssc:{kind}MappingTransformation")
            for one, other in connection.mapping:
                if type(one) is not type(other):
                    raise MisfitError(
                        f"connection {connection.source} -> {connection.target} maps {one!r} to {other!r}; "
                        f"SSP maps within one type only"
                    )
                _sub(mapping, "ssc:MapEntry", source=_xml(one), target=_xml(other))
        elif (connection.factor, connection.offset) != (1.0, 0.0):
            _sub(element, "ssc:LinearTransformation", factor=repr(connection.factor), offset=repr(connection.offset))

    def _outer(self, system: ET.Element) -> None:
        """Connectors of the system itself."""
        if not self.system.inputs and not self.system.outputs:
            return
        connectors = _sub(system, "ssd:Connectors")
        tables = (
            ("input", {n: targets[0] for n, targets in self.system.inputs.items()}),
            ("output", self.system.outputs),
        )
        for kind, table in tables:
            for name, address in table.items():
                component, variable = split_address(address)
                elements = resolve(self.ports[component], variable, component)
                unit = self.system.units.get(name) or self._unit(component, elements[0].port)
                whole = len(elements) == elements[0].port.size
                self._connector(connectors, name, kind, elements[0].port, unit, elements[0].port.shape if whole else ())

    def _component(self, elements: ET.Element, name: str, spec: ComponentSpec) -> None:
        element = _sub(
            elements,
            "ssd:Component",
            name=name,
            type="application/x-fmu-sharedlibrary",
            source=quote(self.sources[name]),
        )
        if spec.options.get("interface"):
            element.set("implementation", spec.options["interface"])
        # An input that nothing drives is left out: some tools drive every connector of a component.
        shown = [p for p in self.ports[name].values() if p.name in self.connected[name] or p.causality == "output"]
        if shown:
            connectors = _sub(element, "ssd:Connectors")
            for port in shown:
                if port.type != "Clock":
                    self._connector(connectors, port.name, port.causality, port, self._unit(name, port), port.shape)

    def _connector(
        self, parent: ET.Element, name: str, kind: str, port: Port, unit: str, shape: tuple[int, ...]
    ) -> None:
        connector = _sub(parent, "ssd:Connector", name=name, kind=kind)
        typed = _sub(connector, f"ssc:{self._type(port)}")
        if port.type in FLOATS and unit and self._defined(unit, port):
            typed.set("unit", unit)
        if port.type == "Enumeration":
            typed.set("name", self._enumeration(port))
        for size in shape:
            self.version = "2.0"
            _sub(connector, "ssc:Dimension", size=str(size))

    def _parameter_set(self) -> ET.Element | None:
        if not any(spec.values for spec in self.system.components.values()):
            return None
        found = ET.Element(qualified("ssv:ParameterSet"), version="1.0", name=self.system.name)
        parameters = _sub(found, "ssv:Parameters")
        for name, spec in self.system.components.items():
            for variable, value in spec.values.items():
                elements = resolve(self.ports[name], variable, name)
                if elements[0].port.name != variable:
                    raise MisfitError(
                        f"{name}.{variable}: SSP sets whole variables only; give all elements of the array"
                    )
                self._parameter(parameters, f"{name}.{variable}", elements[0].port, value)
        self._enumerations(found, "ssv")
        found.set("version", self.version)
        return found

    def _parameter(self, parent: ET.Element, name: str, port: Port, value: Value) -> None:
        given = port_value(port, value, self.system.definitions)
        parameter = _sub(parent, "ssv:Parameter", name=name)
        typed = _sub(parameter, f"ssv:{self._type(port)}")
        if port.type == "Enumeration":
            names = {number: item for item, number in port.items}
            typed.set("value", names.get(given, str(given)))
            typed.set("name", self._enumeration(port))
        elif port.shape:
            typed.set("value", " ".join(_xml(each) for each in np.ravel(given).tolist()))
            for size in port.shape:
                self.version = "2.0"
                _sub(parameter, "ssc:Dimension", size=str(size))
        else:
            typed.set("value", _xml(given))

    def _type(self, port: Port) -> str:
        if port.type in _OLD_TYPES or port.type == "Enumeration":
            return _OLD_TYPES.get(port.type, port.type)
        self.version = "2.0"
        return port.type

    def _unit(self, component: str, port: Port) -> str:
        return port.unit or self.system.components[component].units.get(port.name, "")

    def _defined(self, unit: str, port: Port) -> bool:
        """Whether the file can say what a unit means: by the FMU's definition, else by its name."""
        if unit not in self.units:
            try:
                self.units[unit] = port.si if port.si is not None and unit == port.unit else si_exponents(unit)
            except MisfitError:
                return False
        return unit != port.unit or port.si is None or self.units[unit] == port.si

    def _enumeration(self, port: Port) -> str:
        for name, items in self.enumerations.items():
            if items == port.items:
                return name
        name = f"enumeration{len(self.enumerations) + 1}"
        self.enumerations[name] = port.items
        return name

    def _definitions(self, root: ET.Element) -> None:
        self._enumerations(root, "ssd")
        if self.units:
            parent = _sub(root, "ssd:Units")
            for name, si in self.units.items():
                _sub(_sub(parent, "ssc:Unit", name=name), "ssc:BaseUnit", **base_unit(si))

    def _enumerations(self, root: ET.Element, prefix: str) -> None:
        if self.enumerations:
            parent = _sub(root, f"{prefix}:Enumerations")
            for name, items in self.enumerations.items():
                enumeration = _sub(parent, "ssc:Enumeration", name=name)
                for item, number in items:
                    _sub(enumeration, "ssc:Item", name=item, value=str(number))

    def _annotation(self, root: ET.Element) -> None:
        components = {
            name: {key: value for key, value in (("step", spec.step), ("isolate", spec.isolate)) if value is not None}
            for name, spec in self.system.components.items()
        }
        noted = {
            "run": asdict(self.system.run),
            "components": {name: found for name, found in components.items() if found},
        }
        annotation = _sub(_sub(root, "ssd:Annotations"), "ssc:Annotation", type=ANNOTATION)
        ET.SubElement(annotation, "json").text = json.dumps(noted)


def _sub(parent: ET.Element, tag: str, **attributes: str) -> ET.Element:
    return ET.SubElement(parent, qualified(tag), attributes)


def to_bytes(root: ET.Element) -> bytes:
    """An XML document with the prefixes that people know."""
    for prefix, uri in NAMESPACES.items():
        ET.register_namespace(prefix, uri)
    ET.indent(root)
    return ET.tostring(root, encoding="utf-8", xml_declaration=True)


def _xml(value: Any) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, bytes):
        return value.hex()
    return repr(value) if isinstance(value, float) else str(value)


def write_ssp(system: System, path: Path) -> Path:
    """Write a system of FMUs as an SSP; returns the path. The same system gives the same bytes.

    Parameter values are in `resources/parameters.ssv`, in the units of the variables, named `component.variable`.

    Raises:
        MisfitError: if a component is no FMU, the system does not pass its checks, or the file cannot be written.
    """
    others = [name for name, spec in system.components.items() if spec.kind != "fmu"]
    if others:
        raise MisfitError(
            f"system {system.name!r}: {', '.join(others)} cannot be in an SSP, which holds FMUs only; take it out first"
        )
    descriptions = {name: describe(spec, system.folder) for name, spec in system.components.items()}
    wire(system, descriptions)
    ports = {name: {port.name: port for port in each.ports} for name, each in descriptions.items()}
    sources = _resources(system)
    writer = Document(system, ports, sources)
    document = writer.structure()
    files = {STRUCTURE: document} | {
        sources[n]: (system.folder / s.source).read_bytes() for n, s in system.components.items()
    }
    if writer.parameters is not None:
        files[PARAMETERS] = to_bytes(writer.parameters)
    try:
        write_atomically(path, zipped(files, first=STRUCTURE))
    except OSError as error:
        raise MisfitError(f"{path} cannot be written: {error.strerror}; choose another place") from error
    return path


def _resources(system: System) -> dict[str, str]:
    """Path in the archive of each component's FMU; components with the same file share it."""
    paths: dict[Path, str] = {}
    for spec in system.components.values():
        file = (system.folder / spec.source).resolve()
        if file not in paths:
            name, number = file.name, 1
            while f"resources/{name}" in paths.values():
                number += 1
                name = f"{file.stem}_{number}{file.suffix}"
            paths[file] = f"resources/{name}"
    return {name: paths[(system.folder / spec.source).resolve()] for name, spec in system.components.items()}

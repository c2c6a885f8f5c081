"""Model descriptions of a container, for FMI 2.0 and 3.0."""

import math
import xml.etree.ElementTree as ET
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from fmus.description_parts import base_unit, plain_text, to_bytes
from fmus.errors import MisfitError
from fmus.units import SiUnit, si_exponents
from orchestrator.cosim.component import FLOATS, Port
from orchestrator.cosim.container.planned import PlannedSystem
from orchestrator.cosim.container.variables import Exposed

# What the types are called in FMI 2.0; UInt32 does not fit its Integer.
TYPES2 = {"Float64": "Real", "Float32": "Real", "Boolean": "Boolean", "String": "String", "Enumeration": "Enumeration"}
TYPES2 |= dict.fromkeys(("Int8", "UInt8", "Int16", "UInt16", "Int32"), "Integer")


@dataclass(frozen=True)
class Heading:
    """What a description says beside the variables."""

    identifier: str
    guid: str
    sources: Sequence[str]


def description(planned: PlannedSystem, variables: Sequence[Exposed], heading: Heading, version: int) -> bytes:
    """modelDescription.xml; the value reference of a variable is its place in the list.

    Args:
        planned: the system, with the order of its calls.
        variables: what the container shows.
        heading: name, identifier and dates.
        version: 2 or 3, of FMI.

    Raises:
        MisfitError: if two components mean different things by the name of an enumeration's unit.
    """
    system, two = planned.system, version == 2
    root = ET.Element(
        "fmiModelDescription",
        {
            "fmiVersion": f"{version}.0",
            "modelName": plain_text(system.name),
            "guid" if two else "instantiationToken": heading.guid,
            "description": f"Coupled system of {', '.join(system.components)}",
            "generationTool": "misfit",
            "variableNamingConvention": "flat",
        },
    )
    root.append(_interface(planned, heading, two))
    units = _Units(variables)
    if units.definitions:
        root.append(units.element())
    types = _enumerations(variables)
    if types:
        root.append(_type_definitions(types, two))
    run = system.run
    times = {"startTime": run.start or 0.0, "stopTime": run.stop, "tolerance": run.tolerance, "stepSize": planned.step}
    ET.SubElement(root, "DefaultExperiment", {key: repr(float(t)) for key, t in times.items() if t is not None})
    element = ET.SubElement(root, "ModelVariables")
    for reference, variable in enumerate(variables):
        attributes, typed = _attributes(variable, reference), _typed(variable, units, types)
        if two:
            outer = ET.SubElement(element, "ScalarVariable", attributes)
            ET.SubElement(outer, TYPES2[variable.port.type], typed)
        elif variable.port.type == "String":
            start = typed.pop("start", None)
            outer = ET.SubElement(element, "String", attributes | typed)
            if start is not None:
                ET.SubElement(outer, "Start", value=start)
        else:
            ET.SubElement(element, variable.port.type, attributes | typed)
    root.append(_structure(variables, two))
    return to_bytes(root)


def _interface(planned: PlannedSystem, heading: Heading, two: bool) -> ET.Element:
    interfaces = [part.interface for part in planned.parts.values() if part.interface is not None]
    variable = all(part.variable_step for part in planned.parts.values())
    state = "FMUstate" if two else "FMUState"
    flags = {
        "needsExecutionTool": any(each.needs_execution_tool for each in interfaces),
        "canBeInstantiatedOnlyOncePerProcess": any(each.once_per_process for each in interfaces),
        "canHandleVariableCommunicationStepSize": variable,
        f"canGetAndSet{state}": all(each.can_save for each in interfaces),
        f"canSerialize{state}": all(each.can_save and each.can_serialize for each in interfaces),
    }
    element = ET.Element("CoSimulation", modelIdentifier=heading.identifier)
    element.attrib.update({name: str(value).lower() for name, value in flags.items()})
    if two:
        element.set("canNotUseMemoryManagementFunctions", "true")
        files = ET.SubElement(element, "SourceFiles")
        for name in heading.sources:
            ET.SubElement(files, "File", name=name)
    return element


class _Units:
    """Names and meanings of units; two components may mean different things by one name."""

    def __init__(self, variables: Sequence[Exposed]) -> None:
        self.definitions: dict[str, SiUnit | None] = {}
        self.names: dict[tuple[str, SiUnit | None], str] = {}
        for port in (each.port for each in variables):
            if port.unit and port.type in FLOATS:
                self._add(port)

    def _add(self, port: Port) -> None:
        meaning = _meaning(port)
        key = port.unit, None if meaning is None else _frozen(meaning)
        if key in self.names:
            return
        name, number = port.unit, 2
        while name in self.definitions:
            name, number = f"{port.unit} ({number})", number + 1
        self.definitions[name] = meaning
        self.names[key] = name

    def name(self, port: Port) -> str:
        """What the unit of a port is called in the description."""
        meaning = _meaning(port)
        return self.names[port.unit, None if meaning is None else _frozen(meaning)]

    def element(self) -> ET.Element:
        element = ET.Element("UnitDefinitions")
        for name, meaning in self.definitions.items():
            unit = ET.SubElement(element, "Unit", name=name)
            if meaning is not None:
                ET.SubElement(unit, "BaseUnit", base_unit(meaning))
        return element


def _meaning(port: Port) -> SiUnit | None:
    if port.si is not None:
        return port.si
    try:
        return si_exponents(port.unit)
    except MisfitError:
        return None


def _frozen(unit: SiUnit) -> Any:
    return tuple(sorted(unit.exponents.items())), unit.factor, unit.offset


def _enumerations(variables: Sequence[Exposed]) -> dict[tuple[tuple[str, int], ...], str]:
    found: dict[tuple[tuple[str, int], ...], str] = {}
    for port in (each.port for each in variables):
        if port.type == "Enumeration":
            found.setdefault(port.items, f"Enumeration{len(found) + 1}")
    return found


def _type_definitions(types: Mapping[tuple[tuple[str, int], ...], str], two: bool) -> ET.Element:
    element = ET.Element("TypeDefinitions")
    for items, name in types.items():
        outer = ET.SubElement(element, "SimpleType" if two else "EnumerationType", name=name)
        inner = ET.SubElement(outer, "Enumeration") if two else outer
        for item, value in items or (("unnamed", 1),):
            ET.SubElement(inner, "Item", name=item, value=str(value))
    return element


def _attributes(variable: Exposed, reference: int) -> dict[str, str]:
    port = variable.port
    discrete = port.type not in FLOATS
    variability = "discrete" if discrete and port.variability == "continuous" else port.variability
    attributes = {"name": plain_text(variable.name), "valueReference": str(reference)}
    if port.description:
        attributes["description"] = plain_text(port.description)
    attributes |= {"causality": port.causality, "variability": variability}
    if port.causality == "parameter" or has_own_start(variable):
        attributes["initial"] = port.initial or "exact"
    return attributes


def has_own_start(variable: Exposed) -> bool:
    """Whether an output or a state begins at a value that can be set."""
    return (
        variable.port.causality in ("output", "local")
        and variable.start is not None
        and variable.port.initial in ("exact", "approx")
    )


def _typed(variable: Exposed, units: _Units, types: Mapping[tuple[tuple[str, int], ...], str]) -> dict[str, str]:
    port = variable.port
    found = {"declaredType": types[port.items]} if port.type == "Enumeration" else {}
    if port.unit and port.type in FLOATS:
        found["unit"] = units.name(port)
    if port.type not in ("Boolean", "String"):
        bounds = {"min": port.minimum, "max": port.maximum}
        bounds |= {"nominal": port.nominal} if port.type in FLOATS else {}
        found |= {
            key: _shown(value, port.type) for key, value in bounds.items() if value is not None and math.isfinite(value)
        }
    if port.causality in ("input", "parameter") or has_own_start(variable):
        empty = (
            "" if port.type == "String" else False if port.type == "Boolean" else port.items[0][1] if port.items else 0
        )
        found["start"] = _shown(empty if variable.start is None else variable.start, port.type)
    return found


def _shown(value: Any, kind: str) -> str:
    if kind in FLOATS:
        return repr(float(value))
    if kind == "Boolean":
        return str(bool(value)).lower()
    return plain_text(str(value)) if kind == "String" else str(int(value))


def _structure(variables: Sequence[Exposed], two: bool) -> ET.Element:
    element = ET.Element("ModelStructure")
    numbers = {each.name: k for k, each in enumerate(variables)}
    outputs = [(k, each) for k, each in enumerate(variables) if each.port.causality == "output"]
    unknowns = [k for k, each in outputs if not (has_own_start(each) and each.port.initial == "exact")]
    # An FMU of version 2 counts from 1.
    first = 1 if two else 0
    lists = ("Outputs", "InitialUnknowns") if two else ("Output", "InitialUnknown")
    parents = [ET.SubElement(element, name) for name in lists] if two else [element, element]
    key = "index" if two else "valueReference"
    for k, each in outputs:
        known = " ".join(str(numbers[name] + first) for name in sorted(each.knowns, key=numbers.__getitem__))
        ET.SubElement(parents[0], "Unknown" if two else lists[0], {key: str(k + first), "dependencies": known})
    for k in unknowns:  # at the start they may depend on everything
        ET.SubElement(parents[1], "Unknown" if two else lists[1], {key: str(k + first)})
    for parent in parents:
        if two and not len(parent):
            element.remove(parent)
    return element

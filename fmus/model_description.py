"""modelDescription.xml of FMI 2.0: variables, units, and who depends on whom."""

import math
import re
import xml.etree.ElementTree as ET
from collections.abc import Mapping, Sequence

from fmus.errors import FmuError
from fmus.layout import Layout, Scalar
from fmus.model_structure import model_structure
from fmus.symbolic.system import SymbolicSystem
from fmus.units import si_exponents

# XML 1.0 has no way to write the other control characters.
_NOT_XML = re.compile(r"[\x00-\x08\x0b\x0c\x0e-\x1f\ufffe\uffff]")


def model_description(
    system: SymbolicSystem,
    *,
    identifier: str,
    guid: str,
    sources: Sequence[str],
    stop_time: float,
    step_size: float,
    tolerance: float,
) -> bytes:
    """Write the XML of an FMI 2.0 FMU for both interface types. Times are in s; `sources` are file names in `sources/`.

    Raises:
        FmuError: if a value cannot be written, such as a parameter without a value.
        MisfitError: if a unit is unknown.
    """
    layout = Layout(system)
    root = ET.Element(
        "fmiModelDescription",
        fmiVersion="2.0",
        modelName=_text(system.name),
        guid=guid,
        description=_text(system.description),
        generationTool="misfit",
        variableNamingConvention="structured",
        numberOfEventIndicators="0",
    )
    root.append(_interface("ModelExchange", identifier, sources, **_exchange_abilities(system)))
    root.append(_interface("CoSimulation", identifier, sources, **_STEPPING_ABILITIES))
    if units := sorted({s.variable.unit for s in layout.scalars if s.variable.unit}):
        root.append(_unit_definitions(units))
    categories = ET.SubElement(root, "LogCategories")
    ET.SubElement(
        categories,
        "Category",
        name="logStatusError",
        description="Refused calls and steps",
    )
    ET.SubElement(
        root,
        "DefaultExperiment",
        startTime="0",
        stopTime=repr(float(stop_time)),
        tolerance=repr(float(tolerance)),
        stepSize=repr(float(step_size)),
    )
    variables = ET.SubElement(root, "ModelVariables")
    variables.extend([_scalar_variable(reference, s) for reference, s in enumerate(layout.scalars)])
    root.append(_model_structure(layout))
    ET.indent(root)
    return ET.tostring(root, encoding="UTF-8", xml_declaration=True) + b"\n"


_STEPPING_ABILITIES = {"canHandleVariableCommunicationStepSize": "true", "canInterpolateInputs": "true"}


def _exchange_abilities(system: SymbolicSystem) -> dict[str, str]:
    # Only delay operators remember something at the end of a step.
    return {"completedIntegratorStepNotNeeded": "false" if system.n_delays else "true"}


def _interface(tag: str, identifier: str, sources: Sequence[str], **abilities: str) -> ET.Element:
    element = ET.Element(
        tag,
        abilities,
        modelIdentifier=identifier,
        canNotUseMemoryManagementFunctions="true",
        canGetAndSetFMUstate="true",
        canSerializeFMUstate="true",
        providesDirectionalDerivative="true",
    )
    files = ET.SubElement(element, "SourceFiles")
    for name in sources:
        ET.SubElement(files, "File", name=name)
    return element


def _unit_definitions(units: Sequence[str]) -> ET.Element:
    element = ET.Element("UnitDefinitions")
    for name in units:
        si = si_exponents(name)
        base = {key: str(power) for key, power in si.exponents.items()}
        if si.factor != 1.0:
            base["factor"] = repr(si.factor)
        if si.offset != 0.0:
            base["offset"] = repr(si.offset)
        ET.SubElement(ET.SubElement(element, "Unit", name=name), "BaseUnit", base)
    return element


def _scalar_variable(reference: int, scalar: Scalar) -> ET.Element:
    variable = scalar.variable
    attributes = {"name": _text(variable.name), "valueReference": str(reference)}
    if variable.description:
        attributes["description"] = _text(variable.description)
    attributes |= {"causality": scalar.causality, "variability": scalar.variability}
    if scalar.initial:
        attributes["initial"] = scalar.initial
    element = ET.Element("ScalarVariable", attributes)
    ET.SubElement(element, "Real", _real_attributes(scalar))
    return element


def _real_attributes(scalar: Scalar) -> dict[str, str]:
    variable = scalar.variable
    attributes = {"unit": variable.unit} if variable.unit else {}
    bounds = {
        "min": variable.minimum,
        "max": variable.maximum,
        "nominal": variable.nominal,
    }
    attributes |= {key: repr(float(v)) for key, v in bounds.items() if v is not None and math.isfinite(v)}
    if scalar.has_start:
        attributes["start"] = _start(scalar)
    if scalar.derivative_of is not None:
        attributes["derivative"] = str(scalar.derivative_of + 1)
    return attributes


def _start(scalar: Scalar) -> str:
    value = scalar.variable.start
    if value is None and scalar.causality == "input":
        value = 0.0
    if value is None or not math.isfinite(value):
        raise FmuError(f"{scalar.causality} {scalar.variable.name!r} has the start value {value}; give it a number")
    return repr(float(value))


def _model_structure(layout: Layout) -> ET.Element:
    structure, element = model_structure(layout), ET.Element("ModelStructure")
    _unknowns(element, "Outputs", structure.outputs)
    _unknowns(element, "Derivatives", structure.derivatives)
    _unknowns(element, "InitialUnknowns", dict(sorted(structure.initial_unknowns.items())))
    return element


def _unknowns(parent: ET.Element, tag: str, unknowns: Mapping[int, Sequence[int]]) -> None:
    if not unknowns:  # an empty list is not allowed by the schema
        return
    element = ET.SubElement(parent, tag)
    for reference, known in unknowns.items():
        dependencies = " ".join(str(k + 1) for k in known)
        ET.SubElement(element, "Unknown", index=str(reference + 1), dependencies=dependencies)


def _text(text: str) -> str:
    return _NOT_XML.sub(" ", text)

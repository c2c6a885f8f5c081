"""modelDescription.xml of FMI 2.0: variables, units, and who depends on whom."""

import xml.etree.ElementTree as ET
from collections.abc import Mapping, Sequence

from fmus.description_parts import NO_RESTRICTIONS, Header, common_parts, number_attributes, plain_text, to_bytes
from fmus.layout import Layout, Scalar
from fmus.model_structure import model_structure
from fmus.symbolic.system import SymbolicSystem


def model_description(system: SymbolicSystem, header: Header) -> bytes:
    """Write the XML of an FMI 2.0 FMU for both interface types.

    Raises:
        FmuError: if a value cannot be written, such as a parameter without a value.
        MisfitError: if a unit is unknown.
    """
    layout = Layout(system)
    root = ET.Element(
        "fmiModelDescription",
        fmiVersion="2.0",
        modelName=plain_text(system.name),
        guid=header.guid,
        description=plain_text(system.description),
        generationTool="misfit",
        variableNamingConvention="structured",
        numberOfEventIndicators=str(0 if system.relations is None else system.relations.n_indicators),
    )
    root.append(_interface("ModelExchange", header, **_exchange_abilities(system)))
    root.append(_interface("CoSimulation", header, **_STEPPING_ABILITIES))
    root.extend(common_parts(layout, header))
    variables = ET.SubElement(root, "ModelVariables")
    variables.extend([_scalar_variable(reference, s) for reference, s in enumerate(layout.scalars)])
    root.append(_model_structure(layout))
    return to_bytes(root)


_STEPPING_ABILITIES = {"canHandleVariableCommunicationStepSize": "true", "canInterpolateInputs": "true"}


def _exchange_abilities(system: SymbolicSystem) -> dict[str, str]:
    # Only delay operators remember something at the end of a step.
    return {"completedIntegratorStepNotNeeded": "false" if system.n_delays else "true"}


def _interface(tag: str, header: Header, **abilities: str) -> ET.Element:
    element = ET.Element(
        tag,
        {**NO_RESTRICTIONS, **abilities},
        modelIdentifier=header.identifier,
        canNotUseMemoryManagementFunctions="true",
        canGetAndSetFMUstate="true",
        canSerializeFMUstate="true",
        providesDirectionalDerivative="true",
    )
    files = ET.SubElement(element, "SourceFiles")
    for name in header.sources:
        ET.SubElement(files, "File", name=name)
    return element


def _scalar_variable(reference: int, scalar: Scalar) -> ET.Element:
    variable = scalar.variable
    attributes = {"name": plain_text(variable.name), "valueReference": str(reference)}
    if variable.description:
        attributes["description"] = plain_text(variable.description)
    attributes |= {"causality": scalar.causality, "variability": scalar.variability}
    if scalar.initial:
        attributes["initial"] = scalar.initial
    element = ET.Element("ScalarVariable", attributes)
    real = number_attributes(scalar)
    if scalar.derivative_of is not None:
        real["derivative"] = str(scalar.derivative_of + 1)
    ET.SubElement(element, "Real", real)
    return element


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

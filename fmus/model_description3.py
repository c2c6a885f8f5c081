"""modelDescription.xml of FMI 3.0."""

import xml.etree.ElementTree as ET
from collections.abc import Mapping, Sequence

from fmus.arrays import ArrayVariable, array_variables, by_variable
from fmus.description_parts import NO_RESTRICTIONS, Header, common_parts, number_attributes, plain_text, to_bytes
from fmus.layout import Layout
from fmus.model_structure import model_structure
from fmus.symbolic.system import SymbolicSystem


def model_description3(system: SymbolicSystem, header: Header) -> bytes:
    """Write the XML of an FMI 3.0 FMU for both interface types; all variables are Float64.

    Raises:
        FmuError: if a value cannot be written, such as a parameter without a value.
        MisfitError: if a unit is unknown.
    """
    layout = Layout(system)
    variables = array_variables(layout.scalars)
    root = ET.Element(
        "fmiModelDescription",
        fmiVersion="3.0",
        modelName=plain_text(system.name),
        instantiationToken=header.guid,
        description=plain_text(system.description),
        generationTool="misfit",
        variableNamingConvention="structured",
    )
    # Only delay operators remember something at the end of a step.
    needs_steps = "true" if system.n_delays else "false"
    root.append(_interface("ModelExchange", header, needsCompletedIntegratorStep=needs_steps))
    events = {"hasEventMode": "true", "mightReturnEarlyFromDoStep": "true"} if system.relations else {}
    root.append(_interface("CoSimulation", header, canHandleVariableCommunicationStepSize="true", **events))
    root.extend(common_parts(layout, header))
    ET.SubElement(root, "ModelVariables").extend(map(_variable, variables))
    root.append(_model_structure(layout, variables))
    return to_bytes(root)


def _interface(tag: str, header: Header, **abilities: str) -> ET.Element:
    return ET.Element(
        tag,
        {**NO_RESTRICTIONS, **abilities},
        modelIdentifier=header.identifier,
        canGetAndSetFMUState="true",
        canSerializeFMUState="true",
        providesDirectionalDerivatives="true",
        providesAdjointDerivatives="true",
    )


def _variable(variable: ArrayVariable) -> ET.Element:
    first = variable.elements[0]
    attributes = {"name": plain_text(variable.name), "valueReference": str(variable.reference)}
    if variable.description:
        attributes["description"] = plain_text(variable.description)
    attributes |= {"causality": first.causality, "variability": first.variability}
    if first.initial:
        attributes["initial"] = first.initial
    attributes |= number_attributes(first)
    if first.has_start:
        attributes["start"] = " ".join(number_attributes(element)["start"] for element in variable.elements)
    if first.derivative_of is not None:
        attributes["derivative"] = str(first.derivative_of)
    element = ET.Element("Float64", attributes)
    for size in variable.shape:
        ET.SubElement(element, "Dimension", start=str(size))
    return element


def _model_structure(layout: Layout, variables: Sequence[ArrayVariable]) -> ET.Element:
    structure, element = model_structure(layout), ET.Element("ModelStructure")
    indicators = range(layout.offsets["indicators"], len(layout.scalars))
    _unknowns(element, "Output", by_variable(structure.outputs, variables))
    _unknowns(element, "ContinuousStateDerivative", by_variable(structure.derivatives, variables))
    _unknowns(element, "InitialUnknown", by_variable(dict(sorted(structure.initial_unknowns.items())), variables))
    for reference in indicators:  # without dependencies: they may depend on everything
        ET.SubElement(element, "EventIndicator", valueReference=str(reference))
    return element


def _unknowns(parent: ET.Element, tag: str, unknowns: Mapping[int, Sequence[int]]) -> None:
    for reference, known in unknowns.items():
        dependencies = " ".join(map(str, known))
        ET.SubElement(parent, tag, valueReference=str(reference), dependencies=dependencies)

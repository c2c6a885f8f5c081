"""modelDescription.xml of FMI 2.0 and 3.0: variables, units, and who depends on whom."""

import xml.etree.ElementTree as ET
from collections.abc import Mapping, Sequence

from fmus.arrays import ArrayVariable, array_variables, by_variable
from fmus.description_parts import NO_RESTRICTIONS, Header, common_parts, number_attributes, plain_text, to_bytes
from fmus.layout import Layout, Scalar
from fmus.model_structure import model_structure
from fmus.symbolic.system import SymbolicSystem


def model_description(system: SymbolicSystem, header: Header, version: int) -> bytes:
    """Write the XML of an FMU for both interface types; all variables are real numbers.

    Args:
        system: the model.
        header: what is said beside the variables.
        version: 2 or 3, of FMI.

    Raises:
        FmuError: if a value cannot be written, such as a parameter without a value.
        MisfitError: if a unit is unknown.
    """
    layout, two = Layout(system), version == 2
    root = ET.Element(
        "fmiModelDescription",
        {
            "fmiVersion": f"{version}.0",
            "modelName": plain_text(system.name),
            "guid" if two else "instantiationToken": header.guid,
            "description": plain_text(system.description),
            "generationTool": "misfit",
            "variableNamingConvention": "structured",
        },
    )
    if two:
        root.set("numberOfEventIndicators", str(0 if system.relations is None else system.relations.n_indicators))
    # Only delay operators remember something at the end of a step.
    remembers = bool(system.n_delays)
    exchanging = (
        {"completedIntegratorStepNotNeeded": not remembers} if two else {"needsCompletedIntegratorStep": remembers}
    )
    stepping = {"canHandleVariableCommunicationStepSize": True}
    if two:
        stepping["canInterpolateInputs"] = True
    elif system.relations:
        stepping |= {"hasEventMode": True, "mightReturnEarlyFromDoStep": True}
    root.append(_interface("ModelExchange", header, two, exchanging))
    root.append(_interface("CoSimulation", header, two, stepping))
    root.extend(common_parts(layout, header))
    variables = ET.SubElement(root, "ModelVariables")
    if two:
        variables.extend([_scalar_variable(reference, s) for reference, s in enumerate(layout.scalars)])
        root.append(_structure2(layout))
    else:
        arrays = array_variables(layout.scalars)
        variables.extend(map(_array_variable, arrays))
        root.append(_structure3(layout, arrays))
    return to_bytes(root)


def _interface(tag: str, header: Header, two: bool, abilities: Mapping[str, bool]) -> ET.Element:
    own = {name: str(value).lower() for name, value in abilities.items()}
    element = ET.Element(tag, {**NO_RESTRICTIONS, **own}, modelIdentifier=header.identifier)
    able = [
        "canGetAndSetFMUState",
        "canSerializeFMUState",
        "providesDirectionalDerivatives",
        "providesAdjointDerivatives",
    ]
    if two:
        able = [
            "canNotUseMemoryManagementFunctions",
            "canGetAndSetFMUstate",
            "canSerializeFMUstate",
            "providesDirectionalDerivative",
        ]
        files = ET.SubElement(element, "SourceFiles")
        for name in header.sources:
            ET.SubElement(files, "File", name=name)
    element.attrib.update(dict.fromkeys(able, "true"))
    return element


def _attributes(name: str, reference: int, description: str, scalar: Scalar) -> dict[str, str]:
    attributes = {"name": plain_text(name), "valueReference": str(reference)}
    if description:
        attributes["description"] = plain_text(description)
    attributes |= {"causality": scalar.causality, "variability": scalar.variability}
    return attributes | ({"initial": scalar.initial} if scalar.initial else {})


def _scalar_variable(reference: int, scalar: Scalar) -> ET.Element:
    variable = scalar.variable
    element = ET.Element("ScalarVariable", _attributes(variable.name, reference, variable.description, scalar))
    real = number_attributes(scalar)
    if scalar.derivative_of is not None:
        real["derivative"] = str(scalar.derivative_of + 1)
    ET.SubElement(element, "Real", real)
    return element


def _array_variable(variable: ArrayVariable) -> ET.Element:
    first = variable.elements[0]
    attributes = _attributes(variable.name, variable.reference, variable.description, first) | number_attributes(first)
    if first.has_start:
        attributes["start"] = " ".join(number_attributes(element)["start"] for element in variable.elements)
    if first.derivative_of is not None:
        attributes["derivative"] = str(first.derivative_of)
    element = ET.Element("Float64", attributes)
    for size in variable.shape:
        ET.SubElement(element, "Dimension", start=str(size))
    return element


def _structure2(layout: Layout) -> ET.Element:
    structure, element = model_structure(layout), ET.Element("ModelStructure")
    lists = {
        "Outputs": structure.outputs,
        "Derivatives": structure.derivatives,
        "InitialUnknowns": dict(sorted(structure.initial_unknowns.items())),
    }
    for tag, unknowns in lists.items():
        if unknowns:  # an empty list is not allowed by the schema
            parent = ET.SubElement(element, tag)
            for reference, known in unknowns.items():
                dependencies = " ".join(str(k + 1) for k in known)
                ET.SubElement(parent, "Unknown", index=str(reference + 1), dependencies=dependencies)
    return element


def _structure3(layout: Layout, variables: Sequence[ArrayVariable]) -> ET.Element:
    structure, element = model_structure(layout), ET.Element("ModelStructure")
    lists = {
        "Output": structure.outputs,
        "ContinuousStateDerivative": structure.derivatives,
        "InitialUnknown": dict(sorted(structure.initial_unknowns.items())),
    }
    for tag, unknowns in lists.items():
        for reference, known in by_variable(unknowns, variables).items():
            ET.SubElement(element, tag, valueReference=str(reference), dependencies=" ".join(map(str, known)))
    for reference in range(layout.offsets["indicators"], len(layout.scalars)):  # they may depend on everything
        ET.SubElement(element, "EventIndicator", valueReference=str(reference))
    return element

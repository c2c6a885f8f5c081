"""What the model descriptions of FMI 2.0 and 3.0 have in common."""

import math
import re
import xml.etree.ElementTree as ET
from collections.abc import Sequence
from dataclasses import dataclass

from fmus.errors import FmuError
from fmus.layout import Layout, Scalar
from fmus.units import SiUnit, si_exponents

# XML 1.0 has no way to write the other control characters.
_NOT_XML = re.compile(r"[\x00-\x08\x0b\x0c\x0e-\x1f\ufffe\uffff]")

# What importers ask first; both are the standard's default too.
NO_RESTRICTIONS = {"needsExecutionTool": "false", "canBeInstantiatedOnlyOncePerProcess": "false"}


@dataclass(frozen=True)
class Header:
    """What a description says beside the variables. Times are in s; `sources` are file names in `sources/`."""

    identifier: str
    guid: str
    sources: Sequence[str]
    stop_time: float
    step_size: float
    tolerance: float


def plain_text(text: str) -> str:
    """Replace the characters that XML cannot carry by spaces."""
    return _NOT_XML.sub(" ", text)


def common_parts(layout: Layout, header: Header) -> list[ET.Element]:
    """Units, log categories and the default experiment, which the two versions write alike."""
    units = sorted({s.variable.unit for s in layout.scalars if s.variable.unit})
    return [*([_unit_definitions(units)] if units else []), _log_categories(), _experiment(header)]


def number_attributes(scalar: Scalar) -> dict[str, str]:
    """Unit, bounds, nominal and start of a variable.

    Raises:
        FmuError: if a start value is needed and is not a number.
    """
    variable = scalar.variable
    attributes = {"unit": variable.unit} if variable.unit else {}
    bounds = {"min": variable.minimum, "max": variable.maximum, "nominal": variable.nominal}
    attributes |= {key: repr(float(v)) for key, v in bounds.items() if v is not None and math.isfinite(v)}
    if scalar.has_start:
        attributes["start"] = _start(scalar)
    return attributes


def to_bytes(root: ET.Element) -> bytes:
    """Write an XML document, indented."""
    ET.indent(root)
    return ET.tostring(root, encoding="UTF-8", xml_declaration=True) + b"\n"


def base_unit(si: SiUnit) -> dict[str, str]:
    """The attributes that say what a unit means, in FMI and in SSP."""
    factor = {} if si.factor == 1.0 else {"factor": repr(si.factor)}
    offset = {} if si.offset == 0.0 else {"offset": repr(si.offset)}
    return {**{key: str(power) for key, power in si.exponents.items()}, **factor, **offset}


def build_description(identifier: str, sources: Sequence[str]) -> bytes:
    """Write buildDescription.xml of FMI 3.0, the list of source files; any C99 compiler makes the binary of them."""
    root = ET.Element("fmiBuildDescription", fmiVersion="3.0")
    configuration = ET.SubElement(root, "BuildConfiguration", modelIdentifier=identifier)
    files = ET.SubElement(configuration, "SourceFileSet", language="C99")
    for name in sources:
        ET.SubElement(files, "SourceFile", name=name)
    return to_bytes(root)


def _unit_definitions(units: Sequence[str]) -> ET.Element:
    element = ET.Element("UnitDefinitions")
    for name in units:
        ET.SubElement(ET.SubElement(element, "Unit", name=name), "BaseUnit", base_unit(si_exponents(name)))
    return element


# As in runtime/logging.c.
_CATEGORIES = {
    "logEvents": "Relations that change, and when",
    "logStatusDiscard": "Derivatives that are no numbers, for the importer to avoid",
    "logStatusError": "Refused calls and steps",
    "logAll": "All of these",
}


def _log_categories() -> ET.Element:
    element = ET.Element("LogCategories")
    for name, description in _CATEGORIES.items():
        ET.SubElement(element, "Category", name=name, description=description)
    return element


def _experiment(header: Header) -> ET.Element:
    return ET.Element(
        "DefaultExperiment",
        startTime="0",
        stopTime=repr(float(header.stop_time)),
        tolerance=repr(float(header.tolerance)),
        stepSize=repr(float(header.step_size)),
    )


def _start(scalar: Scalar) -> str:
    value = scalar.variable.start
    if value is None and scalar.causality == "input":
        value = 0.0
    if value is None or not math.isfinite(value):
        raise FmuError(f"{scalar.causality} {scalar.variable.name!r} has the start value {value}; give it a number")
    return repr(float(value))

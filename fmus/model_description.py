"""modelDescription.xml of FMI 2.0: variables, units, and who depends on whom."""

import math
import re
import xml.etree.ElementTree as ET
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from fmus.errors import FmuError
from fmus.model_structure import Knowns, at_start, running, sparsity
from fmus.symbolic.system import SymbolicSystem, Variable
from fmus.units import si_exponents

# XML 1.0 has no way to write the other control characters.
_NOT_XML = re.compile(r"[\x00-\x08\x0b\x0c\x0e-\x1f\ufffe\uffff]")


@dataclass(frozen=True)
class Scalar:
    """A variable as FMI 2.0 sees it; its value reference is its position in the list of scalars."""

    variable: Variable
    causality: str
    variability: str
    initial: str | None = None
    derivative_of: int | None = None  # position of the state

    @property
    def has_start(self) -> bool:
        """Whether a start value has to be written."""
        return self.causality == "input" or self.initial in ("exact", "approx")


@dataclass(frozen=True)
class Layout:
    """All variables of a system in the order of their value references, as `runtime/model.h` lays it down."""

    system: SymbolicSystem

    @cached_property
    def scalars(self) -> list[Scalar]:
        """Inputs, states, derivatives, algebraics, parameters, dependents and the time."""
        system, first_state = self.system, len(self.system.inputs)
        time = Variable("time", "s", "Time")
        return [
            *(Scalar(v, "input", "continuous") for v in system.inputs),
            *self._states(),
            *(
                Scalar(
                    derivative_variable(v),
                    "local",
                    "continuous",
                    "calculated",
                    first_state + i,
                )
                for i, v in enumerate(system.states)
            ),
            *(
                Scalar(v, self._shown(v), "continuous", "calculated")
                for v in system.algebraics
            ),
            *(Scalar(v, "parameter", "tunable", "exact") for v in system.parameters),
            *(
                Scalar(v, "calculatedParameter", "tunable", "calculated")
                for v in system.dependents
            ),
            Scalar(time, "independent", "continuous"),
        ]

    def _states(self) -> list[Scalar]:
        """A start that follows from parameters is only a proposal: the parameters may change first."""
        fixed = ~sparsity(self.system.initial, 0, 0).any(axis=1)
        starts = np.array(self.system.initial(_defaults(self.system))).ravel()
        return [
            Scalar(
                replace(v, start=float(start)),
                self._shown(v),
                "continuous",
                "exact" if exact else "approx",
            )
            for v, start, exact in zip(self.system.states, starts, fixed, strict=True)
        ]

    def _shown(self, variable: Variable) -> str:
        return "output" if variable.name in self.system.outputs else "local"

    @cached_property
    def offsets(self) -> dict[str, int]:
        """Value reference of the first variable of each kind."""
        system = self.system
        kinds = {
            "inputs": len(system.inputs),
            "states": len(system.states),
            "derivatives": len(system.states),
            "algebraics": len(system.algebraics),
            "parameters": len(system.parameters),
            "dependents": len(system.dependents),
            "time": 1,
        }
        starts = np.cumsum([0, *kinds.values()])
        return {kind: int(start) for kind, start in zip(kinds, starts, strict=False)}


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
    """Write the XML of an FMI 2.0 co-simulation FMU. Times are in s; `sources` are file names in `sources/`.

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
    )
    root.append(_co_simulation(identifier, sources))
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
    variables.extend(
        _scalar_variable(reference, s) for reference, s in enumerate(layout.scalars)
    )
    root.append(_model_structure(layout))
    ET.indent(root)
    return ET.tostring(root, encoding="UTF-8", xml_declaration=True) + b"\n"


def derivative_variable(state: Variable) -> Variable:
    """Describe the time derivative of a state.

    Example:
        >>> derivative_variable(Variable("w", "rad/s")).unit
        'rad/s2'
    """
    description = f"Time derivative of {state.name}"
    return Variable(f"der({state.name})", _per_second(state.unit), description)


def _per_second(unit: str) -> str:
    numerator, slash, denominator = unit.partition("/")
    if not unit or not slash:
        return f"{unit}/s" if unit else ""
    if denominator == "s":
        return f"{numerator}/s2"
    return f"{numerator}/({denominator.strip('()')}.s)"


def _co_simulation(identifier: str, sources: Sequence[str]) -> ET.Element:
    element = ET.Element(
        "CoSimulation",
        modelIdentifier=identifier,
        canHandleVariableCommunicationStepSize="true",
        canInterpolateInputs="true",
        canNotUseMemoryManagementFunctions="true",
        canGetAndSetFMUstate="true",
        canSerializeFMUstate="true",
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
    attributes |= {
        key: repr(float(v))
        for key, v in bounds.items()
        if v is not None and math.isfinite(v)
    }
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
        raise FmuError(
            f"{scalar.causality} {scalar.variable.name!r} has the start value {value}; give it a number"
        )
    return repr(float(value))


def _model_structure(layout: Layout) -> ET.Element:
    system, offsets = layout.system, layout.offsets
    n_states, element = len(system.states), ET.Element("ModelStructure")
    now, start = running(system), at_start(system)
    references = {
        s.variable.name: reference for reference, s in enumerate(layout.scalars)
    }

    outputs = ET.SubElement(element, "Outputs") if system.outputs else element
    for name in system.outputs:
        reference = references[name]
        row = n_states + reference - offsets["algebraics"]
        known = (
            [reference]
            if reference < offsets["derivatives"]
            else _while_running(layout, now, row)
        )
        _unknown(outputs, reference, known)

    derivatives = ET.SubElement(element, "Derivatives") if system.states else element
    for i in range(n_states):
        _unknown(
            derivatives, offsets["derivatives"] + i, _while_running(layout, now, i)
        )

    if initial := _initial_unknowns(layout, start):
        unknowns = ET.SubElement(element, "InitialUnknowns")
        for reference, known in sorted(initial.items()):
            _unknown(unknowns, reference, known)
    return element


def _initial_unknowns(layout: Layout, start: Knowns) -> dict[int, list[int]]:
    """Value references of what initialization computes, each with the known values that it needs."""
    system, offsets = layout.system, layout.offsets
    parameters, start_of_states = offsets["parameters"], sparsity(system.initial, 0, 0)
    initial: dict[int, list[int]] = {}
    for i, scalar in enumerate(
        layout.scalars[offsets["states"] : offsets["derivatives"]]
    ):
        if scalar.initial == "approx":
            initial[offsets["states"] + i] = _columns(start_of_states[i], parameters)
    for row in range(len(system.states) + len(system.algebraics)):
        reference = offsets["derivatives"] + row
        if row < len(system.states) or layout.scalars[reference].causality == "output":
            initial[reference] = _while_starting(layout, start, row)
    for i, needed in enumerate(sparsity(system.dependent, 0, 0)):
        initial[offsets["dependents"] + i] = _columns(needed, parameters)
    return initial


def _while_running(layout: Layout, knowns: Knowns, row: int) -> list[int]:
    offsets = layout.offsets
    time = [offsets["time"]] if knowns.time[row] else []
    return (
        _columns(knowns.inputs[row])
        + _columns(knowns.states[row], offsets["states"])
        + time
    )


def _while_starting(layout: Layout, knowns: Knowns, row: int) -> list[int]:
    """Known at the start are inputs, parameters and exact start values; other states stand for parameters."""
    offsets, system = layout.offsets, layout.system
    start_of_states = sparsity(system.initial, 0, 0)
    exact = ~start_of_states.any(axis=1)
    parameters = knowns.parameters[row] | start_of_states[knowns.states[row]].any(
        axis=0
    )
    time = [offsets["time"]] if knowns.time[row] else []
    states = _columns(knowns.states[row] & exact, offsets["states"])
    return (
        _columns(knowns.inputs[row])
        + states
        + _columns(parameters, offsets["parameters"])
        + time
    )


def _columns(mask: np.ndarray, offset: int = 0) -> list[int]:
    return [offset + int(column) for column in np.flatnonzero(mask)]


def _unknown(parent: ET.Element, reference: int, known: Sequence[int]) -> None:
    dependencies = " ".join(str(k + 1) for k in known)
    ET.SubElement(
        parent, "Unknown", index=str(reference + 1), dependencies=dependencies
    )


def _defaults(system: SymbolicSystem) -> list[float]:
    return [_default(parameter) for parameter in system.parameters]


def _default(parameter: Variable) -> float:
    return math.nan if parameter.start is None else parameter.start


def _text(text: str) -> str:
    return _NOT_XML.sub(" ", text)

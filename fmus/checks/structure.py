"""Declared dependencies and derivatives against what happens when one variable is moved."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import isclose, isfinite
from typing import Any
from xml.etree import ElementTree

from fmus.checks.instance import Instance, running
from fmus.checks.subject import FLOATS, Numbers, Subject, element_count

KIND = "ModelExchange"
# Directional derivatives may differ from difference quotients by this share.
SHARE = 1e-4


@dataclass(frozen=True)
class Knob:
    """One element of an input, state or parameter: `move(x)` sets it to x."""

    number: Numbers
    element: int
    value: float
    move: Callable[[float], None]

    @property
    def name(self) -> str:
        """Name of the element."""
        return self.number.names[self.element]


def check_dependencies(subject: Subject) -> Iterator[str]:
    """Outputs and derivatives move only with the inputs and states that they are declared to depend on."""
    unknowns = _declared(subject, [*subject.description.outputs, *subject.description.derivatives])
    with running(subject, KIND) as instance:
        yield from _undeclared(instance, unknowns, [*_inputs(instance), *_states(instance)])


def check_initial_dependencies(subject: Subject) -> Iterator[str]:
    """At the start, initial unknowns move only with inputs, parameters and start values that they declare."""
    unknowns = _declared(subject, subject.description.initialUnknowns)
    if not unknowns:
        return
    instance = Instance(subject, KIND)
    starts = [n for n in subject.numbers if n.variable.causality == "parameter" and n.variable.variability == "tunable"]
    starts += [n for n in _state_variables(subject) if n.variable.initial == "exact"]
    knobs = [*_inputs(instance), *(knob for n in starts for knob in _elements(instance, n))]
    yield from _undeclared(instance, unknowns, knobs)
    instance.initialized().end()


def check_derivatives(subject: Subject) -> Iterator[str]:
    """Directional derivatives lie between the difference quotients of both sides."""
    if not _gives_derivatives(subject):
        return
    unknowns = [
        n for n, _ in _declared(subject, [*subject.description.outputs, *subject.description.derivatives], True)
    ]
    if not unknowns:
        return
    names = [name for n in unknowns for name in n.names]
    with running(subject, KIND) as instance:
        for knob in [*_inputs(instance), *_states(instance)]:
            seed = [float(k == knob.element) for k in range(knob.number.size)]
            exact = instance.directional(unknowns, knob.number, seed)
            step = 1e-6 * max(abs(knob.value), abs(float(knob.number.variable.nominal or 1.0)))
            middle, ahead, behind = (_at(instance, knob, shift, unknowns) for shift in (0.0, step, -step))
            for name, derivative, a, b, c in zip(names, exact, behind, middle, ahead, strict=True):
                slopes = ((b - a) / step, (c - b) / step)
                slack = SHARE * max(abs(derivative), *map(abs, slopes), 1e-3) + 1e-14 * abs(b) / step
                finite = isfinite(a) and isfinite(b) and isfinite(c)
                if finite and name != knob.name and not min(slopes) - slack <= derivative <= max(slopes) + slack:
                    yield (
                        f"the derivative of {name!r} by {knob.name!r} is given as {derivative:.6g}; "
                        f"its values change by {slopes[1]:.6g}"
                    )


def _gives_derivatives(subject: Subject) -> bool:
    """FMPy does not know the attribute of FMI 3.0, so the description is read again."""
    element = ElementTree.parse(subject.folder / "modelDescription.xml").find(KIND)
    names = ("providesDirectionalDerivative", "providesDirectionalDerivatives")
    return element is not None and any(element.get(name) in ("true", "1") for name in names)


def _at(instance: Instance, knob: Knob, shift: float, numbers: Sequence[Numbers]) -> list[float]:
    knob.move(knob.value + shift)
    values = instance.get(numbers)
    knob.move(knob.value)
    return values


def _declared(subject: Subject, unknowns: Sequence[Any], all_of_them: bool = False) -> list[tuple[Numbers, set[int]]]:
    """Floating-point unknowns with the references of their dependencies; those that declare none depend on all."""
    numbers = {n.variable.valueReference: n for n in subject.numbers}
    found: dict[int, tuple[Numbers, set[int]]] = {}
    for unknown in unknowns:
        reference = unknown.variable.valueReference
        if (
            reference in numbers
            and unknown.variable.type in FLOATS
            and (all_of_them or unknown.dependencies is not None)
        ):
            known = {variable.valueReference for variable in unknown.dependencies or ()}
            found[reference] = (numbers[reference], known)
    return list(found.values())


def _undeclared(
    instance: Instance, unknowns: Sequence[tuple[Numbers, set[int]]], knobs: Sequence[Knob]
) -> Iterator[str]:
    numbers = [number for number, _ in unknowns]
    names = [(name, known) for number, known in unknowns for name in number.names]
    for knob in knobs:
        reference = knob.number.variable.valueReference
        before = instance.get(numbers)
        knob.move(knob.number.moved(knob.value))
        after = instance.get(numbers)
        knob.move(knob.value)
        for (name, known), a, b in zip(names, before, after, strict=True):
            if a != b and reference not in known and name != knob.name:
                yield f"{name!r} changes with {knob.name!r}, which it does not declare"


def _inputs(instance: Instance) -> list[Knob]:
    return [knob for number in instance.subject.numbers_of("input") for knob in _elements(instance, number)]


def _elements(instance: Instance, number: Numbers) -> Iterator[Knob]:
    values = instance.get([number])
    for k, value in enumerate(values):

        def move(to: float, k: int = k) -> None:
            instance.set(number, [*values[:k], to, *values[k + 1 :]])

        yield Knob(number, k, value, move)


def _state_variables(subject: Subject) -> list[Numbers]:
    numbers = {n.variable.valueReference: n for n in subject.numbers}
    return [numbers[unknown.variable.derivative.valueReference] for unknown in subject.description.derivatives]


def _states(instance: Instance) -> Iterator[Knob]:
    base, position = instance.states(), 0
    for number in _state_variables(instance.subject):
        for k in range(number.size):

            def move(to: float, i: int = position) -> None:
                instance.set_states([*base[:i], to, *base[i + 1 :]])

            yield Knob(number, k, base[position], move)
            position += 1


def check_starts(subject: Subject) -> Iterator[str]:
    """Values after initialisation, the same in all interfaces."""
    kinds = [kind for kind in ("CoSimulation", "ModelExchange") if subject.interface(kind) is not None]
    after = []
    for kind in kinds:
        with running(subject, kind) as instance:
            _read_other_types(instance)
            values = instance.get(subject.numbers)
            yield from _bad_values(subject, values, instance.get(subject.numbers))
            after.append(values)
    names = [name for number in subject.numbers for name in number.names]
    for one, other in pairwise(after):
        for name, a, b in zip(names, one, other, strict=True):
            if isfinite(a) and isfinite(b) and not isclose(a, b, rel_tol=1e-9, abs_tol=1e-12):
                yield f"after initialisation {name!r} is {a!r} in co-simulation, but {b!r} in model exchange"


def _bad_values(subject: Subject, values: list[float], again: list[float]) -> Iterator[str]:
    position = 0
    for number in subject.numbers:
        for k, name in enumerate(number.names):
            value, twice = values[position + k], again[position + k]
            if not isfinite(value):
                yield f"after initialisation {name!r} is {value!r}; expected a finite number"
            elif value != twice:
                yield f"after initialisation {name!r} is {value!r}, then {twice!r} without any change"
        variable = number.variable
        kept = variable.initial == "exact" and variable.causality in ("input", "parameter", "output", "local")
        if kept and variable.start is not None and "fixed" != variable.variability != "constant":
            starts = [float(text) for text in str(variable.start).split()]
            for k, start in enumerate(starts * (number.size if len(starts) == 1 else 1)):
                value = values[position + k]
                if isfinite(value) and not isclose(value, start, rel_tol=1e-12, abs_tol=1e-300):
                    yield f"after initialisation {number.names[k]!r} is {value!r}; its start value is {start!r}"
        position += number.size


def _read_other_types(instance: Instance) -> None:
    """Read what is no floating-point number; a refused call is reported by the caller."""
    for variable in instance.subject.description.modelVariables:
        reference, kind = variable.valueReference, str(variable.type)
        if kind in (*FLOATS, "Clock") or variable.clocks:
            continue
        if instance.second:
            getattr(instance.fmu, "getInteger" if kind == "Enumeration" else f"get{kind}")([reference])
        else:
            getattr(instance.fmu, "getInt64" if kind == "Enumeration" else f"get{kind}")(
                [reference], element_count(variable)
            )

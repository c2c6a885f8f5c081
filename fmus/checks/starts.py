"""Initialisation settles: every value can be read, is finite and is what the description says."""

from collections.abc import Iterator
from itertools import pairwise
from math import isclose, isfinite

from fmus.checks.instance import Instance, running
from fmus.checks.subject import FLOATS, Subject, element_count


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

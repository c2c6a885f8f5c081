"""Variables as FMI 3.0 sees them: the elements of a Modelica array are one variable."""

import math
import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import groupby

import numpy as np

from fmus.layout import Scalar

_ELEMENT = re.compile(r"(?P<array>.+)\[(?P<position>\d+(?:,\d+)*)\](?P<end>\)?)")


@dataclass(frozen=True)
class ArrayVariable:
    """One or more scalars in a row; the value reference is the position of the first of them.

    `shape` is empty for a scalar; elements are in row-major order.
    """

    name: str
    description: str
    reference: int
    elements: tuple[Scalar, ...]
    shape: tuple[int, ...] = ()


def array_variables(scalars: Sequence[Scalar]) -> list[ArrayVariable]:
    """Group scalars, in the order of their references, into arrays.

    `q[1]`, `q[2]` become `q` if they are all there, side by side, and alike in everything but the start value; FMI 3.0
    has one unit, one range and one nominal value for an array. Otherwise each element stays a variable of its own, as
    members of component arrays (`muscle[1].force`) always do.

    Example:
        >>> from fmus.symbolic.system import Variable
        >>> scalars = [Scalar(Variable(name), "local", "continuous") for name in ("q[1]", "q[2]", "m[1].f", "m[2].f")]
        >>> [(v.name, v.reference, v.shape) for v in array_variables(scalars)]
        [('q', 0, (2,)), ('m[1].f', 2, ()), ('m[2].f', 3, ())]
    """
    total = Counter(_array_name(s) for s in scalars)
    arrays: dict[int, ArrayVariable] = {}
    for name, group in groupby(enumerate(scalars), lambda pair: _array_name(pair[1])):
        references, elements = zip(*group, strict=True)
        shape = _shape(elements) if total[name] == len(elements) else ()
        array = ArrayVariable(name, _description(elements[0]), references[0], elements, shape)
        if shape and _are_alike(elements) and _follows_its_state(array, arrays):
            arrays[array.reference] = array
        else:
            arrays |= {
                r: ArrayVariable(e.variable.name, e.variable.description, r, (e,))
                for r, e in zip(references, elements, strict=True)
            }
    return list(arrays.values())


def array_sizes(variables: Sequence[ArrayVariable]) -> str:
    """Write `model_arrays.h`: by position of the scalars, the number of elements of the variable that begins there."""
    sizes = (size for v in variables for size in (len(v.elements), *[0] * (len(v.elements) - 1)))
    lines = [
        "#ifndef MODEL_ARRAYS_H",
        "#define MODEL_ARRAYS_H",
        f"#define MODEL_SIZES {{{', '.join(map(str, sizes))}}}",
    ]
    return "\n".join([*lines, "#endif", ""])


def by_variable(dependencies: Mapping[int, Sequence[int]], variables: Sequence[ArrayVariable]) -> dict[int, list[int]]:
    """Dependencies of scalars as those of the variables that they are elements of, both by value reference."""
    owner = {v.reference + i: v.reference for v in variables for i in range(len(v.elements))}
    found: dict[int, set[int]] = {}
    for unknown, knowns in dependencies.items():
        found.setdefault(owner[unknown], set()).update(owner[known] for known in knowns)
    return {unknown: sorted(knowns) for unknown, knowns in found.items()}


def _array_name(scalar: Scalar) -> str:
    match = _ELEMENT.fullmatch(scalar.variable.name)
    return match["array"] + match["end"] if match else scalar.variable.name


def _shape(elements: Sequence[Scalar]) -> tuple[int, ...]:
    """Dimensions of an array with exactly these elements in this order, or nothing."""
    positions = list(_positions(elements))
    shape = positions[-1]
    whole = math.prod(shape) == len(positions) and positions == [
        tuple(k + 1 for k in index) for index in np.ndindex(*shape)
    ]
    return shape if whole else ()


def _positions(elements: Sequence[Scalar]) -> Iterator[tuple[int, ...]]:
    for element in elements:
        match = _ELEMENT.fullmatch(element.variable.name)
        yield tuple(map(int, match["position"].split(","))) if match else ()


def _description(element: Scalar) -> str:
    """The description without the element's number, which that of a derivative names."""
    match = _ELEMENT.fullmatch(element.variable.name)
    array = match["array"].removeprefix("der(") if match else ""
    return (
        element.variable.description.replace(f"{array}[{match['position']}]", array)
        if match
        else element.variable.description
    )


def _are_alike(elements: Sequence[Scalar]) -> bool:
    """Whether only name and start tell the elements apart."""
    kinds = {
        replace(e, variable=replace(e.variable, name="", description=_description(e), start=None), derivative_of=None)
        for e in elements
    }
    return len(kinds) == 1


def _follows_its_state(array: ArrayVariable, arrays: Mapping[int, ArrayVariable]) -> bool:
    """A derivative can be an array only where its states are one."""
    state = array.elements[0].derivative_of
    return state is None or (state in arrays and len(arrays[state].elements) == len(array.elements))

"""Values of Modelica expressions: plain numbers, CasADi scalars, strings, records, and arrays of them.

An array is a `numpy.ndarray` of dtype object in row-major order, so that shapes, slices and loops are NumPy's.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from fmus.errors import ModelicaError

Value = Any


@dataclass(frozen=True)
class Record:
    """A record value: its fields in declaration order."""

    fields: tuple[Value, ...]


def is_number(value: Value) -> bool:
    """Tell a plain number (or Boolean) from a symbolic expression."""
    return isinstance(value, int | float | bool)


def number(value: Value) -> float:
    """Return a value as a plain number.

    Raises:
        ModelicaError: if it depends on a variable, where Modelica asks for a constant.
    """
    if is_number(value):
        return float(value)
    if isinstance(value, ca.SX) and value.is_constant():
        return float(value)
    raise ModelicaError(f"'{value}' must be known when the model is built")


def array_of(items: Sequence[Value], shape: tuple[int, ...]) -> np.ndarray:
    """Arrange scalars in row-major order."""
    result = np.empty(len(items), dtype=object)
    for position, item in enumerate(items):
        result[position] = item
    return result.reshape(shape)


def stack(items: Sequence[Value]) -> np.ndarray:
    """Join values of one shape along a new first axis, as the array constructor does."""
    inner = shape_of(items[0]) if items else ()
    return array_of([scalar for item in items for scalar in scalars(item)], (len(items), *inner))


def shape_of(value: Value) -> tuple[int, ...]:
    """Return the shape of an array, `()` for a scalar."""
    return value.shape if isinstance(value, np.ndarray) else ()


def scalars(value: Value) -> list[Value]:
    """List the scalars of a value in row-major order."""
    if isinstance(value, Record):
        return [scalar for field in value.fields for scalar in scalars(field)]
    return list(value.flat) if isinstance(value, np.ndarray) else [value]


def from_scalars(items: Iterable[Value], shape: tuple[int, ...]) -> Value:
    """Build a value of a shape from scalars in row-major order."""
    items = list(items)
    return array_of(items, shape) if shape else items[0]


def elementwise(operation: Callable[..., Value], *operands: Value) -> Value:
    """Apply a scalar operation to operands of equal shape; scalars are repeated."""
    shapes = {shape_of(operand) for operand in operands} - {()}
    if not shapes:
        return operation(*operands)
    if len(shapes) > 1:
        raise ModelicaError(f"arrays of different shapes {sorted(shapes)} in one operation")
    shape = shapes.pop()
    size = int(np.prod(shape))
    columns = [scalars(operand) if shape_of(operand) else [operand] * size for operand in operands]
    return array_of([operation(*row) for row in zip(*columns, strict=True)], shape)


def multiply(left: Value, right: Value) -> Value:
    """Modelica's `*`: product of scalars, scaling, scalar product or matrix product, by shape."""
    if not shape_of(left) or not shape_of(right):
        return elementwise(lambda a, b: a * b, left, right)
    return np.dot(left, right)


def choose(condition: Value, if_true: Value, if_false: Value) -> Value:
    """Select by a condition that may depend on variables; both sides have one shape."""
    if is_number(condition):
        return if_true if condition else if_false
    return elementwise(lambda a, b: ca.if_else(condition, a, b), if_true, if_false)


def element_names(name: str, shape: tuple[int, ...]) -> Iterator[str]:
    """Modelica names of the elements of an array, row-major: `q[1]`, `q[2]`, ..."""
    for position in np.ndindex(*shape):
        yield name + (f"[{','.join(str(k + 1) for k in position)}]" if shape else "")

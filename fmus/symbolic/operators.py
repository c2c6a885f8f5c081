"""Modelica's built-in operators on values, as far as models of this subset use them."""

import math
from collections.abc import Callable
from typing import Any

import casadi as ca
import numpy as np

from fmus.errors import ModelicaError
from fmus.symbolic.values import (
    Value,
    array_of,
    elementwise,
    is_number,
    multiply,
    number,
    scalars,
    shape_of,
    stack,
)

UNARY: dict[str, Callable[[Value], Value]] = {
    "abs": ca.fabs,
    "sign": ca.sign,
    "sqrt": ca.sqrt,
    "floor": ca.floor,
    "ceil": ca.ceil,
    "integer": ca.floor,
    "sin": ca.sin,
    "cos": ca.cos,
    "tan": ca.tan,
    "asin": ca.asin,
    "acos": ca.acos,
    "atan": ca.atan,
    "sinh": ca.sinh,
    "cosh": ca.cosh,
    "tanh": ca.tanh,
    "exp": ca.exp,
    "log": ca.log,
    "log10": ca.log10,
}

BINARY: dict[str, Callable[[Value, Value], Value]] = {
    "add": lambda a, b: a + b,
    "subtract": lambda a, b: a - b,
    "divide": lambda a, b: a / b,
    "power": lambda a, b: a**b,
    "equal": lambda a, b: a == b,
    "not_equal": lambda a, b: a != b,
    "less": lambda a, b: a < b,
    "less_equal": lambda a, b: a <= b,
    "greater": lambda a, b: a > b,
    "greater_equal": lambda a, b: a >= b,
    "and": lambda a, b: bool(a and b) if is_number(a) and is_number(b) else ca.logic_and(a, b),
    "or": lambda a, b: bool(a or b) if is_number(a) and is_number(b) else ca.logic_or(a, b),
    "elementwise_multiply": lambda a, b: a * b,
}
for _name in ("add", "subtract", "divide", "power"):
    BINARY[f"elementwise_{_name}"] = BINARY[_name]


def negate(value: Value) -> Value:
    """Logical not."""
    return (not value) if is_number(value) else ca.logic_not(value)


def quotient(name: str, left: Value, right: Value) -> Value:
    """`div`, `mod` and `rem` as Modelica defines them: towards zero, floor, and the rest of `div`."""
    ratio = left / right
    if name == "mod":
        return left - ca.floor(ratio) * right
    towards_zero = ca.if_else(ratio >= 0, ca.floor(ratio), ca.ceil(ratio))
    if name == "div":
        return towards_zero
    if name == "rem":
        return left - towards_zero * right
    raise ModelicaError(f"operator {name} is not supported")


def _extreme(pick: Callable[[Value, Value], Value]) -> Callable[[list[Value]], Value]:
    def reduce(arguments: list[Value]) -> Value:
        if len(arguments) == 2:
            return elementwise(pick, *arguments)
        items = scalars(arguments[0])
        result = items[0]
        for item in items[1:]:
            result = pick(result, item)
        return result

    return reduce


def _size(arguments: list[Value]) -> Value:
    shape = shape_of(arguments[0])
    return shape[int(number(arguments[1])) - 1] if len(arguments) > 1 else array_of(list(shape), (len(shape),))


def _filled(value: Value, lengths: list[Value]) -> np.ndarray:
    shape = tuple(int(number(length)) for length in lengths)
    return array_of([value] * math.prod(shape), shape)


def _linspace(arguments: list[Value]) -> np.ndarray:
    first, last, count = arguments[0], arguments[1], int(number(arguments[2]))
    return array_of([first + (last - first) * k / (count - 1) for k in range(count)], (count,))


def _product(arguments: list[Value]) -> Value:
    result: Value = 1
    for item in scalars(arguments[0]):
        result = result * item
    return result


def _diagonal(arguments: list[Value]) -> np.ndarray:
    items = scalars(arguments[0])
    n = len(items)
    return array_of([items[i] if i == j else 0.0 for i in range(n) for j in range(n)], (n, n))


def _cross(arguments: list[Value]) -> np.ndarray:
    (a, b, c), (x, y, z) = scalars(arguments[0]), scalars(arguments[1])
    return array_of([b * z - c * y, c * x - a * z, a * y - b * x], (3,))


def _concatenate(arguments: list[Value], axis: int) -> np.ndarray:
    rank = max([axis + 1, *(len(shape_of(a)) for a in arguments)])
    parts = [array_of(scalars(a), shape_of(a) + (1,) * (rank - len(shape_of(a)))) for a in arguments]
    return np.concatenate(parts, axis=axis)


OPERATORS: dict[str, Callable[[list[Value]], Value]] = {
    "smooth": lambda a: a[1],
    "no_event": lambda a: a[0],
    "homotopy": lambda a: a[0],
    "atan2": lambda a: elementwise(ca.atan2, *a),
    "min": _extreme(ca.fmin),
    "max": _extreme(ca.fmax),
    "sum": lambda a: sum(scalars(a[0])),
    "product": _product,
    "size": _size,
    "zeros": lambda a: _filled(0.0, a),
    "ones": lambda a: _filled(1.0, a),
    "fill": lambda a: _filled(a[0], a[1:]),
    "linspace": _linspace,
    "identity": lambda a: _diagonal([_filled(1.0, a)]),
    "diagonal": _diagonal,
    "transpose": lambda a: a[0].T,
    "vector": lambda a: stack(scalars(a[0])),
    "outer_product": lambda a: multiply(a[0].reshape(-1, 1), a[1].reshape(1, -1)),
    "cross": _cross,
    "promoted_cat1": lambda a: _concatenate(a, 0),
    "promoted_cat2": lambda a: _concatenate(a, 1),
    "cat": lambda a: _concatenate(a[1:], int(number(a[0])) - 1),
}


def apply(name: str, arguments: list[Value]) -> Value:
    """Evaluate a built-in operator.

    Raises:
        ModelicaError: for an operator outside the supported subset.
    """
    if name in UNARY:
        return elementwise(_numeric_first(UNARY[name]), arguments[0])
    if name in OPERATORS:
        return OPERATORS[name](arguments)
    if name in ("div", "mod", "rem"):
        return elementwise(lambda a, b: _plain(quotient(name, a, b)), *arguments)
    raise ModelicaError(f"operator {name} is not supported")


def _numeric_first(function: Callable[[Value], Value]) -> Callable[[Value], Value]:
    return lambda value: _plain(function(value))


def _plain(value: Any) -> Value:
    """Turn a constant CasADi result back into a plain number, so that it can be a size or an index."""
    return float(value) if isinstance(value, ca.DM) else value

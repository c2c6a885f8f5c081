"""Laws as text: valid Modelica, and evaluated here with CasADi."""

import ast
import re
from collections.abc import Callable, Mapping
from typing import Any

import casadi as ca
import numpy as np

from fmus.errors import MisfitError
from fmus.expressions import parsed_expression

_FUNCTIONS = {
    "tanh": ca.tanh,
    "exp": ca.exp,
    "sqrt": ca.sqrt,
    "sin": ca.sin,
    "cos": ca.cos,
    "abs": ca.fabs,
    "min": ca.fmin,
    "max": ca.fmax,
    "log": ca.log,
}
_OPERATORS: dict[type[ast.operator], Callable[[Any, Any], Any]] = {
    ast.Add: lambda a, b: a + b,
    ast.Sub: lambda a, b: a - b,
    ast.Mult: lambda a, b: a * b,
    ast.Div: lambda a, b: a / b,
    ast.Pow: lambda a, b: a**b,
}


_NUMBERS = {
    "tanh": np.tanh,
    "exp": np.exp,
    "sqrt": np.sqrt,
    "sin": np.sin,
    "cos": np.cos,
    "abs": np.abs,
    "min": np.minimum,
    "max": np.maximum,
    "log": np.log,
}


def evaluate_numbers(text: str, names: Mapping[str, Any]) -> Any:
    """Value of an expression for numbers or arrays."""
    return evaluate(text, names, _NUMBERS)


def evaluate(text: str, names: Mapping[str, Any], functions: Mapping[str, Any] = _FUNCTIONS) -> Any:
    """Value of an expression whose names have the given values.

    >>> float(evaluate("-b*v^2 + max(q, 0)", {"b": 2.0, "v": 3.0, "q": -1.0}))
    -18.0

    Args:
        text: the expression, as in Modelica.
        names: value of each name: numbers, arrays, or symbols that `functions` know.
        functions: the functions that it may call, by name.

    Raises:
        MisfitError: for what is no such expression, or a name without a value.
    """
    try:
        tree = parsed_expression(text.replace("^", "**")).body
    except SyntaxError as error:
        raise MisfitError(f"law '{text}' cannot be read: {error.msg}") from error
    return _value(tree, names, text, functions)


def _value(node: ast.AST, names: Mapping[str, Any], text: str, functions: Mapping[str, Any]) -> Any:
    if isinstance(node, ast.Constant) and isinstance(node.value, int | float):
        return node.value
    if isinstance(node, ast.Name):
        if node.id not in names:
            raise MisfitError(f"law '{text}': '{node.id}' is unknown; known names: {', '.join(names)}")
        return names[node.id]
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
        return -_value(node.operand, names, text, functions)
    if isinstance(node, ast.BinOp) and type(node.op) in _OPERATORS:
        return _OPERATORS[type(node.op)](
            _value(node.left, names, text, functions), _value(node.right, names, text, functions)
        )
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in functions:
        return functions[node.func.id](*(_value(argument, names, text, functions) for argument in node.args))
    raise MisfitError(f"law '{text}': only + - * / ^, numbers, names and {', '.join(_FUNCTIONS)} are read")


def renamed(text: str, names: Mapping[str, str]) -> str:
    """The expression with other names, as Modelica text.

    >>> renamed("-b*v^2", {"b": "damping", "v": "cart.v"})
    '-damping*cart.v^2'
    """
    return re.sub(r"[A-Za-z_]\w*", lambda found: names.get(found.group(), found.group()), text)

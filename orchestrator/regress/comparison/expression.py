"""Signals computed from others, such as an energy from speeds and angles."""

import ast
import operator
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from fmus.errors import MisfitError
from fmus.expressions import parsed_expression
from orchestrator.regress.comparison.prepare import values_at
from orchestrator.regress.comparison.signal import Signal

_OPERATORS: dict[type[ast.AST], Callable[..., Any]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.Pow: operator.pow,
    ast.USub: operator.neg,
    ast.UAdd: operator.pos,
}
_FUNCTIONS: dict[str, Callable[..., Any]] = {
    name: getattr(np, name) for name in ("sin", "cos", "tan", "exp", "log", "sqrt", "abs", "minimum", "maximum")
}
_CONSTANTS = {"pi": np.pi}


def combine(name: str, formula: str, signals: Mapping[str, Signal], unit: str = "") -> Signal:
    """Return the signal that a formula makes of others, on the stamps of the one with the most samples.

    Numbers, + - * / **, brackets, pi and the functions sin cos tan exp log sqrt abs minimum maximum are known; a
    variable whose name is no plain word stands in quotes.

    Args:
        name: name of the new signal.
        formula: in the names of others.
        signals: the others.
        unit: unit of the new signal.

    Raises:
        MisfitError: if the formula cannot be read or names something unknown.

    Example:
        >>> v = Signal("body.v", [0.0, 1.0], [0.0, 2.0])
        >>> combine("energy", "0.5 * 3 * 'body.v' ** 2", {"body.v": v}, "J").values
        array([0., 6.])
    """
    tree = _parsed(name, formula)
    used = [signals[word] for word in _words(tree) if word in signals]
    if not used:
        raise MisfitError(f"formula of {name}: {formula!r} has no variable; quote names that are no plain words")
    time = max((signal.time for signal in used), key=len)

    def value(node: ast.AST) -> Any:
        match node:
            case ast.Expression(body=body):
                return value(body)
            case ast.Constant(value=bool()):
                pass
            case ast.Constant(value=int() | float() as number):
                return float(number)
            case ast.Name(id=word) | ast.Constant(value=str() as word) if word in signals:
                each = signals[word]
                return (
                    values_at(each.time, each.values, time, each.interpolation)
                    if each.time is not time
                    else each.values
                )
            case ast.Name(id=word) if word in _CONSTANTS:
                return _CONSTANTS[word]
            case ast.BinOp(left=left, op=op, right=right) if type(op) in _OPERATORS:
                return _OPERATORS[type(op)](value(left), value(right))
            case ast.UnaryOp(op=op, operand=operand) if type(op) in _OPERATORS:
                return _OPERATORS[type(op)](value(operand))
            case ast.Call(func=ast.Name(id=word), args=arguments, keywords=[]) if word in _FUNCTIONS:
                return _FUNCTIONS[word](*map(value, arguments))
        text = ast.unparse(node)
        raise MisfitError(
            f"formula of {name}: {text!r} is no number, signal or known function; signals: {', '.join(signals)}"
        )

    with np.errstate(all="ignore"):
        values = np.broadcast_to(np.asarray(value(tree), dtype=float), time.shape)
    return Signal(name, time, values, unit)


def variables_of(name: str, formula: str) -> tuple[str, ...]:
    """Return the variables that a formula asks for, in the order in which they occur.

    Raises:
        MisfitError: if the formula cannot be read or asks for none.

    Example:
        >>> variables_of("energy", "0.5 * sin(pi * q) ** 2 + 'body.v' - q")
        ('q', 'body.v')
    """
    found = tuple(dict.fromkeys(_words(_parsed(name, formula))))
    if not found:
        raise MisfitError(f"formula of {name}: {formula!r} has no variable; quote names that are no plain words")
    return found


def _parsed(name: str, formula: str) -> ast.Expression:
    try:
        return parsed_expression(formula.strip())
    except (SyntaxError, ValueError) as error:
        raise MisfitError(f"formula of {name}: {formula!r} cannot be read: {error}") from error


def _words(tree: ast.AST) -> list[str]:
    """Variables from left to right, without functions and constants."""
    words = []
    functions = {id(node.func) for node in ast.walk(tree) if isinstance(node, ast.Call)}
    for node in ast.walk(tree):
        if isinstance(node, ast.Name) and id(node) not in functions and node.id not in _CONSTANTS:
            words.append((node.lineno, node.col_offset, node.id))
        elif isinstance(node, ast.Constant) and isinstance(node.value, str):
            words.append((node.lineno, node.col_offset, node.value))
    return [word for _, _, word in sorted(words)]

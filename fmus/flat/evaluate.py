"""Evaluate expression trees in double precision."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from fmus.flat.expressions import Tree

Number = Any

BUILT_IN: dict[str, Callable[..., Number]] = {
    name: getattr(np, name)
    for name in ("sin", "cos", "tan", "sinh", "cosh", "tanh", "exp", "log", "log10", "sqrt", "sign", "floor", "ceil")
} | {
    "abs": np.abs,
    "asin": np.arcsin,
    "acos": np.arccos,
    "atan": np.arctan,
    "atan2": np.arctan2,
    "integer": np.floor,
    "mod": lambda a, b: a - np.floor(a / b) * b,
    "div": lambda a, b: np.trunc(a / b),
    "rem": lambda a, b: a - np.trunc(a / b) * b,
    "noEvent": lambda a: a,
    "homotopy": lambda a, *_: a,
    "smooth": lambda _, a: a,
    "min": lambda *a: np.min(a[0]) if len(a) == 1 else np.minimum(*a),
    "max": lambda *a: np.max(a[0]) if len(a) == 1 else np.maximum(*a),
    "sum": np.sum,
    "product": np.prod,
    "zeros": lambda *n: np.zeros([int(k) for k in n]),
    "ones": lambda *n: np.ones([int(k) for k in n]),
    "fill": lambda a, *n: np.broadcast_to(a, [int(k) for k in n]),
    "identity": lambda n: np.eye(int(n)),
    "diagonal": np.diag,
    "transpose": np.transpose,
    "vector": np.ravel,
    "cross": np.cross,
    "outerProduct": np.outer,
    "linspace": lambda a, b, n: np.linspace(a, b, int(n)),
    "size": lambda a, k=None: np.array(np.shape(a), dtype=float) if k is None else float(np.shape(a)[int(k) - 1]),
    "ndims": np.ndim,
    "scalar": lambda a: np.ravel(a)[0],
    "semiLinear": lambda x, a, b: np.where(x >= 0, a * x, b * x),
}

_ARITHMETIC: dict[str, Callable[[Number, Number], Number]] = {
    "+": np.add,
    "-": np.subtract,
    "/": np.divide,
    "./": np.divide,
    ".*": np.multiply,
    "^": np.power,
    ".^": np.power,
    "<": np.less,
    "<=": np.less_equal,
    ">": np.greater,
    ">=": np.greater_equal,
    "==": np.equal,
    "<>": np.not_equal,
}


class Unknown(Exception):
    """A name or construct that this evaluator does not know."""


class Evaluator:
    """Values of names come from `lookup`; calls of what is no built-in function go to `call(name, argument trees)`."""

    def __init__(self, lookup: Callable[[str], Number], call: Callable[[str, list[Tree]], Number]) -> None:
        self.lookup, self.call = lookup, call
        self._local: dict[str, Number] = {}
        self._lengths: list[int] = []

    def value(self, tree: Tree) -> Number:
        """The value of a tree: a number, a Boolean or an array.

        Raises:
            Unknown: for what has no value here.
        """
        method = getattr(self, "_" + tree[0], None)
        if method is None:
            raise Unknown(f"'{tree[0]}'")
        return method(*tree[1:])

    def _number(self, value: float) -> Number:
        return value

    def _string(self, text: str) -> Number:
        return text

    def _end(self) -> Number:
        return self._lengths[-1]

    def _name(self, name: str) -> Number:
        return self._local[name] if name in self._local else self.lookup(name)

    def _unary(self, operator: str, tree: Tree) -> Number:
        value = self.value(tree)
        return np.logical_not(value) if operator == "not" else np.negative(value)

    def _binary(self, operator: str, left: Tree, right: Tree) -> Number:
        a = self.value(left)
        if operator == "and":
            return bool(a) and bool(self.value(right))
        if operator == "or":
            return bool(a) or bool(self.value(right))
        b = self.value(right)
        if operator == "*":
            return np.dot(a, b) if np.ndim(a) and np.ndim(b) else np.multiply(a, b)
        if operator == "^":
            b = int(b) if float(b).is_integer() else b
            return np.power(float(a), b)
        return _ARITHMETIC[operator](a, b)

    def _if(self, condition: Tree, then: Tree, otherwise: Tree) -> Number:
        return self.value(then if bool(self.value(condition)) else otherwise)

    def _array(self, items: list[Tree]) -> Number:
        return np.array([self.value(item) for item in items], dtype=float)

    def _matrix(self, rows: list[list[Tree]]) -> Number:
        return np.block([[np.atleast_2d(self.value(item)) for item in row] for row in rows])

    def _range(self, first: Tree, step: Tree, last: Tree) -> Number:
        a, h, b = (float(self.value(tree)) for tree in (first, step, last))
        return a + h * np.arange(math.floor((b - a) / h + 1e-9) + 1)

    def _for(self, body: Tree, iterators: list[tuple[str, Tree]]) -> Number:
        name, values = iterators[-1] if len(iterators) > 1 else iterators[0]
        inner = ("for", body, iterators[:-1]) if len(iterators) > 1 else body
        outer = dict(self._local)
        found = []
        for value in np.ravel(self.value(values)):
            self._local[name] = value
            found.append(self.value(inner))
        self._local = outer
        return np.array(found, dtype=float)

    def _index(self, base: Tree, subscripts: list[Tree]) -> Number:
        return np.asarray(self.value(base))[self.positions(subscripts, np.shape(self.value(base)))]

    def positions(self, subscripts: list[Tree], shape: tuple[int, ...]) -> Any:
        """Subscripts as NumPy indices from zero."""
        found: list[Any] = []
        for tree, length in zip(subscripts, shape, strict=False):
            self._lengths.append(length)
            value = None if tree == ("all",) else self._position(tree)
            self._lengths.pop()
            found.append(slice(None) if value is None else value)
        lists = [k for k in found if isinstance(k, list)]
        if len(lists) > 1:
            return np.ix_(*[k if isinstance(k, list) else np.arange(n)[k] for k, n in zip(found, shape, strict=False)])
        return tuple(found)

    def _position(self, tree: Tree) -> int | list[int]:
        value = self.value(tree)
        return [int(k) - 1 for k in np.ravel(value)] if np.ndim(value) else int(value) - 1

    def _call(self, name: str, arguments: list[Tree]) -> Number:
        function = BUILT_IN.get(name)
        if function is None:
            return self.call(name, arguments)
        return function(*[self.value(argument) for argument in arguments])

    def size(self, tree: Tree) -> Number:
        """The value if all that is added up were positive: what rounding is relative to."""
        kind = tree[0]
        if kind == "binary" and tree[1] in ("+", "-"):
            return np.add(self.size(tree[2]), self.size(tree[3]))
        if kind == "binary" and tree[1] in ("*", ".*"):
            a, b = self.size(tree[2]), self.size(tree[3])
            return np.dot(a, b) if tree[1] == "*" and np.ndim(a) and np.ndim(b) else np.multiply(a, b)
        if kind == "binary" and tree[1] in ("/", "./"):
            return np.divide(self.size(tree[2]), np.abs(self.value(tree[3])))
        if kind == "unary" and tree[1] == "-":
            return self.size(tree[2])
        if kind == "if":
            return self.size(tree[2] if bool(self.value(tree[1])) else tree[3])
        if kind == "array":
            return np.array([self.size(item) for item in tree[1]], dtype=float)
        if kind == "call" and tree[1] in ("abs", "sum", "noEvent"):
            return np.sum(self.size(tree[2][0])) if tree[1] == "sum" else self.size(tree[2][0])
        return np.abs(self.value(tree))

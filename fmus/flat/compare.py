"""Compare a translated model with its flat equations at given points."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from fmus.flat.evaluate import Evaluator, Number, Unknown
from fmus.flat.expressions import Tree
from fmus.flat.functions import Functions
from fmus.flat.model import FlatEquation, FlatModel, read_flat


@dataclass(frozen=True)
class Failure:
    """An equation that does not hold, or a parameter whose binding does not; the error relative to its size."""

    equation: FlatEquation
    parameter: str | None
    error: float


@dataclass(frozen=True)
class Comparison:
    """How many scalar equations hold, what fails, and why others were not checked."""

    checked: int
    failure: Failure | None
    reasons: tuple[str, ...]


def compare(
    flat: Mapping[str, Any],
    sources: Sequence[str],
    points: Sequence[Mapping[str, float]],
    dependents: Sequence[str],
    tolerance: float,
    variables: Sequence[str] = (),
) -> Comparison:
    """Put values into the flat equations.

    Args:
        flat: the front end's flat representation.
        sources: Modelica texts that define the functions.
        points: values of all scalars by name, of `der(name)` and of `time`.
        dependents: parameters in the points that follow from others, to be compared with their bindings.
        tolerance: allowed error, relative to the size of the terms of an equation.
        variables: all that is no parameter; what one is bound to where it is declared is an equation.
    """
    model, functions = read_flat(flat), Functions(sources)
    states = [_Point(model, functions, values) for values in points]
    checked, reasons = 0, list(model.skipped)
    declared = [equation for equation, _ in _bindings(model, variables)]
    for equation, parameter in [*((e, None) for e in (*model.equations, *declared)), *_bindings(model, dependents)]:
        count, errors = 0, []
        if parameter is None and states and states[0].defines(equation):
            continue
        for point in states:
            try:
                size, error = point.error(equation)
            except (Unknown, TypeError, ValueError, IndexError, ZeroDivisionError) as why:
                reasons.append(str(why))
                break
            if np.isfinite(error):
                count = size
                errors.append(error)
        checked += count if parameter is None else 0
        if errors and max(errors) > tolerance:
            return Comparison(checked, Failure(equation, parameter, max(errors)), tuple(dict.fromkeys(reasons)))
    return Comparison(checked, None, tuple(dict.fromkeys(reasons)))


def residuals(
    flat: Mapping[str, Any], sources: Sequence[str], values: Mapping[str, float]
) -> list[tuple[FlatEquation, np.ndarray | None, float]]:
    """Left minus right side of each flat equation at one point, and the size of its terms.

    The residual is None where an equation has a name or a construct without a value here.
    """
    model = read_flat(flat)
    point = _Point(model, Functions(sources), values)
    return [(equation, *point.residual(equation)) for equation in model.equations]


def _bindings(model: FlatModel, dependents: Sequence[str]) -> list[tuple[FlatEquation, str]]:
    names = dict.fromkeys(_ELEMENT.sub(r"\g<base>", name) for name in dependents)
    return [(FlatEquation(("name", n), model.bindings[n], None), n) for n in names if n in model.bindings]


# Functions such as abs() hide that terms cancel; so this share of the largest value in an equation counts as a term.
ROUNDING = 1e-5


class _Point:
    """The flat names at one point."""

    def __init__(self, model: FlatModel, functions: Functions, values: Mapping[str, float]) -> None:
        self.model, self.functions, self.values = model, functions, values
        self.evaluator = Evaluator(self._lookup, self._call)
        self.known: dict[str, Number] = {}
        self.shapes = _shapes(values)
        # Boolean and Integer variables have no value in the points; their equations give it.
        self.definitions = self._definitions()
        self.largest = 0.0  # of the values looked up for the present equation

    def error(self, equation: FlatEquation) -> tuple[int, float]:
        """Number of scalar equations, and the largest error relative to the size of their terms."""
        with np.errstate(all="ignore"):
            if equation.left[0] == "outputs":
                return self._outputs_error(equation)
            self.largest = 0.0
            left, right = (self.evaluator.value(tree) for tree in (equation.left, equation.right))
            size = self.evaluator.size(equation.left) + self.evaluator.size(equation.right)
            return _largest(left, right, size + ROUNDING * self.largest)

    def _definitions(self) -> dict[str, Tree]:
        """What names without a value equal; one that equals another such name follows it."""
        found: dict[str, Tree] = {}
        waiting: list[tuple[str, str]] = []
        for equation in self.model.equations:
            bare = [t[1] for t in (equation.left, equation.right) if t[0] == "name" and not self._has_value(t[1])]
            if len(bare) == 2:
                waiting.append((bare[0], bare[1]))
            elif bare:
                found[bare[0]] = equation.right if equation.left == ("name", bare[0]) else equation.left
        while waiting:
            known = {*found, *self.model.bindings}
            ready = [pair for pair in waiting if (pair[0] in known) != (pair[1] in known)]
            if not ready:
                break
            for one, other in ready:
                if one in known:
                    found[other] = ("name", one)
                else:
                    found[one] = ("name", other)
            waiting = [pair for pair in waiting if pair not in ready]
        return found

    def _has_value(self, name: str) -> bool:
        return name in self.values or name in self.shapes

    def defines(self, equation: FlatEquation) -> bool:
        """Whether an equation is what gives a variable its value here, so that it holds by itself."""
        pairs = ((equation.left, equation.right), (equation.right, equation.left))
        return any(one[0] == "name" and self.definitions.get(one[1]) == other for one, other in pairs)

    def residual(self, equation: FlatEquation) -> tuple[np.ndarray | None, float]:
        """Left minus right side, row-major, and the size of the terms; None if it cannot be evaluated."""
        with np.errstate(all="ignore"):
            try:
                left, right = (self.evaluator.value(tree) for tree in (equation.left, equation.right))
                size = self.evaluator.size(equation.left) + self.evaluator.size(equation.right)
                apart = np.asarray(left, dtype=float) - np.asarray(right, dtype=float)  # of Booleans, too
            except (Unknown, TypeError, ValueError, IndexError, ZeroDivisionError):
                return None, 0.0
            return np.ravel(apart), float(np.max(np.abs(size), initial=0.0))

    def _outputs_error(self, equation: FlatEquation) -> tuple[int, float]:
        """`(a, b) = f(x)`."""
        if equation.right[0] != "call":
            raise Unknown("several outputs of what is no function")
        outputs = self.functions.run(equation.right[1], [self.evaluator.value(tree) for tree in equation.right[2]])
        pairs = [(self.evaluator.value(t), o) for t, o in zip(equation.left[1], outputs, strict=False)]
        found = [_largest(a, b, np.abs(a) + np.abs(b)) for a, b in pairs]
        return sum(count for count, _ in found), max(error for _, error in found)

    def _lookup(self, name: str) -> Number:
        if name not in self.known:
            self.known[name] = self._find(name)
        value = self.known[name]
        if not isinstance(value, str | dict):
            self.largest = max(self.largest, float(np.max(np.abs(value), initial=0.0)))
        return value

    def _find(self, name: str) -> Number:
        if name in self.values:
            return self.values[name]
        if name in self.shapes:
            return self._array_of(name, "{}")
        if name not in self.model.bindings and name in self.definitions:
            return self.evaluator.value(self.definitions[name])
        if name not in self.model.bindings and f"pre({name})" in self.values:
            return self.values[f"pre({name})"]  # what only events change is the same between them
        if name not in self.model.bindings:
            return self.functions.constant(name)
        value, sizes = self.evaluator.value(self.model.bindings[name]), self.model.sizes[name]
        return np.broadcast_to(value, sizes) if sizes and not np.ndim(value) else value

    def _array_of(self, name: str, pattern: str) -> Number:
        shape = self.shapes[name]
        found = np.empty(shape)
        for position in np.ndindex(*shape):
            element = f"{name}[{','.join(str(k + 1) for k in position)}]"
            found[position] = self.values[pattern.format(element)]
        return found

    def _call(self, name: str, arguments: list[Tree]) -> Number:
        if name == "der":
            return self._rate(arguments[0])
        if name == "pre":
            return self._before(arguments[0])
        if name == "initial":
            return 0.0
        values = [self.evaluator.value(tree) for tree in arguments]
        if name == "delay":
            return delayed(float(values[0]), float(values[1]))
        return self.functions.run(name, values)[0]

    def _before(self, tree: Tree) -> Number:
        if tree[0] != "name" or f"pre({tree[1]})" not in self.values:
            raise Unknown("pre() of what keeps no value")
        return self.values[f"pre({tree[1]})"]

    def _rate(self, tree: Tree) -> Number:
        if tree[0] == "index" and tree[1][0] == "name":
            rates = self._rate(tree[1])
            return rates[self.evaluator.positions(tree[2], np.shape(rates))]
        if tree[0] != "name":
            raise Unknown("der() of an expression")
        name = tree[1]
        if f"der({name})" in self.values:
            return self.values[f"der({name})"]
        if name in self.shapes and any(key.startswith(f"der({name}[") for key in self.values):
            return self._array_of(name, "der({})")
        raise Unknown(f"der({name})")


def delayed(source: float, delay: float) -> float:
    """Stands for the past of a delay operator: a value that is different for each source and each delay time."""
    return float(np.cos(1.0 + 0.7 * source + 1.3 * delay))


def _largest(left: Number, right: Number, size: Number) -> tuple[int, float]:
    """How many scalars are compared, and the largest difference relative to its size; NaN where one has no value."""
    difference, size = np.ravel(np.abs(np.subtract(left, right))), np.ravel(size)
    error = np.divide(difference, size, out=0.0 * difference, where=difference > 0)
    return int(difference.size), float(np.max(error, initial=0.0))


_ELEMENT = re.compile(r"^(?P<base>.+)\[(?P<position>[\d,]+)\]$")


def _shapes(values: Mapping[str, Any]) -> dict[str, tuple[int, ...]]:
    """Shapes of arrays by name, from the names of their elements."""
    shapes: dict[str, tuple[int, ...]] = {}
    for name in values:
        found = _ELEMENT.match(name)
        if found is not None:
            position = tuple(int(k) for k in found["position"].split(","))
            before = shapes.get(found["base"], position)
            shapes[found["base"]] = tuple(max(pair) for pair in zip(before, position, strict=True))
    return shapes

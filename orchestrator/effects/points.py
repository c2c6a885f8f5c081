"""A model at random points: values of all its variables, and what its flat equations say of them."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from fmus.errors import ModelicaError
from fmus.flat.compare import delayed, residuals
from fmus.flat.evaluate import Evaluator, Unknown
from fmus.flat.expressions import Parser, Tree
from fmus.flat.model import FlatEquation
from fmus.frontend.lint.tokens import tokens_of
from fmus.symbolic.system import SymbolicSystem, Variable
from fmus.symbolic.verify import near

MOST_TRIES = 40
Values = dict[str, float]


def points(system: SymbolicSystem, count: int, seed: int = 0) -> Iterator[Values]:
    """Values of all scalars by name, with `der(x)` of the states and `time`, where all of them are finite; what a model keeps from event
    to event has the value that it starts with, such as `pre(on)`.

    Args:
        system: the equations.
        count: number of points that are wanted; fewer are given where most are not finite.
        seed: of the draws.
    """
    random = np.random.default_rng(seed)
    found = 0
    for attempt in range(MOST_TRIES):
        spread = 0.3 / (1 + attempt // 8)
        time = float(random.uniform(0.0, 1.0))
        x, u = (near(random, group, spread) for group in (system.states, system.inputs))
        p = _scaled(random, system.parameters, spread)
        source, delay = (np.array(part).ravel() for part in system.history(time, u, p))
        d = [delayed(s, t) for s, t in zip(source, delay, strict=True)]
        dx, z = (np.array(part).ravel() for part in system.rhs(time, x, u, d, p))
        if not (np.isfinite(dx).all() and np.isfinite(z).all()):
            continue
        values: Values = {"time": time}
        groups: Sequence[tuple[Sequence[Variable], Sequence[float] | np.ndarray]] = (
            (system.states, x),
            (system.inputs, u),
            (system.parameters, p),
            (system.algebraics, z),
            (system.dependents, np.array(system.dependent(p)).ravel()),
        )
        for variables, numbers in groups:
            values |= {v.name: float(number) for v, number in zip(variables, numbers, strict=True)}
        if system.relations is not None and (memory := system.relations.memory) is not None:
            kept = np.array(memory.start(time, p)).ravel()
            values |= dict(zip(memory.names, map(float, kept), strict=True))
        yield values | {f"der({v.name})": float(rate) for v, rate in zip(system.states, dx, strict=True)}
        found += 1
        if found == count:
            return


def _scaled(random: np.random.Generator, parameters: Sequence[Variable], spread: float) -> list[float]:
    """Parameters near their values, with their signs: a term's side of an equation depends on the sign of a mass."""
    moved = near(random, parameters, spread)
    factors = random.uniform(1.0 - spread, 1.0 + spread, len(parameters))
    return [v.start * float(f) if v.start else m for v, f, m in zip(parameters, factors, moved, strict=True)]


def value_of(expression: str, values: Mapping[str, float]) -> float:
    """An expression at a point, by double-precision arithmetic of its own.

    Raises:
        ModelicaError: for a name without a value, or a construct that cannot be evaluated.
    """

    def lookup(name: str) -> Any:
        if name in values:
            return values[name]
        elements = [key for key in values if key.startswith(f"{name}[") and key.endswith("]")]
        if not elements:
            raise Unknown(f"'{name}' is no variable of the model")
        return np.array([values[f"{name}[{k + 1}]"] for k in range(len(elements))])

    def call(name: str, arguments: list[Tree]) -> Any:
        if name == "der" and arguments[0][0] in ("name", "index"):
            return values[f"der({_written(arguments[0])})"]
        if name == "delay":
            return delayed(*(float(evaluator.value(argument)) for argument in arguments[:2]))
        raise Unknown(f"the function '{name}'")

    evaluator = Evaluator(lookup, call)
    try:
        with np.errstate(all="ignore"):
            return float(evaluator.value(Parser(tokens_of(expression, "expression")).expression()))
    except (Unknown, KeyError, TypeError, ValueError, IndexError) as error:
        raise ModelicaError(f"the expression '{expression}' cannot be evaluated: {error}") from error


def _written(tree: Tree) -> str:
    if tree[0] == "name":
        return str(tree[1])
    return f"{_written(tree[1])}[{','.join(str(int(subscript[1])) for subscript in tree[2])}]"


class FlatPoints:
    """The flat equations of a model, to be evaluated at points of it or of a model that extends it."""

    def __init__(self, dae: Mapping[str, Any]) -> None:
        self.flat = dae["flat"]
        self.files = {entry[0]: (str(entry[1]), str(entry[2])) for entry in dae["source_map"]["files"]}
        self.sources = [text for _, text in self.files.values()]

    def residuals(self, values: Mapping[str, float]) -> list[tuple[FlatEquation, np.ndarray | None, float]]:
        """Left minus right side of each equation."""
        return residuals(self.flat, self.sources, values)

    def place(self, equation: FlatEquation) -> tuple[str, int, int]:
        """File name, line and first character of an equation; an empty name if the front end made it."""
        span = equation.span
        if span is None or span["source"] not in self.files:
            return "", 0, 0
        path, text = self.files[span["source"]]
        before = text.encode()[: span["start"]].decode(errors="ignore")
        return path.rsplit("/", 1)[-1], before.count("\n") + 1, len(before)

"""Evaluate the DAE's expressions as CasADi expressions of the model's variables."""

import itertools
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import casadi as ca
import numpy as np

from fmus.errors import ModelicaError
from fmus.symbolic import operators, tables
from fmus.symbolic.arena import Arena
from fmus.symbolic.events import SIGNS, RelationRecorder
from fmus.symbolic.values import (
    Record,
    Value,
    array_of,
    choose,
    elementwise,
    is_number,
    multiply,
    number,
    scalars,
    shape_of,
    stack,
)


@dataclass
class Frame:
    """Values inside one call of a function: arguments, local values, and the folds of its loops."""

    arguments: list[Value]
    values: dict[int, Value] = field(default_factory=dict)
    folds: dict[int, Value] = field(default_factory=dict)


class Evaluator:
    """Evaluates nodes of an arena; `lookup(kind, id)` gives the value of a variable, parameter or delay."""

    def __init__(self, arena: Arena, lookup: Callable[[str, int], Value], time: ca.SX) -> None:
        self.arena = arena
        self._lookup = lookup
        self._time = time
        self._binders: dict[int, tuple[int, ...]] = {}
        self._known: dict[int, Value] = {}
        self.relations: RelationRecorder | None = None
        self._without_events = 0

    def value(self, index: int, frame: Frame | None = None) -> Value:
        """Return the value of a node; nodes outside functions and loops are evaluated once."""
        if frame is not None or self._binders:
            return self._evaluate(index, frame)
        if index not in self._known:
            self._known[index] = self._evaluate(index, None)
        return self._known[index]

    def points(self, domain: int, depth: int | None = None) -> Iterator[None]:
        """Step through the index tuples of a domain (its first `depth` iterators), setting the iterators."""
        outer = self._binders
        for point in itertools.product(*(_range(binder) for binder in self.arena.binders(domain)[:depth])):
            self._binders = {**outer, domain: point}
            yield
        self._binders = outer

    def _evaluate(self, index: int, frame: Frame | None) -> Value:
        tag, body = self.arena.node(index)
        method: Callable[[int, Any, Frame | None], Value] | None = getattr(self, f"_{tag}", None)
        if method is None:
            raise ModelicaError(f"the construct '{tag}' is not supported")
        return method(index, body, frame)

    def _operand_values(self, index: int, frame: Frame | None) -> list[Value]:
        return [self.value(operand, frame) for operand in self.arena.operands(index)]

    # One method for each kind of node, named after the node's tag.

    def _literal(self, index: int, body: Mapping[str, Any], frame: Frame | None) -> Value:
        return next(iter(body.values()))

    def _coordinate(self, index: int, body: Any, frame: Frame | None) -> Value:
        if body == "time":
            return self._time
        kind, identity = next(iter(body.items()))
        if kind == "binder":
            return self._binders[identity["domain"]][identity["ordinal"]]
        if kind == "function_parameter":
            assert frame is not None
            return frame.arguments[identity["ordinal"]]
        return self._lookup(kind, identity)

    def _unary(self, index: int, body: Mapping[str, Any], frame: Frame | None) -> Value:
        operand = self.value(body["operand"], frame)
        if body["operator"] == "plus":
            return operand
        return elementwise((lambda a: -a) if body["operator"] == "negate" else operators.negate, operand)

    def _binary(self, index: int, body: Mapping[str, Any], frame: Frame | None) -> Value:
        operator, left = body["operator"], self.value(body["lhs"], frame)
        if operator in ("and", "or") and is_number(left) and bool(left) == (operator == "or"):
            return bool(left)  # the right side may not be valid then, for example an index out of range
        right = self.value(body["rhs"], frame)
        if operator == "multiply":
            return multiply(left, right)
        if operator in SIGNS and self.relations is not None and frame is None and not self._without_events:
            return self._relation(index, operator, left, right)
        if operator not in operators.BINARY:
            raise ModelicaError(f"operator {operator} is not supported")
        return elementwise(operators.BINARY[operator], left, right)

    def _relation(self, index: int, operator: str, left: Value, right: Value) -> Value:
        recorder, positions = self.relations, itertools.count()
        assert recorder is not None
        return elementwise(
            lambda a, b: recorder.side(index, self._binders, next(positions), operator, a, b), left, right
        )

    def _conditional(self, index: int, body: Any, frame: Frame | None) -> Value:
        operands = self.arena.operands(index)

        def branch(k: int) -> Value:
            if k == len(operands) - 1:
                return self.value(operands[k], frame)
            condition = self.value(operands[k], frame)
            if is_number(condition):
                return self.value(operands[k + 1], frame) if condition else branch(k + 2)
            return choose(condition, self.value(operands[k + 1], frame), branch(k + 2))

        return branch(0)

    def _array(self, index: int, body: Any, frame: Frame | None) -> Value:
        return stack(self._operand_values(index, frame))

    def _record(self, index: int, body: Any, frame: Frame | None) -> Value:
        return Record(tuple(self._operand_values(index, frame)))

    def _field(self, index: int, body: Mapping[str, Any], frame: Frame | None) -> Value:
        return self.value(body["base"], frame).fields[body["field"]]

    def _range(self, index: int, body: Mapping[str, Any], frame: Frame | None) -> Value:
        step_node = body["explicit_step_expression"]
        first, last = (number(self.value(body[f"{end}_expression"], frame)) for end in ("start", "stop"))
        step = 1.0 if step_node is None else number(self.value(step_node, frame))
        count = int((last - first) / step + 1e-9) + 1
        return array_of([first + k * step for k in range(count)], (count,))

    def _selection(self, index: int, frame: Frame | None) -> tuple[Any, ...]:
        """Subscripts as NumPy indices (from zero); an index that depends on variables stays symbolic."""
        chosen: list[Any] = []
        for subscript in self.arena.operands(index):
            if subscript == "whole":
                chosen.append(slice(None))
            elif "index" in subscript:
                position = self.value(subscript["index"], frame)
                chosen.append(int(position) - 1 if is_number(position) else position)
            else:
                chosen.append([int(number(k)) - 1 for k in scalars(self.value(subscript["slice"], frame))])
        return tuple(chosen)

    def _index(self, index: int, body: Mapping[str, Any], frame: Frame | None) -> Value:
        base, selection = self.value(body["base"], frame), self._selection(index, frame)
        if any(isinstance(s, ca.SX) for s in selection):
            if not all(isinstance(s, int | ca.SX) for s in selection):
                raise ModelicaError(
                    "an index that depends on variables is supported for elements only, not beside ranges"
                )
            return _pick(base, selection)
        if any(isinstance(s, int) and not 0 <= s < n for s, n in zip(selection, base.shape, strict=False)):
            raise ModelicaError(f"index {[s + 1 for s in selection]} is outside an array of shape {base.shape}")
        return base[_outer(selection, base.shape)]

    def _array_update(self, index: int, body: Mapping[str, Any], frame: Frame | None) -> Value:
        result = self.value(body["base"], frame).copy()
        result[_outer(self._selection(index, frame), result.shape)] = self.value(body["value"], frame)
        return result

    def _comprehension(self, index: int, body: Mapping[str, Any], frame: Frame | None) -> Value:
        domain = body["domain"]
        items = [self.value(body["body"], frame) for _ in self.points(domain)]
        extents = tuple(len(_range(binder)) for binder in self.arena.binders(domain))
        return array_of([s for item in items for s in scalars(item)], extents + shape_of(items[0]))

    def _builtin(self, index: int, body: Mapping[str, Any], frame: Frame | None) -> Value:
        quiet = body["builtin"] in ("no_event", "smooth")
        self._without_events += quiet
        values = self._operand_values(index, frame)
        self._without_events -= quiet
        return operators.apply(body["builtin"], values)

    def _runtime_quotient_owner(self, index: int, body: Mapping[str, Any], frame: Frame | None) -> Value:
        left, right = self.value(body["lhs"], frame), self.value(body["rhs"], frame)
        return operators.apply(body["builtin"], [left, right])

    def _call(self, index: int, body: Mapping[str, Any], frame: Frame | None) -> Value:
        if body["derivative"] is not None:
            raise ModelicaError("derivatives of functions are not supported")
        arguments = self._operand_values(body["owner"], frame)
        return self._run(body["function"], arguments)[body["output"]]

    def _function_value(self, index: int, body: Mapping[str, Any], frame: Frame | None) -> Value:
        assert frame is not None
        return frame.values[body["value"]]

    def _function_fold_parameter(self, index: int, body: Any, frame: Frame | None) -> Value:
        assert frame is not None
        return frame.folds[index]

    _function_fold_output = _function_fold_parameter

    # Functions are executed on symbolic arguments, statement by statement.

    def _run(self, index: int, arguments: list[Value]) -> list[Value]:
        function = self.arena.functions[index]
        external = function["external"]
        if external is not None and external["symbol"].startswith(tables.PREFIX):
            return [
                tables.call(self.arena, external["symbol"], arguments, lambda index: self._lookup("parameter", index))
            ]
        if external is not None and external["language"] == "builtin":
            frame = Frame(arguments)
            return [operators.apply(external["symbol"], [self.value(a["input"], frame) for a in external["arguments"]])]
        if external is not None:
            raise ModelicaError(f"external function {function['name']} is not supported")
        frame, outer = Frame(arguments), self._binders
        self._binders = {}
        for position, declared in enumerate(function["outputs"] + function["locals"]):
            shape = tuple(self.arena.value_type(declared["value_type"])["dimensions"])
            if shape:
                frame.values[position] = array_of([0.0] * int(np.prod(shape)), shape)
        self._execute(function["statements"], frame, self.arena.folds[index])
        self._binders = outer
        return [frame.values[k] for k in range(len(function["outputs"]))]

    def _execute(self, statements: list[dict[str, Any]], frame: Frame, folds: Mapping[int, Any]) -> None:
        for statement in statements:
            kind, body = next(iter(statement.items()))
            if kind == "assignment":
                frame.values[body["target"]] = self.value(body["rhs"], frame)
            elif kind == "assignment_group":
                frame.values.update({a["target"]: self.value(a["rhs"], frame) for a in body["assignments"]})
            elif kind == "for":
                self._loop(body, frame, folds)
            elif kind != "assertion":
                raise ModelicaError(f"the statement '{kind}' is not supported")

    def _loop(self, loop: Mapping[str, Any], frame: Frame, folds: Mapping[int, Any]) -> None:
        begins, ends = folds[id(loop)]
        for node, target in zip(begins, loop["targets"], strict=True):
            frame.folds[node] = frame.values.get(target, 0.0)
        for _ in self.points(loop["domain"]):
            for node, target in zip(begins, loop["targets"], strict=True):
                frame.values[target] = frame.folds[node]
            self._execute(loop["statements"], frame, folds)
            for node, target in zip(begins, loop["targets"], strict=True):
                frame.folds[node] = frame.values[target]
        for node, begin, target in zip(ends, begins, loop["targets"], strict=True):
            frame.folds[node] = frame.values[target] = frame.folds[begin]


def _range(binder: Mapping[str, Any]) -> range:
    return range(binder["lower"], binder["upper"] + (1 if binder["step"] > 0 else -1), binder["step"])


def _pick(base: Value, selection: Sequence[int | ca.SX]) -> Value:
    """Element at positions of which some are symbolic (from one); the last one beyond the end."""
    if not selection:
        return base
    first, *rest = selection
    if isinstance(first, int):
        return _pick(base[first], rest)
    result = _pick(base[-1], rest)
    for k in range(len(base) - 1):
        result = choose(first == k + 1, _pick(base[k], rest), result)
    return result


def _outer(selection: tuple[Any, ...], shape: tuple[int, ...]) -> Any:
    """NumPy index for Modelica's rule that several index lists span a grid."""
    lists = [s for s in selection if isinstance(s, list)]
    if len(lists) < 2:
        return selection
    full = [s if isinstance(s, list) else list(range(n))[s] for s, n in zip(selection, shape, strict=True)]
    return np.ix_(*[s if isinstance(s, list) else [s] for s in full])

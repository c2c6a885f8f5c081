"""Symbols and records of a model's variables and parameters, from the front end's declarations."""

from collections.abc import Mapping, Sequence
from typing import Any

import casadi as ca
import numpy as np

from fmus.errors import ModelicaError
from fmus.symbolic.arena import Arena
from fmus.symbolic.dae import Equation, Quantity, column
from fmus.symbolic.discrete import expressions
from fmus.symbolic.expressions import Evaluator
from fmus.symbolic.memory import Memory
from fmus.symbolic.system import Variable
from fmus.symbolic.values import Value, array_of, element_names, from_scalars, is_number, scalars, shape_of


class Declarations:
    """What a model declares, by the front end's numbers of variables and by Modelica names of scalars.

    `quantities` are what the equations determine: states, algebraic variables, and parameters that the start
    determines (`fixed=false`), for which `equations` say that they stay constant.
    """

    def __init__(self, arena: Arena, name: str, *, keeps: bool = False) -> None:
        self.arena, self.name = arena, name
        self.time = ca.SX.sym("time")
        self.evaluator = Evaluator(arena, self.lookup, self.time)
        self.values: dict[int, Value] = {}
        self.derivatives: dict[int, Value] = {}
        self.delays: dict[int, Value] = {}
        self.settings: dict[str, bool | float | str] = {}
        self.inputs: list[ca.SX] = []
        self.parameters: list[ca.SX] = []
        self.quantities: list[Quantity] = []
        self.equations: list[Equation] = []
        self.dependents: list[ca.SX] = []
        self.dependent_names: list[str] = []
        self.records: dict[str, Variable] = {}
        self.discrete = expressions(arena)
        self.memory = Memory(arena, self, keeps)
        self.asks_initial = False
        self._open: set[int] = set()
        self._declare()
        for index, variable in enumerate(arena.variables):
            if variable["role"] in ("parameter", "constant"):
                self._parameter(index)
            elif variable["role"] == "input" and variable["attributes"]["binding"] is not None:
                self._record(variable, scalars(self.values[index]), self._given(variable))
        for index in self.memory.branches:
            self._held(index)

    def variables(self, symbols: Sequence[ca.SX]) -> tuple[Variable, ...]:
        """The records of scalars given by their symbols."""
        return tuple(self.records[symbol.name()] for symbol in symbols)

    def _declare(self) -> None:
        for index, variable in enumerate(self.arena.variables):
            role = variable["role"]
            if role in ("state", "algebraic", "output"):
                self._quantity(index, variable, has_derivative=role == "state")
            elif role == "input":
                self.values[index] = value = self._symbols(variable)
                self.inputs.extend(scalars(value))
                starts = self._starts(variable, len(scalars(value)))
                numbers = [float(s) if s is not None and is_number(s) else 0.0 for s in starts]
                self._record(variable, scalars(value), numbers)
            elif role == "discrete_value":
                self._not_an_output(variable)
            elif role == "discrete_real":
                # Its start and whether that is fixed belong to what it was before.
                attributes = {**variable["attributes"], "fixed": None}
                self._quantity(index, {**variable, "attributes": attributes}, has_derivative=False, has_start=False)
            elif role not in ("parameter", "constant"):
                raise ModelicaError(
                    f"{self._at(variable)}{variable['name']} is a {role.replace('_', ' ')} variable, "
                    "which is not supported"
                )

    def _given(self, variable: Mapping[str, Any]) -> list[float]:
        """The numbers that an input is declared with; it has them until it is driven.

        Raises:
            ModelicaError: if they depend on something: then it is no input of the model.
        """
        shape = tuple(self.arena.value_type(variable["value_type"])["dimensions"])
        values = scalars(self._broadcast(self.evaluator.value(variable["attributes"]["binding"]), shape))
        if not all(is_number(value) for value in values):
            raise ModelicaError(
                f"{self._at(variable)}the input {variable['name']} is given a value that depends on other variables or parameters; "
                "drop 'input' if it follows from them, or the value if the record drives it"
            )
        return [float(value) for value in values]

    def _quantity(
        self, index: int, variable: Mapping[str, Any], *, has_derivative: bool, has_start: bool = True
    ) -> None:
        self.values[index] = value = self._symbols(variable)
        symbols = scalars(value)
        rates: list[ca.SX | None] = [None] * len(symbols)
        if has_derivative:
            self.derivatives[index] = rate = self._symbols(variable, "der({})")
            rates = scalars(rate)
        self._record(variable, symbols, [None] * len(symbols))
        attributes = variable["attributes"]
        fixed = attributes["fixed"] or [None]
        fixed = fixed * len(symbols) if len(fixed) == 1 else fixed
        starts = self._starts(variable, len(symbols)) if has_start else [None] * len(symbols)
        for symbol, rate, start, is_fixed in zip(symbols, rates, starts, fixed, strict=True):
            self.quantities.append(
                Quantity(
                    symbol,
                    rate,
                    None if start is None else ca.SX(start),
                    is_fixed,
                    self.records[symbol.name()].nominal,
                    attributes["state_select"].lower(),
                    self.arena.where(variable["declaration"]),
                )
            )

    def _symbols(self, variable: Mapping[str, Any], pattern: str = "{}") -> Value:
        shape = tuple(self.arena.value_type(variable["value_type"])["dimensions"])
        created = [ca.SX.sym(pattern.format(name)) for name in element_names(variable["name"], shape)]
        return from_scalars(created, shape) if created else array_of([], shape)

    def _record(self, declared: Mapping[str, Any], symbols: Sequence[ca.SX], starts: Sequence[float | None]) -> None:
        for symbol, start in zip(symbols, starts, strict=True):
            self.records[symbol.name()] = self._variable(declared, symbol.name(), start)

    def _variable(self, declared: Mapping[str, Any], name: str, start: float | None) -> Variable:
        attributes = declared["attributes"]
        element = name[len(declared["name"]) :]

        def bound(key: str) -> float | None:
            node = attributes.get(key)
            value = None if node is None else self.evaluator.value(node)
            if shape_of(value):
                position = list(element_names("", shape_of(value))).index(element)
                value = scalars(value)[position]
            return float(value) if value is not None and is_number(value) else None

        return Variable(
            name=name,
            unit=attributes.get("unit") or "",
            description=attributes.get("description") or "",
            start=start,
            minimum=bound("min"),
            maximum=bound("max"),
            nominal=bound("nominal"),
        )

    def _starts(self, variable: Mapping[str, Any], count: int) -> list[Value | None]:
        """Declared start of each element, None without one."""
        node = variable["attributes"]["start"]
        if node is None or self.arena.is_implicit(node, variable):
            return [None] * count
        items = scalars(self.evaluator.value(node))
        return items * count if len(items) == 1 else items

    def _held(self, index: int) -> None:
        """A discrete Real is what it was at the last event."""
        if self.arena.variables[index]["role"] == "discrete_real":
            place = self.arena.where(self.arena.variables[index]["declaration"])
            pairs = zip(scalars(self.values[index]), scalars(self.memory.before(index)), strict=True)
            self.equations.extend(Equation(symbol - before, place) for symbol, before in pairs)

    def lookup(self, kind: str, index: int) -> Value:
        """The value of a variable between events."""
        if kind == "parameter":
            return self._parameter(index)
        if kind == "derivative":
            return self.derivatives[index]
        if kind == "delay":
            return self._delay(index)
        if kind == "discrete_value" and index in self.discrete:
            return self._discrete(index)
        if kind in ("pre_discrete_value", "pre_discrete_real") or kind == "discrete_value":
            return self.memory.before(index)
        if kind in ("input", "state", "algebraic", "output", "discrete_real", "pre_state"):
            return self.values[index]
        if kind == "condition":
            return self._condition(index)
        raise ModelicaError(f"{self.name} uses a {kind.replace('_', ' ')} variable, which is not supported")

    def _condition(self, number: int) -> Value:
        """The only condition that equations speak of is initial(), which is over once a run has begun."""
        if self.arena.storage["conditions"][number]["node"] != "initial":
            raise ModelicaError("a condition of an event inside of an equation is not supported")
        self.asks_initial = True
        return False

    def _not_an_output(self, variable: Mapping[str, Any]) -> None:
        if variable["attributes"]["declared_causality"] == "output" and "." not in variable["name"]:
            raise ModelicaError(
                f"{self._at(variable)}the output {variable['name']} is no Real; declare a Real that is "
                f"'if {variable['name']} then 1 else 0' (of an Integer: {variable['name']})"
            )

    def _discrete(self, index: int) -> Value:
        """A Boolean or Integer variable is its expression."""
        variable = self.arena.variables[index]
        if index in self._open:
            raise ModelicaError(f"{self._at(variable)}{variable['name']} depends on itself; break the loop by pre()")
        self._open.add(index)
        value = self.evaluator.value(self.discrete[index])
        self._open.remove(index)
        return value

    def _parameter(self, index: int) -> Value:
        """Value of a parameter: a symbol if its binding is a plain value, else an expression of others."""
        if index in self.values:
            return self.values[index]
        variable = self.arena.variables[index]
        if variable["attributes"]["fixed"] and not all(variable["attributes"]["fixed"]):
            return self._calculated(index, variable)
        kind = self.arena.value_type(variable["value_type"])
        node = variable["attributes"]["binding"]
        if node is None:
            node = variable["attributes"]["start"]
            node = None if node is None or self.arena.is_implicit(node, variable) else node
        if node is None:
            raise ModelicaError(f"{self._at(variable)}parameter {variable['name']} has no value; give it one")
        value = self._broadcast(self.evaluator.value(node), tuple(kind["dimensions"]))
        items = scalars(value)
        if kind["scalar"] != "real" or variable["role"] == "constant":
            self.settings.update(zip(element_names(variable["name"], shape_of(value)), items, strict=True))
        elif all(is_number(item) for item in items):
            value = self._symbols(variable)
            self.parameters.extend(scalars(value))
            self._record(variable, scalars(value), [float(item) for item in items])
        elif self._varies(items):
            self._quantity(index, variable, has_derivative=False, has_start=False)
            place = self.arena.where(variable["declaration"])
            pairs = zip(scalars(self.values[index]), items, strict=True)
            self.equations.extend(Equation(symbol - item, place) for symbol, item in pairs)
            value = self.values[index]
        else:
            names = list(element_names(variable["name"], shape_of(value)))
            self.dependents.extend(ca.SX(item) for item in items)
            self.dependent_names.extend(names)
            self.records.update({name: self._variable(variable, name, None) for name in names})
        self.values[index] = value
        return value

    def _calculated(self, index: int, variable: Mapping[str, Any]) -> Value:
        """A parameter that the initial equations determine; it is a state that stays as it starts."""
        self.derivatives[index] = self._symbols(variable, "der({})")
        self._quantity(index, variable, has_derivative=True)
        place = self.arena.where(variable["declaration"])
        self.equations.extend(Equation(rate, place) for rate in scalars(self.derivatives[index]))
        return self.values[index]

    def _varies(self, items: Sequence[Value]) -> bool:
        """Whether a binding depends on a parameter that the start determines."""
        symbols = column([q.symbol for q in self.quantities])
        return bool(symbols.numel()) and ca.depends_on(column([ca.SX(item) for item in items]), symbols)

    @staticmethod
    def _broadcast(value: Value, shape: tuple[int, ...]) -> Value:
        if not shape or shape_of(value):
            return value
        return array_of([value] * int(np.prod(shape)), shape)

    def _delay(self, index: int) -> Value:
        if index not in self.delays:
            source = self.evaluator.value(self.arena.storage["delays"][index]["source"])
            created = [ca.SX.sym(f"delay[{index}]") for _ in scalars(source)]
            self.delays[index] = from_scalars(created, shape_of(source))
        return self.delays[index]

    def _at(self, variable: Mapping[str, Any]) -> str:
        place = self.arena.where(variable["declaration"])
        return f"{place}: " if place else ""

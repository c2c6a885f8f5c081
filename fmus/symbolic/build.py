"""From the front end's DAE to a `SymbolicSystem`: variables, parameters, equations, interface."""

from collections.abc import Iterator, Mapping
from typing import Any

import casadi as ca
import numpy as np

from fmus.errors import ModelicaError
from fmus.symbolic.arena import Arena
from fmus.symbolic.explicit import solve_blocks
from fmus.symbolic.expressions import Evaluator
from fmus.symbolic.system import SymbolicSystem, Variable
from fmus.symbolic.values import Value, array_of, from_scalars, is_number, scalars, shape_of

# Parts of the representation that carry behaviour this translator cannot express yet.
REFUSED = {
    "initialization_equation_operations": "initial equations",
    "discrete_real_equations": "when equations",
    "discrete_value_owners": "discrete variables",
    "model_event_transactions": "when equations",
    "event_actions": "when, reinit, assert or terminate",
    "time_events": "time events",
    "clocks": "sample or clocks",
}


def build_system(dae: Mapping[str, Any], name: str, description: str = "") -> SymbolicSystem:
    """Translate the flat DAE of one model into explicit symbolic functions.

    Relations in `if` expressions are evaluated as they stand, without events.

    Raises:
        ModelicaError: for a construct outside the supported subset, named with its place.
    """
    arena = Arena(dae)
    for key, words in REFUSED.items():
        if arena.storage.get(key):
            raise ModelicaError(f"{name} uses {words}, which is not supported")
    return _Builder(arena, name, description).build()


class _Builder:
    """Collects symbols while expressions are evaluated; used once."""

    def __init__(self, arena: Arena, name: str, description: str) -> None:
        self.arena, self.name, self.description = arena, name, description
        self.time = ca.SX.sym("time")
        self.evaluator = Evaluator(arena, self._lookup, self.time)
        self.values: dict[int, Value] = {}
        self.derivatives: dict[int, Value] = {}
        self.delays: dict[int, Value] = {}
        self.settings: dict[str, bool | float | str] = {}
        self.symbols: dict[str, list[ca.SX]] = {k: [] for k in ("input", "state", "algebraic", "parameter")}
        self.variables: dict[str, list[Variable]] = {k: [] for k in self.symbols}
        self.dependent: list[ca.SX] = []
        self.dependent_variables: list[Variable] = []

    def build(self) -> SymbolicSystem:
        self._declare()
        for index, variable in enumerate(self.arena.variables):
            if variable["role"] in ("parameter", "constant"):
                self._parameter(index)
        residuals, places = self._equations()
        derivatives = [s for i in self.derivatives for s in scalars(self.derivatives[i])]
        solved = solve_blocks(residuals, derivatives + self.symbols["algebraic"], places)
        dx, z = solved[: len(derivatives)], solved[len(derivatives) :]
        sources, delay_times = self._history(z)
        columns = {k: ca.vertcat(ca.SX(0, 1), *v) for k, v in self.symbols.items()}
        x, u, p = columns["state"], columns["input"], columns["parameter"]
        d = ca.vertcat(ca.SX(0, 1), *[s for i in self.delays for s in scalars(self.delays[i])])
        initial = ca.vertcat(ca.SX(0, 1), *self._start_expressions())
        dependent = ca.vertcat(ca.SX(0, 1), *self.dependent)
        system = SymbolicSystem(
            name=self.name,
            description=self.description,
            inputs=tuple(self.variables["input"]),
            states=self._with_start(initial, p),
            algebraics=tuple(self.variables["algebraic"]),
            parameters=tuple(self.variables["parameter"]),
            dependents=tuple(self.dependent_variables),
            outputs=tuple(self._outputs()),
            settings=self.settings,
            rhs=ca.Function(
                "rhs", [self.time, x, u, d, p], [ca.vertcat(ca.SX(0, 1), *dx), ca.vertcat(ca.SX(0, 1), *z)]
            ),
            history=ca.Function("history", [self.time, u, p], [sources, delay_times]),
            dependent=ca.Function("dependent", [p], [dependent]),
            initial=ca.Function("initial", [p], [initial]),
        )
        return system

    def _declare(self) -> None:
        """Create the symbols of inputs, states and algebraic variables."""
        for index, variable in enumerate(self.arena.variables):
            role = "algebraic" if variable["role"] == "output" else variable["role"]
            if role in ("parameter", "constant"):
                continue
            if role not in self.symbols:
                place = self.arena.where(variable["declaration"])
                raise ModelicaError(f"{place}: {variable['name']} is a {role} variable, which is not supported")
            self.values[index] = self._symbols(variable, "{}", role)
            if role == "state":
                self.derivatives[index] = self._symbols(variable, "der({})", None)

    def _symbols(self, variable: Mapping[str, Any], pattern: str, role: str | None) -> Value:
        shape = tuple(self.arena.value_type(variable["value_type"])["dimensions"])
        names = list(_element_names(variable["name"], shape))
        created = [ca.SX.sym(pattern.format(name)) for name in names]
        if role is not None:
            self.symbols[role].extend(created)
            if role != "parameter":  # a parameter's record carries its value and is added by `_parameter`
                starts = self._declared_starts(variable, len(names)) if role == "input" else [None] * len(names)
                for name, start in zip(names, starts, strict=True):
                    self.variables[role].append(self._variable(variable, name, start))
        return from_scalars(created, shape) if names else array_of([], shape)

    def _variable(self, declared: Mapping[str, Any], name: str, start: float | None) -> Variable:
        attributes = declared["attributes"]
        element = name[len(declared["name"]) :]

        def bound(key: str) -> float | None:
            node = attributes.get(key)
            value = None if node is None else self.evaluator.value(node)
            if shape_of(value):
                position = list(_element_names("", shape_of(value))).index(element)
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

    def _declared_starts(self, variable: Mapping[str, Any], count: int) -> list[float]:
        node = variable["attributes"]["start"]
        if node is None:
            return [0.0] * count
        items = scalars(self.evaluator.value(node))
        items = items * count if len(items) == 1 else items
        return [float(item) if is_number(item) else 0.0 for item in items]

    def _lookup(self, kind: str, index: int) -> Value:
        if kind == "parameter":
            return self._parameter(index)
        if kind == "derivative":
            return self.derivatives[index]
        if kind == "delay":
            return self._delay(index)
        if kind in ("input", "state", "algebraic", "output"):
            return self.values[index]
        raise ModelicaError(f"{self.name} uses a {kind.replace('_', ' ')} variable, which is not supported")

    def _parameter(self, index: int) -> Value:
        """Value of a parameter: a symbol if its binding is a plain value, else an expression of others."""
        if index in self.values:
            return self.values[index]
        variable = self.arena.variables[index]
        kind = self.arena.value_type(variable["value_type"])
        node = variable["attributes"]["binding"]
        if node is None:
            node = variable["attributes"]["start"]
            node = None if node is None or self.arena.is_implicit(node, variable) else node
        if node is None:
            place = self.arena.where(variable["declaration"])
            raise ModelicaError(f"{place}: parameter {variable['name']} has no value; give it one")
        value = self._broadcast(self.evaluator.value(node), tuple(kind["dimensions"]))
        if kind["scalar"] != "real" or variable["role"] == "constant":
            self._note_setting(variable["name"], value)
        elif all(is_number(item) for item in scalars(value)):
            value = self._independent(variable, value)
        else:
            names = list(_element_names(variable["name"], shape_of(value)))
            self.dependent.extend(ca.SX(item) for item in scalars(value))
            self.dependent_variables.extend(self._variable(variable, name, None) for name in names)
        self.values[index] = value
        return value

    def _note_setting(self, name: str, value: Value) -> None:
        for element, item in zip(_element_names(name, shape_of(value)), scalars(value), strict=True):
            self.settings[element] = item

    def _independent(self, variable: Mapping[str, Any], value: Value) -> Value:
        names = list(_element_names(variable["name"], shape_of(value)))
        for name, item in zip(names, scalars(value), strict=True):
            self.variables["parameter"].append(self._variable(variable, name, float(item)))
        return self._symbols(variable, "{}", "parameter")

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

    def _history(self, algebraics: list[ca.SX]) -> tuple[ca.SX, ca.SX]:
        """What each delay operator remembers, in terms of inputs and parameters, and its delay time."""
        sources: list[ca.SX] = []
        times: list[ca.SX] = []
        for index in self.delays:
            entry = self.arena.storage["delays"][index]
            kind = next(iter(entry["kind"].values()))
            node = kind["delay_time"]
            time = self.evaluator.value(node["expression"] if isinstance(node, dict) else node)
            for source in scalars(self.evaluator.value(entry["source"])):
                sources.append(ca.SX(source))
                times.append(ca.SX(time))
        column = ca.vertcat(ca.SX(0, 1), *sources)
        if self.symbols["algebraic"]:
            column = ca.substitute(column, ca.vertcat(*self.symbols["algebraic"]), ca.vertcat(*algebraics))
        remembered = [s for v in self.delays.values() for s in scalars(v)] + self.symbols["state"]
        if remembered and column.numel() and ca.depends_on(column, ca.vertcat(*remembered)):
            entry = self.arena.storage["delays"][0]
            raise ModelicaError(
                f"{self.arena.where(entry['provenance'])}: delay() of a quantity that depends on states or on "
                "another delay is not supported; delay an input"
            )
        return column, ca.vertcat(ca.SX(0, 1), *times)

    def _equations(self) -> tuple[list[ca.SX], list[str]]:
        residuals: list[ca.SX] = []
        places: list[str] = []
        for operation in self.arena.storage["continuous_equation_operations"]:
            kind, body = next(iter(operation.items()))
            place = self.arena.where(body["provenance"])
            try:
                found = [ca.SX(item) for item in self._residuals(kind, body)]
            except ModelicaError as error:
                raise ModelicaError(f"{place}: {error}" if place else str(error)) from error
            residuals.extend(found)
            places.extend([place] * len(found))
        return residuals, places

    def _residuals(self, kind: str, body: Mapping[str, Any]) -> list[Value]:
        if kind == "residual":
            return scalars(self.evaluator.value(body["residual"]))
        view = body["scalar_view"]
        if view == "RowMajorProjection":
            return [s for node in body["bodies"] for s in scalars(self.evaluator.value(node))]
        depth = None if view == "BinderSubstitution" else view["BinderPrefixProjection"]["binder_count"]
        found: list[Value] = []
        for _ in self.evaluator.points(body["domain"], depth):
            for node in body["bodies"]:
                found.extend(scalars(self.evaluator.value(node)))
        return found

    def _start_expressions(self) -> list[ca.SX]:
        found: list[ca.SX] = []
        for index in self.derivatives:
            variable = self.arena.variables[index]
            count = len(scalars(self.values[index]))
            node = variable["attributes"]["start"]
            items = [0.0] if node is None else scalars(self.evaluator.value(node))
            found.extend(ca.SX(item) for item in (items * count if len(items) == 1 else items))
        return found

    def _with_start(self, initial: ca.SX, parameters: ca.SX) -> tuple[Variable, ...]:
        """The states with the start values that follow from the default parameters."""
        defaults = [v.start or 0.0 for v in self.variables["parameter"]]
        values = ca.Function("start", [parameters], [initial])(ca.DM(defaults)).full().ravel()
        return tuple(
            Variable(**{**vars(state), "start": float(value)})
            for state, value in zip(self.variables["state"], values, strict=True)
        )

    def _outputs(self) -> Iterator[str]:
        for variable in self.arena.variables:
            declared = variable["attributes"]["declared_causality"] == "output"
            if declared and "." not in variable["name"]:
                yield from _element_names(
                    variable["name"], tuple(self.arena.value_type(variable["value_type"])["dimensions"])
                )


def _element_names(name: str, shape: tuple[int, ...]) -> Iterator[str]:
    """Modelica names of the elements of an array, row-major: `q[1]`, `q[2]`, ..."""
    for position in np.ndindex(*shape):
        yield name + (f"[{','.join(str(k + 1) for k in position)}]" if shape else "")

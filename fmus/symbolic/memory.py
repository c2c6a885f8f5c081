"""What a model remembers from event to event: `pre`, `when`, `sample`, `reinit` and `initial()`.

Such values change at events only. Each is a symbol beside the sides of the relations, with what it starts with and what it becomes:

* `pre(v)` of a discrete variable becomes v,
* the condition of a `when` is remembered, since what counts is that it becomes true,
* a clock counts its ticks,
* `initial()` holds until the first update.

At an event relations take their sides first, then all memories are updated at once, until nothing changes: the event iteration of
the Modelica specification (3.6, section 8.6).
"""

import math
from collections.abc import Mapping, Sequence
from typing import Any, Protocol

import casadi as ca

from fmus.errors import ModelicaError
from fmus.symbolic.arena import Arena
from fmus.symbolic.dae import column
from fmus.symbolic.discrete import Branch, branches
from fmus.symbolic.events import RelationRecorder
from fmus.symbolic.expressions import Evaluator
from fmus.symbolic.operators import BINARY, negate
from fmus.symbolic.values import Value, array_of, choose, element_names, from_scalars, scalars, shape_of

INITIAL = -1
# Of a period: so much before its time a clock ticks, which is rounding.
EARLY = 1e-9


class Declared(Protocol):
    """What a model declares, as far as its memories need it; `discrete` has the expressions of variables without a `when`."""

    time: ca.SX
    evaluator: Evaluator
    parameters: list[ca.SX]
    values: dict[int, Value]
    discrete: dict[int, int]

    def lookup(self, kind: str, index: int) -> Value:
        """The value of a variable between events."""


class Memory:
    """The memories of one model; without `keeps` they stay what they start with, for a model without events."""

    def __init__(self, arena: Arena, declared: Declared, keeps: bool) -> None:
        self.arena, self.declared, self.keeps = arena, declared, keeps
        self.evaluator = Evaluator(arena, self._lookup, declared.time)
        self.symbols: list[ca.SX] = []
        self.starts: list[ca.SX] = []
        self.due: list[ca.SX] = []  # s, when each clock ticks next
        self.branches: Mapping[int, Sequence[Branch]] = branches(arena)
        self._given = {e["target"]: e["value"] for e in arena.storage.get("initial_discrete_values") or ()}
        self._kept: dict[int, list[ca.SX]] = {}
        self._before: dict[int, Value] = {}
        self._current: dict[int, Value] = {}
        self._conditions: dict[int, ca.SX] = {}
        self._clocks: dict[int, tuple[ca.SX, Value]] = {}

    def __bool__(self) -> bool:
        return bool(self.symbols)

    def before(self, index: int) -> Value:
        """The value of a discrete variable before an event, which is its value between events."""
        if index not in self._before:
            variable = self.arena.variables[index]
            shape = tuple(self.arena.value_type(variable["value_type"])["dimensions"])
            start = self._start(index, shape)
            names = element_names(variable["name"], shape)
            pairs = zip(names, scalars(start), strict=True)
            self._kept[index] = [self._new(f"pre({name})", value) for name, value in pairs]
            self._before[index] = from_scalars(self._kept[index], shape) if self.keeps else start
        return self._before[index]

    def _start(self, index: int, shape: tuple[int, ...]) -> Value:
        node = self._given.get(index)
        node = self.arena.variables[index]["attributes"]["start"] if node is None else node
        value = 0.0 if node is None else self.declared.evaluator.value(node)
        return array_of([value] * math.prod(shape), shape) if shape and not shape_of(value) else value

    def _new(self, name: str, start: Value) -> ca.SX:
        symbol = ca.SX.sym(name)
        self.symbols.append(symbol)
        self.starts.append(ca.SX(float(start) if isinstance(start, bool) else start))
        return symbol

    def values(self, parameters: ca.SX) -> tuple[list[str], ca.Function]:
        """Names such as `pre(count)`, and what they start with: a function of time and parameters."""
        kept = [
            (s.name(), start) for s, start in zip(self.symbols, self.starts, strict=True) if s.name().startswith("pre(")
        ]
        function = ca.Function("start", [self.declared.time, parameters], [column([start for _, start in kept])])
        return [name for name, _ in kept], function

    def updates(self, recorder: RelationRecorder) -> list[ca.SX]:
        """What each memory becomes, in the order of `symbols`; relations in conditions make events."""
        self.evaluator.relations = recorder
        becomes: dict[int, ca.SX] = {}
        for number, clock in enumerate(self.arena.storage["clocks"]):
            count, ticks = self._clock(number, clock)
            becomes[count.element_hash()] = count + ticks
        for action in self._resets():
            self._rises(action["trigger"])  # declares what it remembers
        # A value of one variable may ask for the past of another one, so that there is more to update.
        done: set[int] = set()
        while open_ := [index for index in (*self.branches, *self._kept) if index not in done]:
            for index in open_:
                self.before(index)
                pairs = zip(self._kept[index], scalars(self._now(index)), strict=True)
                becomes |= {kept.element_hash(): ca.SX(value) for kept, value in pairs}
                done.add(index)
        for number in list(self._conditions):
            value = ca.SX(0) if number == INITIAL else ca.SX(self.condition(number))
            becomes[self._conditions[number].element_hash()] = value
        self.evaluator.relations = None
        return [becomes[symbol.element_hash()] for symbol in self.symbols]

    def _clock(self, number: int, clock: Mapping[str, Any]) -> tuple[ca.SX, Value]:
        """The ticks of a clock up to now, and whether the next one is due."""
        lattice = clock["kind"]["periodic"]["lattice"]
        period, phase = (lattice[key]["num"] / lattice[key]["den"] for key in ("period", "phase"))
        first = ca.fmax(0, ca.ceil((self.declared.time - phase) / period - EARLY))
        count = self._new(f"clock[{number}]", first)
        self.due.append(phase + period * count)
        self._clocks[number] = count, self.declared.time >= self.due[-1] - EARLY * period
        return self._clocks[number]

    def resets(self, states: Sequence[ca.SX]) -> list[ca.SX]:
        """What each state becomes by `reinit`; itself without one.

        Raises:
            ModelicaError: if a variable is set that is no state.
        """
        found = {symbol.element_hash(): symbol for symbol in states}
        after = dict(found)
        for action in reversed(self._resets()):
            change = action["kind"]["reinitialize"]
            target, value = self.declared.values[change["state"]], self.evaluator.value(change["value"])
            active = self._active(action["trigger"], action["guard"])
            for symbol, new in zip(scalars(target), scalars(value), strict=True):
                key = symbol.element_hash()
                if key not in found:
                    place = self.arena.where(action["provenance"])
                    raise ModelicaError(f"{place}: reinit() of {symbol.name()}, which was not chosen as a state")
                after[key] = choose(active, ca.SX(new), after[key])
        return [after[symbol.element_hash()] for symbol in states]

    def _resets(self) -> list[Mapping[str, Any]]:
        actions = self.arena.storage["event_actions"]
        return [a for a in actions if isinstance(a["kind"], dict) and "reinitialize" in a["kind"]]

    @property
    def start(self) -> ca.SX:
        """Start values, functions of time and parameters.

        Raises:
            ModelicaError: if one depends on anything else.
        """
        known = {s.element_hash() for s in (self.declared.time, *self.declared.parameters)}
        for symbol, start in zip(self.symbols, self.starts, strict=True):
            others = [s.name() for s in ca.symvar(start) if s.element_hash() not in known]
            if others:
                raise ModelicaError(f"{symbol.name()} starts with what depends on {others[0]}, which is not supported")
        return column(self.starts)

    def _lookup(self, kind: str, index: int) -> Value:
        """Values during an update: discrete variables have what they become."""
        if kind in ("discrete_real", "discrete_value") and (index in self.branches or index in self.declared.discrete):
            return self._now(index)  # where initial() may hold, which it does not between events
        if kind == "condition":
            return self.condition(index)
        return self.declared.lookup(kind, index)

    def _now(self, index: int) -> Value:
        if index not in self._current:
            if index not in self.branches:
                self._current[index] = self.evaluator.value(self.declared.discrete[index])
                return self._current[index]
            self._current[index] = self.before(index)  # a loop among the values of one instant reads the past
            value = self.before(index)
            for branch in reversed(self.branches[index]):
                new = self.evaluator.value(branch.value)
                value = (
                    new if branch.trigger is None else choose(self._active(branch.trigger, branch.guard), new, value)
                )
            self._current[index] = value
        return self._current[index]

    def _active(self, trigger: int, guard: int | None) -> Value:
        rises = self._rises(trigger)
        return rises if guard in (None, trigger) else BINARY["and"](rises, self.condition(guard))

    def _rises(self, number: int) -> Value:
        """Whether a condition becomes true."""
        node: Any = self.arena.storage["conditions"][number]["node"]
        if node == "initial":
            return self.condition(number)
        if "any_rise" in node:
            return BINARY["or"](*(self._rises(node["any_rise"][side]) for side in ("lhs", "rhs")))
        if "clock" in node:
            return self.condition(number)
        if number not in self._conditions:
            # A condition that holds at the start does not become true there.
            self._conditions[number] = self._new(f"condition[{number}]", 1.0)
        return BINARY["and"](self.condition(number), negate(self._conditions[number]))

    def condition(self, number: int) -> Value:
        """The value of one of the front end's conditions during an update."""
        node: Any = self.arena.storage["conditions"][number]["node"]
        if node == "initial":
            if INITIAL not in self._conditions:
                self._conditions[INITIAL] = self._new("initial()", 1.0)
            return self._conditions[INITIAL]
        if node == "always":
            return True
        [(tag, body)] = node.items()
        if tag == "relation":
            return self.evaluator.value(self.arena.storage["relations"][body]["relation"]["expression"])
        if tag == "not":
            return negate(self.condition(body))
        if tag in ("and", "or"):
            return BINARY[tag](*(self.condition(body[side]) for side in ("lhs", "rhs")))
        if tag == "any_rise":
            return self._rises(number)
        if tag == "discrete":
            return self.evaluator.value(body)
        if tag == "clock":
            return self._clocks[body][1]
        raise ModelicaError(f"a condition of kind '{tag}' is not supported")

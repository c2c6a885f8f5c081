"""Relations that make events in an FMU: `x > 1` in an equation, outside `noEvent`, `smooth` and functions."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import casadi as ca

from fmus.errors import ModelicaError
from fmus.symbolic.arena import Arena
from fmus.symbolic.conditions import decides
from fmus.symbolic.dae import column
from fmus.symbolic.operators import BINARY
from fmus.symbolic.solution import Solution
from fmus.symbolic.system import Relations, Remembered, SymbolicSystem
from fmus.symbolic.values import Value, is_number

# Operators whose relation holds where the left side minus the right one is positive, or where the negative of that is.
SIGNS = {"greater": 1, "greater_equal": 1, "less": -1, "less_equal": -1}

Point = Mapping[int, tuple[int, ...]]


@dataclass(frozen=True)
class _Relation:
    """One relation of scalars: its side c, and what is positive where it holds."""

    side: ca.SX
    difference: ca.SX
    size: ca.SX
    holds_at_zero: bool
    name: str


@dataclass(frozen=True)
class Kept:
    """Memories: their symbols, start values (of time and parameters), what they and the states become at an event.

    `due` are the times (s) at which clocks tick next; `resets` tells whether a state can become another one than it is.
    """

    symbols: Sequence[ca.SX]
    start: ca.SX
    updates: Sequence[ca.SX]
    due: Sequence[ca.SX]
    states: Sequence[ca.SX]
    resets: bool


@dataclass
class RelationRecorder:
    """Collects the relations that an evaluator meets and, with `freeze`, lets them keep their side.

    Relations of `constants` (parameters) never change during a run and stay as they stand.
    """

    arena: Arena
    constants: Iterable[ca.SX]
    freeze: bool
    memory: Sequence[ca.SX] = ()
    found: dict[tuple[Any, ...], _Relation] = field(default_factory=dict)

    def side(self, node: int, point: Point, position: int, operator: str, left: Value, right: Value) -> Value:
        """Value of one scalar relation: its side as a symbol, or the comparison itself."""
        plain = BINARY[operator](left, right)
        if is_number(plain):
            return plain
        constant = {symbol.element_hash() for symbol in (*self.constants, *self.memory)}
        difference = SIGNS[operator] * (ca.SX(left) - ca.SX(right))
        if all(symbol.element_hash() in constant for symbol in ca.symvar(difference)):
            return plain
        key = (node, *sorted(point.items()), position)
        if key not in self.found:
            size = ca.fabs(ca.SX(left)) + ca.fabs(ca.SX(right))
            symbol = ca.SX.sym(f"c{len(self.found)}")
            self.found[key] = _Relation(symbol, difference, size, operator.endswith("equal"), self._name(node))
        return self.found[key].side if self.freeze else plain

    def _name(self, node: int) -> str:
        text, place = self.arena.text_and_place(node)
        return f"'{text}' ({place})" if place else f"'{text}'"

    @property
    def sides(self) -> list[ca.SX]:
        """The symbols of all relations."""
        return [relation.side for relation in self.found.values()]

    def relations(
        self, solution: Solution, arguments: Sequence[ca.SX], wanted: Sequence[ca.SX], kept: Kept
    ) -> Relations:
        """Describe the frozen model: `arguments` are t, x, u, d, p, and `wanted` the derivatives and algebraics."""
        time, parameters = arguments[0], arguments[4]
        timed: list[tuple[_Relation, float | None]] = []
        others: list[tuple[_Relation, float | None]] = []
        kept_symbols = {symbol.element_hash() for symbol in (*self.sides, *kept.symbols)}
        for relation in (_as_jump(each, solution, kept_symbols) for each in self.found.values()):
            rate = _rate_in_time(relation, solution, time, parameters)
            (others if rate is None else timed).append((relation, rate))
        ordered = [relation for relation, _ in (*others, *timed)]
        waiting = ordered[: len(others)]
        known = [*arguments, column([*(relation.side for relation in ordered), *kept.symbols])]
        return Relations(
            names=tuple(relation.name for relation in ordered),
            holds_at_zero=tuple(relation.holds_at_zero for relation in waiting),
            rhs=solution.function("rhs", known, wanted),
            indicators=solution.function(
                "indicators", known, [column([r.difference for r in waiting]), column([r.size for r in waiting])]
            ),
            times=_event_times(timed, solution, time, parameters),
            memory=_remembered(kept, solution, arguments, known) if kept.symbols else None,
        )


def _remembered(kept: Kept, solution: Solution, arguments: Sequence[ca.SX], known: Sequence[ca.SX]) -> Remembered:
    return Remembered(
        names=tuple(symbol.name() for symbol in kept.symbols),
        resets=kept.resets,
        start=ca.Function("start", [arguments[0], arguments[4]], [ca.densify(kept.start)]),
        due=ca.Function("due", [column(kept.symbols)], [column(kept.due)]),
        update=solution.function("update", known, [column(kept.updates), column(kept.states)]),
    )


def without_memory(rhs: ca.Function) -> Remembered:
    """Describe what a model that remembers nothing keeps; `rhs` takes t, x, u, d, p, c."""
    places = [ca.SX.sym("p", rhs.numel_in(i)) for i in range(rhs.n_in())]
    none = ca.SX(0, 1)
    return Remembered(
        names=(),
        resets=False,
        start=ca.Function("start", [places[0], places[4]], [none]),
        due=ca.Function("due", [none], [none]),
        update=ca.Function("update", places, [none, places[1]]),
    )


def _as_jump(relation: _Relation, solution: Solution, kept: set[int]) -> _Relation:
    """Where what is compared jumps only, as integer(x) >= 2 does, it may stop at zero; what is positive where it holds jumps, too."""
    [difference] = solution.express([relation.difference])
    moving = [symbol for symbol in ca.symvar(difference) if symbol.element_hash() not in kept]
    if not ca.simplify(ca.jacobian(difference, column(moving))).is_zero():
        return relation
    holds = relation.difference >= 0 if relation.holds_at_zero else relation.difference > 0
    return replace(relation, difference=2 * holds - 1, size=ca.SX(1))


def _rate_in_time(relation: _Relation, solution: Solution, time: ca.SX, parameters: ca.SX) -> float | None:
    """Derivative by time of what a relation compares, if that is linear in time and depends on parameters otherwise."""
    [difference] = solution.express([relation.difference])
    allowed = {s.element_hash() for s in (time, *ca.symvar(parameters))}
    if any(symbol.element_hash() not in allowed for symbol in ca.symvar(difference)):
        return None
    if decides(difference, time):
        return None
    rate = ca.simplify(ca.jacobian(difference, time))
    return float(rate) if rate.is_constant() and not rate.is_zero() else None


def _event_times(
    timed: Sequence[tuple[_Relation, float | None]], solution: Solution, time: ca.SX, parameters: ca.SX
) -> ca.Function:
    differences = solution.express([column([relation.difference for relation, _ in timed])])[0]
    rates = ca.DM([rate or 0.0 for _, rate in timed])
    at_zero = ca.substitute(differences, time, ca.SX(0)) if timed else ca.SX(0, 1)
    times = -at_zero / rates if timed else ca.SX(0, 1)
    return ca.Function("times", [parameters], [times, ca.SX(rates > 0) if timed else ca.SX(0, 1)])


def check_same_variables(frozen: Sequence[str], plain: Sequence[str], name: str) -> None:
    """Raise ModelicaError if relations that keep their side lead to another choice of states."""
    if list(frozen) != list(plain):
        raise ModelicaError(f"{name}: the choice of states depends on relations; use noEvent() in rigid couplings")


def without_relations(system: SymbolicSystem) -> Relations:
    """Describe the relations of a system that has none."""
    rhs = system.rhs
    symbol = ca.SX.sym if rhs.is_a("SXFunction") else ca.MX.sym
    arguments: list[Any] = [symbol(rhs.name_in(i), rhs.numel_in(i)) for i in range(rhs.n_in())]
    sides: Any = symbol("c", 0)
    shaped = [ca.reshape(argument, *rhs.size_in(i)) for i, argument in enumerate(arguments)]
    none = ca.SX(0, 1)
    places = [ca.SX.sym("p", rhs.numel_in(i)) for i in range(rhs.n_in())]
    return Relations(
        names=(),
        holds_at_zero=(),
        rhs=ca.Function("rhs", [*arguments, sides], rhs.call(shaped)),
        indicators=ca.Function("indicators", [*places, ca.SX.sym("c", 0)], [none, none]),
        times=ca.Function("times", [places[-1]], [none, none]),
    )

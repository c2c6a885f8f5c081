"""Index reduction: Pantelides' algorithm, then static dummy derivatives (Mattsson and Soderlind 1993).

Rigid couplings leave fewer degrees of freedom than there are variables under `der`. The equations of a coupling are
differentiated until the highest derivatives can be solved for, and as many variables stop being states.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import casadi as ca

from fmus.errors import ModelicaError
from fmus.symbolic.dae import Dae, Equation, Quantity, column
from fmus.symbolic.matching import Matching
from fmus.symbolic.selection import choose_dummies, preference
from fmus.symbolic.structure import singular_message

# Mechanical couplings need two; more than this is a model that cannot be solved at all.
MOST_DIFFERENTIATIONS = 8


@dataclass(frozen=True)
class Reduced:
    """A DAE whose derivatives and algebraic variables follow from its states.

    `states` have derivatives; `algebraics` are all other variables with a Modelica name; `hidden` are derivatives that
    are no derivative of a state.
    """

    states: list[Quantity]
    algebraics: list[Quantity]
    hidden: list[ca.SX]
    equations: list[Equation]

    @property
    def demoted(self) -> list[Quantity]:
        """Variables under `der` that are no states."""
        return [q for q in self.algebraics if q.derivative is not None]


@dataclass
class _Graph:
    """Variables with their derivatives, equations with theirs, by position."""

    dae: Dae
    symbols: list[ca.SX] = field(default_factory=list)
    quantities: list[Quantity | None] = field(default_factory=list)
    derivative: list[int | None] = field(default_factory=list)
    base: list[int | None] = field(default_factory=list)
    equations: list[Equation] = field(default_factory=list)
    next_equation: list[int | None] = field(default_factory=list)
    first_equation: list[int | None] = field(default_factory=list)
    matching: Matching = field(default_factory=Matching)
    number: dict[int, int] = field(default_factory=dict)

    def add_variable(self, symbol: ca.SX, quantity: Quantity | None, base: int | None) -> int:
        self.symbols.append(symbol)
        self.quantities.append(quantity)
        self.derivative.append(None)
        self.base.append(base)
        self.number[int(symbol.element_hash())] = len(self.symbols) - 1
        if base is not None:
            self.derivative[base] = len(self.symbols) - 1
        return len(self.symbols) - 1

    def add_equation(self, equation: Equation, before: int | None) -> int:
        self.equations.append(equation)
        self.next_equation.append(None)
        self.first_equation.append(before)
        symbols = ca.symvar(equation.residual)
        self.matching.columns_of.append(
            [self.number[h] for h in (int(s.element_hash()) for s in symbols) if h in self.number]
        )
        if before is not None:
            self.next_equation[before] = len(self.equations) - 1
        return len(self.equations) - 1

    def derivative_of(self, variable: int) -> int:
        """The derivative of a variable, made up where none occurs."""
        found = self.derivative[variable]
        if found is None:
            found = self.add_variable(ca.SX.sym(f"der({self.symbols[variable].name()})"), None, variable)
        return found

    def differentiate(self, index: int) -> int:
        """Add the time derivative of an equation."""
        equation = self.equations[index]
        order, position = 0, self.first_equation[index]
        while position is not None:
            order, position = order + 1, self.first_equation[position]
        if order >= MOST_DIFFERENTIATIONS:
            at = f"{equation.place}: " if equation.place else ""
            raise ModelicaError(f"{at}index reduction does not end; the equations around here contradict each other")
        self._refuse_inputs(equation)
        symbols = [s for s in ca.symvar(equation.residual) if int(s.element_hash()) in self.number]
        rates = [self.symbols[self.derivative_of(self.number[int(s.element_hash())])] for s in symbols]
        time = self.dae.knowns.time
        rate = ca.jtimes(equation.residual, column([*symbols, time]), column([*rates, ca.SX(1)]))
        return self.add_equation(Equation(ca.simplify(rate), equation.place), index)

    def _refuse_inputs(self, equation: Equation) -> None:
        given = ca.vertcat(self.dae.knowns.inputs, self.dae.knowns.delays)
        known = {int(s.element_hash()): s.name() for s in ca.symvar(given)} if given.numel() else {}
        for symbol in ca.symvar(equation.residual):
            name = known.get(int(symbol.element_hash()))
            if name is not None:
                at = f"{equation.place}: " if equation.place else ""
                raise ModelicaError(
                    f"{at}this equation has to be differentiated, but the derivative of {name} is not known; let the "
                    "input act through a force, or filter it"
                )


def reduce_index(dae: Dae, values: Mapping[int, float]) -> Reduced:
    """Return equations that determine all derivatives, and the choice of states that goes with them.

    Args:
        dae: the model as it is written.
        values: a value of every known, and of every variable at the start, by the hash of its symbol.

    Raises:
        ModelicaError: if the equations are structurally singular, or an input would have to be differentiated.
    """
    states = [q for q in dae.quantities if q.derivative is not None]
    algebraics = [q for q in dae.quantities if q.derivative is None]
    highest = [q.symbol if q.derivative is None else q.derivative for q in dae.quantities]
    residuals = column([e.residual for e in dae.equations])
    if len(dae.equations) != len(highest):
        raise ModelicaError(f"{len(dae.equations)} equations for {len(highest)} unknowns; the model is not balanced")
    if not highest or ca.sprank(ca.jacobian_sparsity(residuals, column(highest))) == len(highest):
        return Reduced(states, algebraics, [], list(dae.equations))
    _check_structure(dae, residuals)
    graph = _graph(dae)
    for row in range(len(dae.equations)):
        _assign(graph, row)
    return _selected(graph, _dummies(graph, values))


def _check_structure(dae: Dae, residuals: ca.SX) -> None:
    """Refuse a model that no differentiation helps: variables and their derivatives counted as one unknown."""
    merged = column([q.symbol for q in dae.quantities])
    stand_ins = [(q.derivative, q.symbol) for q in dae.quantities if q.derivative is not None]
    together = ca.substitute(residuals, column([d for d, _ in stand_ins]), ca.sin(column([s for _, s in stand_ins])))
    incidence = ca.jacobian_sparsity(together, merged)
    if ca.sprank(incidence) < merged.numel():
        symbols = [q.symbol for q in dae.quantities]
        raise ModelicaError(singular_message(incidence, symbols, [e.place for e in dae.equations]))


def _graph(dae: Dae) -> _Graph:
    graph = _Graph(dae)
    for quantity in dae.quantities:
        number = graph.add_variable(quantity.symbol, quantity, None)
        if quantity.derivative is not None:
            graph.add_variable(quantity.derivative, None, number)
    for equation in dae.equations:
        graph.add_equation(equation, None)
    return graph


def _assign(graph: _Graph, row: int) -> None:
    """One round of Pantelides: find the equation a highest derivative, differentiating what stands in the way."""
    matching = graph.matching

    def is_highest(variable: int) -> bool:
        return graph.derivative[variable] is None

    while not matching.add(row, is_highest):
        rows, columns = matching.overdetermined(row, is_highest)
        owners = {variable: matching.row_of.pop(variable) for variable in columns}
        for variable in sorted(columns):
            graph.derivative_of(variable)
        later = {number: graph.differentiate(number) for number in sorted(rows)}
        for variable, owner in owners.items():
            matching.row_of[graph.derivative_of(variable)] = later[owner]
        row = later[row]


def _dummies(graph: _Graph, values: Mapping[int, float]) -> set[int]:
    """Derivatives that become unknowns of their own, level by level from the highest."""
    chosen: set[int] = set()
    rows = [k for k, later in enumerate(graph.next_equation) if later is None and graph.first_equation[k] is not None]
    columns = [k for k, later in enumerate(graph.derivative) if later is None and graph.base[k] is not None]
    while rows:
        level = choose_dummies(
            [graph.equations[k].residual for k in rows],
            [graph.symbols[k] for k in columns],
            [
                preference(graph.quantities[base], graph.symbols[base])
                for k in columns
                if (base := graph.base[k]) is not None
            ],
            values,
            [graph.equations[k].place for k in rows],
        )
        picked = [columns[position] for position in level]
        chosen.update(picked)
        before = [graph.first_equation[k] for k in rows]
        rows = [k for k in before if k is not None and graph.first_equation[k] is not None]
        lower = [graph.base[k] for k in picked]
        columns = [k for k in lower if k is not None and graph.base[k] is not None]
    return chosen


def _selected(graph: _Graph, dummies: set[int]) -> Reduced:
    states: list[Quantity] = []
    algebraics: list[Quantity] = []
    hidden: list[ca.SX] = []
    rates = set()
    for k, later in enumerate(graph.derivative):
        quantity, symbol = graph.quantities[k], graph.symbols[k]
        if later is not None and later not in dummies:
            states.append(quantity_of(quantity, symbol, graph.symbols[later]))
            rates.add(later)
        elif quantity is not None:
            algebraics.append(quantity)
        else:
            hidden.append(symbol)
    known = {int(symbol.element_hash()) for symbol in (graph.symbols[k] for k in rates)}
    return Reduced(states, algebraics, [s for s in hidden if int(s.element_hash()) not in known], graph.equations)


def quantity_of(quantity: Quantity | None, symbol: ca.SX, derivative: ca.SX) -> Quantity:
    """A state: a declared variable, or a derivative that has no name of its own."""
    if quantity is None:
        return Quantity(symbol, derivative)
    return replace(quantity, derivative=derivative)

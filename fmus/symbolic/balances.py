"""Balance equations of a model, each with an input that adds to what drives its state.

A balance equation says how fast something stored changes: m*der(v) = forces, C*der(T) = heat flows. It is told from the flat
equations: one that holds the derivative of a state and is not merely der(q) = w. What a model lacks, a friction, a leak, a loss,
enters there, so that a diagnosis needs no preparation of the model.
"""

from collections.abc import Collection, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import casadi as ca
import numpy as np
import scipy

from fmus.errors import MisfitError
from fmus.frontend.lint.dimensions import UNKNOWN, Dimension, Known, is_one_of, of_unit
from fmus.frontend.lint.unit_check import dimension_of
from fmus.symbolic.arena import Arena
from fmus.symbolic.build import SystemBuilder
from fmus.symbolic.dae import Dae, Equation, Knowns, column
from fmus.symbolic.forces import Slopes, forces_of
from fmus.symbolic.reduction import Reduced
from fmus.symbolic.solution import Solution
from fmus.symbolic.system import KeptInputs, SymbolicSystem, Variable

# Units that engineers write, by their SI exponents; `rad` in the state's unit tells a torque from a work.
_FLOWS = ("N", "N.m", "W", "A", "V", "m3/s", "kg/s", "mol/s", "Pa")
_RATES = ("1", "Pa/s", "K/s", "m/s2", "m/s", "1/s", "A/s", "V/s", "mol/(m3.s)")
# What a lever or a gear carries over.
FORCES = ("N", "N.m")
_FILLING = ("W", "A", "m3/s", "kg/s", "mol/s")
# An equation of accelerations that belong to a linkage holds rates, too; a balance of forces is preferred to it.
UNLIKELY = 0.1
# A force does not drive a shaft's speed where a torque does, whatever the sizes of both, which are in different units.
FOREIGN = 1e-3
# Which input drives which state is asked at so many points, about so near to the start.
POINTS, NEAR = 5, 0.1
# Stands for a gain of zero, whose logarithm is finite then.
NONE = 1e-200


@dataclass(frozen=True)
class Balance:
    """A balance equation: `storage * der(state) = ... + input`, its terms in `unit`.

    `input` is the name of the added input; a positive value adds to der(state). `position` is the state whose derivative the
    state is, empty if there is none (a speed has a position, a temperature has none). `place` is `file:line` of the equation.
    `shares` are factors with which forces of the model, variables by name, enter: of a lever's force its arm. Where the equation is
    solved for an acceleration, the input acts through a `force`, a variable or an input of the model, with the sign `along`.
    """

    state: str
    unit: str
    position: str
    input: str
    place: str = ""
    shares: Mapping[str, float] = field(default_factory=dict, hash=False)
    force: str = ""
    along: float = 1.0


class Driven(NamedTuple):
    """An equation, by number, that drives a state with a sign: a positive input then adds to the state's rate.

    `force` is the variable that the equation gives if it is that of a force, or an input, which has no equation (-1).
    """

    equation: int
    state: str
    sign: float
    force: str = ""


def with_balances(
    dae: Mapping[str, Any], name: str, description: str = ""
) -> tuple[SymbolicSystem, tuple[Balance, ...]]:
    """Translate a flat DAE as `build_system` does, with an input at each balance equation.

    Args:
        dae: the flat model, as the compiler gives it.
        name: name of the model.
        description: what it is, in a line.

    Returns:
        The system, and its balances, each with the name of its input.

    Raises:
        ModelicaError: for a construct outside the supported subset.
    """
    builder, system = _built(dae, name, description)
    states = {v.name for v in system.states}
    if any(balance.state not in states for balance in builder.balances):
        # Of what is rigidly coupled, the speed that stays a state stands for all: a force elsewhere moves it, too.
        every, whole = builder, system
        builder, system = _built(dae, name, description, states)
        inherited = _inherited(whole, every, {balance.state for balance in builder.balances})
        if inherited:
            own = (each for each in every.settled if each.state in states)
            builder, system = _built(dae, name, description, states, [*own, *inherited])
    settled = _settled(system, builder)
    if settled != list(builder.settled):
        builder, system = _built(dae, name, description, builder.only, settled)
    forced = _through_forces(system, builder, dae, name)
    if forced != list(builder.settled):
        builder, system = _built(dae, name, description, builder.only, forced)
    if builder.declared.memory:
        system = replace(system, kept=builder.kept())
    return system, tuple(_with_position(balance, system) for balance in builder.balances)


def _built(
    dae: Mapping[str, Any],
    name: str,
    description: str,
    only: Collection[str] | None = None,
    settled: Sequence[Driven] = (),
) -> tuple["_BalancedBuilder", SymbolicSystem]:
    """A builder that has built, and its system; `only` and `settled` are those of the builder."""
    builder = _BalancedBuilder(Arena(dae), {**dae, "flat": None}, name, description, keeps=True)
    builder.only, builder.settled = only, settled
    return builder, builder.build()


def _settled(system: SymbolicSystem, builder: "_BalancedBuilder") -> list[Driven]:
    """The equations of a built system's balances with the states that they drive, and signs.

    Inputs and states are paired so that the product of their gains d(rate)/d(input) is the largest. Of a linkage these are the
    inverse of its mass matrix, which is positive definite; its product is largest on the diagonal (g_ij^2 < g_ii g_jj), in
    whatever order the equations stand. (Pairing for a large product: Duff and Koster 2001, for sparse matrices.)
    """
    states, inputs = [b.state for b in builder.balances], [b.input for b in builder.balances]
    gains = _gains(system, states, inputs) if builder.balances else np.zeros((0, 0, 0))
    if not len(gains):
        return list(builder.settled)
    size = np.mean(np.log(np.maximum(np.abs(gains), NONE)), axis=0)
    driven = dict(zip(*(map(int, part) for part in scipy.optimize.linear_sum_assignment(-size.T)), strict=True))
    found = []
    for k, each in enumerate(builder.settled):
        turned = float(np.sign(np.mean(gains[:, driven[k], k]))) or 1.0
        found.append(Driven(each.equation, builder.balances[driven[k]].state, each.sign * turned))
    return found


def _inherited(system: SymbolicSystem, builder: "_BalancedBuilder", have: Collection[str]) -> list[Driven]:
    """Equations for speeds that are states and have none of their own, such as that of a damper at a shaft: the balance of what
    is rigidly coupled to them, and moves as fast or most nearly so."""
    names, shown = [v.name for v in system.states], [v.name for v in system.algebraics]
    speeds = [b for b in builder.balances if b.state in shown]
    t, x, p = ca.SX.sym("t"), ca.SX.sym("x", len(names)), [v.start or 0.0 for v in system.parameters]
    u, d = [v.start or 0.0 for v in system.inputs], ca.SX.sym("d", system.n_delays)
    rates, values = system.rhs(t, x, u, d, p)
    found: list[Driven] = []
    for k, name in enumerate(names):
        is_position = any(ca.is_equal(rates[k], x[j]) for j in range(len(names)))
        if name in have or name not in builder.declared.records or is_position or not speeds:
            continue
        slopes = [ca.simplify(ca.jacobian(values[shown.index(b.state)], x[k])) for b in speeds]
        ratios = [abs(float(slope)) if slope.is_constant() else 0.0 for slope in slopes]
        taken = [each.equation for each in found]
        free = [i for i, ratio in enumerate(ratios) if ratio > 0 and builder.settled[i].equation not in taken]
        if free:
            best = min(free, key=lambda i: abs(np.log(ratios[i])))
            place = next(n for n, b in enumerate(builder.balances) if b is speeds[best])
            own = builder.settled[place]
            found.append(Driven(own.equation, name, own.sign * float(np.sign(float(slopes[best])))))
    return found


def _through_forces(
    system: SymbolicSystem, builder: "_BalancedBuilder", dae: Mapping[str, Any], name: str
) -> list[Driven]:
    """The equations of a built system's balances, in place of those of accelerations those of the forces that drive them."""
    settled = list(builder.settled)
    speeds = [b for b in builder.balances if _is_speed(system, b.state)]
    forces = builder.forces
    if not forces or not any(b.unit not in FORCES for b in speeds):
        return settled
    _, probed = _built(dae, name, "", builder.only, [*settled, *(each for each in forces if each.equation >= 0)])
    names = [b.state for b in speeds]
    inputs = [f"balance({each.force})" if each.equation >= 0 else each.force for each in forces]
    gains = _gains(probed, names, [*(b.input for b in speeds), *inputs], np.pi)
    if not len(gains):
        return settled
    units = {v.name: v.unit for v in system.states}
    powers = [[_is_power(builder.declared.records[f.force].unit, units[s]) for f in forces] for s in names]
    stands = np.array([b.unit in FORCES for b in speeds])
    found = forces_of(Slopes(gains[:, :, len(speeds) :], gains[:, :, : len(speeds)], stands, np.array(powers)))
    for i, (k, sign) in found.items():
        place = next(n for n, each in enumerate(settled) if each.state == names[i])
        force = forces[k]
        if force.equation >= 0 or np.any(np.delete(gains[:, :, len(speeds) + k], i, axis=1)):
            settled[place] = Driven(force.equation, names[i], force.sign * sign, force.force)
    return settled


def _is_speed(system: SymbolicSystem, state: str) -> bool:
    return is_one_of(next((v.unit for v in system.states if v.name == state), ""), ("m/s", "rad/s"))


def _is_power(force: str, speed: str) -> bool:
    return (of_unit(force) == of_unit("N")) == (of_unit(speed) == of_unit("m/s"))


def _gains(
    system: SymbolicSystem, states: Sequence[str], forces: Sequence[str], turned: float | None = None
) -> np.ndarray:
    """How fast states begin to change for a unit of each of some inputs, at states near the start (points, states, inputs); points at
    which the equations cannot be solved are left out. Angles are within +-`turned` if that is given."""
    names, inputs = [v.name for v in system.states], [v.name for v in system.inputs]
    own, given = [names.index(state) for state in states], [inputs.index(force) for force in forces]
    angles = [k for k, v in enumerate(system.states) if turned and is_one_of(v.unit, ("rad",))]
    parameters, start = (np.array([v.start or 0.0 for v in part]) for part in (system.parameters, system.states))
    random, found = np.random.default_rng(1), []
    for _ in range(POINTS):
        state = start + NEAR * random.standard_normal(len(start)) * np.where(start == 0.0, 1.0, np.abs(start))
        state[angles] = random.uniform(-1.0, 1.0, len(angles)) * (turned or 0.0)
        rates = []
        with suppress(RuntimeError):  # equations without a solution there say nothing
            for k in (None, *given):
                u = np.array([v.start or 0.0 for v in system.inputs])
                if k is not None:
                    u[k] += 1.0
                delayed = system.history(0.0, u, parameters)[0]
                rates.append(np.array(system.rhs(0.0, state, u, delayed, parameters)[0]).ravel()[own])
            found.append((np.array(rates[1:]) - rates[0]).T)
    gains = np.array(found)
    return np.where(np.isfinite(gains), gains, 0.0)


def _with_position(balance: Balance, system: SymbolicSystem) -> Balance:
    """The balance with the state whose derivative its state is."""
    t, p = ca.SX.sym("t"), ca.SX.sym("p", len(system.parameters))
    x, u, d = ca.SX.sym("x", len(system.states)), ca.SX.sym("u", len(system.inputs)), ca.SX.sym("d", system.n_delays)
    rates = system.rhs(t, x, u, d, p)[0]
    names = [v.name for v in system.states]
    if balance.state not in names:
        return balance
    own = x[names.index(balance.state)]
    found = [v.name for k, v in enumerate(system.states) if ca.is_equal(rates[k], own) and not is_store(v.unit)]
    return replace(balance, position=found[0]) if found else balance


class _BalancedBuilder(SystemBuilder):
    """Builds a system whose balance equations have inputs."""

    balances: tuple[Balance, ...] = ()
    only: Collection[str] | None = None  # states that have a balance; None: all
    settled: Sequence[Driven] = ()  # equations, states and signs of balances, where they are known
    forces: Sequence[Driven] = ()  # what accelerations are solved from

    def _equations(self, section: str) -> list[Equation]:
        found = super()._equations(section)
        if section == "continuous_equation_operations":
            self._dimensions = self._of_equations(section)
        return found

    def _of_equations(self, section: str) -> list[Known]:
        """Dimension of each scalar equation, in the order of `_equations`."""
        known: list[Known] = []
        measure = dimension_of(self.arena)
        for operation in self.arena.storage[section]:
            kind, body = next(iter(operation.items()))
            node = body["residual"] if kind == "residual" else body["bodies"][0]
            known += [measure(node)] * len(self._residuals(kind, body))
        return known

    def _dae(self) -> Dae:
        dae = self._with_memories(super()._dae())
        units_of = {q.name: self.declared.records[q.name].unit for q in dae.quantities if q.derivative is not None}
        rates = {k: own for k, own in _rates(dae, units_of).items() if self.only is None or k in self.only}
        rows = _balance_rows(dae.equations, rates, [s for k in rates if is_store(units_of[k]) for s in rates[k]])
        if not rows and not self.settled:
            return dae
        equations, found, added = list(dae.equations), [], []
        self.settled = self.settled or self._paired(dae, rates, rows)
        forces = [q.symbol for q in dae.quantities if q.derivative is None and self._is_force(q.name)]
        self.forces = self._solved_from(dae, forces)
        values = self._values(dae, *self._defaults(dae.knowns)[::2]) if forces else {}
        given = {s.element_hash(): values.get(s.element_hash(), np.nan) for s in ca.symvar(dae.knowns.parameters)}
        for index, state, sign, force in self.settled:
            symbol = ca.SX.sym(f"balance({state})")
            record = self.declared.records[force or state]
            place, unit, shares, along = "", record.unit, {}, sign
            if index >= 0:
                own = equations[index]
                if force:
                    given_by = next(f for f in forces if f.name() == force)
                    along = sign * float(ca.jacobian(own.residual, given_by))
                place, unit = own.place, _unit(self._dimension(index), self.declared.records[state].unit)
                shares = _shares(own.residual, [f for f in forces if f.name() != force], sign, given)
                equations[index] = replace(own, residual=own.residual - sign * symbol)
            else:
                given_by = next(s for s in self.declared.inputs if s.name() == force)
                equations = [
                    replace(e, residual=ca.substitute(e.residual, given_by, given_by + sign * symbol))
                    for e in equations
                ]
            found.append(Balance(state, unit, "", symbol.name(), place, shares, force, along if force else 1.0))
            added.append(symbol)
            self.declared.records[symbol.name()] = Variable(symbol.name(), unit, f"adds to the balance of {state}", 0.0)
        self.declared.inputs.extend(added)
        self.balances = tuple(found)
        knowns = Knowns(dae.knowns.time, column(self.declared.inputs), dae.knowns.delays, dae.knowns.parameters)
        return replace(dae, knowns=knowns, equations=equations)

    def _with_memories(self, dae: Dae) -> Dae:
        """What is kept from event to event as inputs, behind the model's own."""
        memory = self.declared.memory
        if not memory:
            return dae
        p = dae.knowns.parameters
        values = self._defaults(dae.knowns)[2]
        starts = np.array(ca.Function("start", [dae.knowns.time, p], [memory.start])(0.0, values)).ravel()
        for symbol, start in zip(memory.symbols, starts, strict=True):
            self.declared.records[symbol.name()] = Variable(symbol.name(), "", "kept from event to event", float(start))
        self.declared.inputs.extend(memory.symbols)
        return replace(dae, knowns=replace(dae.knowns, inputs=column(self.declared.inputs)))

    def _solved(
        self, reduced: Reduced, knowns: Knowns, sides: Sequence[ca.SX] = ()
    ) -> tuple[list[ca.SX], list[ca.SX], Solution]:
        arguments, wanted, solution = super()._solved(reduced, knowns, sides)
        if self.declared.memory:
            self.update = solution.function("update", arguments, [column(self.updates)])
        return arguments, wanted, solution

    def kept(self) -> KeptInputs:
        """What is kept from event to event."""
        memory = self.declared.memory
        p = column(self.declared.parameters)
        start = ca.Function("start", [self.declared.time, p], [ca.densify(memory.start)])
        return KeptInputs(tuple(symbol.name() for symbol in memory.symbols), start, self.update)

    def _paired(self, dae: Dae, rates: Mapping[str, list[ca.SX]], rows: Sequence[int]) -> list[Driven]:
        """Equations, the states whose balances they seem to be, and signs, from slopes at first guesses of all variables."""
        values = self._values(dae, *self._defaults(dae.knowns)[::2])
        units = [self.declared.records[state].unit for state in rates]
        likely = np.array([[_likely(self._dimension(k), unit) for unit in units] for k in rows])
        assigned = _assigned([dae.equations[k].residual for k in rows], list(rates.values()), values, likely)
        states = list(rates)
        return [Driven(rows[row], states[place], sign) for row, (place, sign) in assigned.items()]

    def _solved_from(self, dae: Dae, forces: Sequence[ca.SX]) -> list[Driven]:
        """The forces, variables with equations of their own or inputs, that stand in equations of accelerations."""
        rows = [
            e.equation for e in self.settled if e.equation >= 0 and _named(self._dimension(e.equation)) not in FORCES
        ]
        accelerations = [dae.equations[k].residual for k in rows]
        if not accelerations:
            return []
        here = {s.element_hash() for s in ca.symvar(ca.vertcat(*accelerations))}
        taken, found = {each.equation for each in self.settled}, []
        for force in (f for f in forces if f.element_hash() in here):
            for k, equation in enumerate(dae.equations):
                slope = ca.jacobian(equation.residual, force)
                if k not in taken and slope.nnz() and slope.is_constant() and abs(float(slope)) == 1.0:
                    found.append(Driven(k, force.name(), float(slope), force.name()))
                    taken.add(k)
                    break
        given = [s for s in ca.symvar(dae.knowns.inputs) if s.element_hash() in here and self._is_force(s.name())]
        return [*found, *(Driven(-1, s.name(), 1.0, s.name()) for s in given)]

    def _is_force(self, name: str) -> bool:
        return is_one_of(self.declared.records[name].unit, FORCES)

    def _dimension(self, index: int) -> Known:
        return self._dimensions[index] if index < len(self._dimensions) else UNKNOWN


def _shares(residual: ca.SX, forces: Sequence[ca.SX], sign: float, given: Mapping[int, float]) -> dict[str, float]:
    """Factors with which forces enter a balance, where they are of parameters alone, whose values are `given` by hash."""
    here = {s.element_hash() for s in ca.symvar(residual)}
    found = {}
    for force in (f for f in forces if f.element_hash() in here):
        slope = ca.jacobian(residual, force)
        free = ca.symvar(slope)
        if slope.nnz() and all(s.element_hash() in given for s in free):
            numbers = ca.DM([given[s.element_hash()] for s in free])
            number = float(ca.substitute(slope, ca.vertcat(*free), numbers) if free else slope)
            if np.isfinite(number) and number != 0.0:
                found[force.name()] = -sign * number
    return found


def is_store(unit: str) -> bool:
    """Whether a state of this unit is what a flow fills: a charge, a heat, a mass, a volume; a length is none."""
    try:
        return bool(unit) and of_unit(f"{unit}/s" if "/" not in unit else f"{unit}.s-1") in map(of_unit, _FILLING)
    except MisfitError:
        return False


def _rates(dae: Dae, units: Mapping[str, str]) -> dict[str, list[ca.SX]]:
    """By state, the symbols that stand for its derivative in balance equations: der(x) and the variables that equal it.

    A state whose derivative is itself a state, or a state times a ratio, as that of a position is, has no balance. What a flow
    fills has one, although the flow may be a state: the charge behind an inductor.
    """
    states = {q.symbol.element_hash() for q in dae.quantities if q.derivative is not None}
    given = {s.element_hash() for s in ca.symvar(dae.knowns.inputs)}
    # What an input gives is no other name for a rate: der(m) = u is the balance of a store with a pump.
    names = [pair for pair in _names(dae.equations) if given.isdisjoint(s.element_hash() for s in pair)]
    found: dict[str, list[ca.SX]] = {}
    for quantity in dae.quantities:
        if quantity.derivative is None:
            continue
        equal = _closure(quantity.derivative, names)
        own = [s for s in equal if s.element_hash() not in states]
        if is_store(units[quantity.name]):
            found[quantity.name] = own
        elif len(own) == len(equal) and not _is_geared(quantity.symbol, equal, units[quantity.name], states, dae):
            found[quantity.name] = equal
    return found


def _is_geared(own: ca.SX, rates: Sequence[ca.SX], unit: str, states: Collection[int], dae: Dae) -> bool:
    """Whether a length or an angle changes with another state times a ratio, as a load behind a gear does."""
    if of_unit(unit) not in (of_unit("m"), of_unit("rad")):
        return False
    given = {s.element_hash() for s in ca.symvar(dae.knowns.parameters)}
    mine = {s.element_hash() for s in rates}
    for equation in dae.equations:
        free = [s for s in ca.symvar(equation.residual) if s.element_hash() not in given]
        if len(free) == 2 and len({s.element_hash() for s in free} & mine) == 1:
            other = next(s for s in free if s.element_hash() not in mine)
            slopes = ca.jacobian(equation.residual, ca.vertcat(*free))
            if (
                other.element_hash() in states
                and other.element_hash() != own.element_hash()
                and not ca.depends_on(slopes, ca.vertcat(*free))
            ):
                return True
    return False


def _names(equations: Sequence[Equation]) -> list[tuple[ca.SX, ca.SX]]:
    """Pairs of variables that an equation a = b says to be equal."""
    found = []
    for equation in equations:
        free = ca.symvar(equation.residual)
        if len(free) == 2 and _only_a_name(equation.residual, free):
            found.append((free[0], free[1]))
    return found


def _closure(first: ca.SX, names: Sequence[tuple[ca.SX, ca.SX]]) -> list[ca.SX]:
    """A variable and all that are equal to it."""
    found = {first.element_hash(): first}
    while True:
        more = {b.element_hash(): b for pair in names for a, b in (pair, pair[::-1]) if a.element_hash() in found}
        if more.keys() <= found.keys():
            return list(found.values())
        found |= more


def _only_a_name(residual: ca.SX, free: Sequence[ca.SX]) -> bool:
    slopes = ca.jacobian(residual, ca.vertcat(*free))
    if not slopes.is_constant() or slopes.nnz() != len(free):
        return False
    numbers = np.array(ca.DM(slopes)).ravel()
    at_zero = ca.substitute(residual, ca.vertcat(*free), ca.DM.zeros(len(free)))
    return bool(numbers.sum() == 0.0 and ca.simplify(at_zero).is_zero())


def _balance_rows(
    equations: Sequence[Equation], rates: Mapping[str, Sequence[ca.SX]], stored: Sequence[ca.SX]
) -> list[int]:
    """Equations that hold a rate and are not merely its name for another one; those of what is `stored` may be."""
    fills = {s.element_hash() for s in stored}
    if not rates:
        return []
    every = ca.vertcat(*(symbol for equal in rates.values() for symbol in equal))
    found = []
    for index, equation in enumerate(equations):
        if ca.depends_on(equation.residual, every):
            free = ca.symvar(equation.residual)
            is_name = len(free) == 2 and _only_a_name(equation.residual, free)
            if not is_name or any(s.element_hash() in fills for s in free):
                found.append(index)
    return found


def _assigned(
    residuals: Sequence[ca.SX], rates: Sequence[Sequence[ca.SX]], values: Mapping[int, float], likely: np.ndarray
) -> dict[int, tuple[int, float]]:
    """For each row the rate that it determines most, and the sign of its slope there, at the start values."""
    rows = ca.vertcat(*residuals)
    slopes = ca.horzcat(*(ca.sum2(ca.jacobian(rows, ca.vertcat(*equal))) for equal in rates))
    free = ca.symvar(slopes)
    numbers = [values.get(s.element_hash(), 0.0) for s in free]
    random = np.random.default_rng(1)
    if free:
        near = [n + NEAR * random.standard_normal() * (abs(n) or 1.0) for n in numbers]
        matrix = np.array(ca.Function("slopes", [ca.vertcat(*free)], [ca.densify(slopes)])(near))
    else:
        matrix = np.array(ca.DM(slopes))
    matrix = np.nan_to_num(matrix, posinf=0.0, neginf=0.0)
    scale = np.abs(matrix) / np.maximum(np.abs(matrix).max(axis=0, initial=0.0), 1e-300)
    pairs = zip(*(map(int, part) for part in scipy.optimize.linear_sum_assignment(-scale * likely)), strict=True)
    return {r: (c, float(np.sign(matrix[r, c]))) for r, c in pairs if matrix[r, c] != 0.0}


def _likely(dimension: Known, state_unit: str) -> float:
    """How likely an equation of a dimension is the balance of a state by its unit, from 0 to 1."""
    flow = _named(dimension)
    if flow in ("N", "N.m") and state_unit and of_unit(state_unit) in (of_unit("rad/s"), of_unit("m/s")):
        return 1.0 if (flow == "N.m") == (of_unit(state_unit) == of_unit("rad/s")) else FOREIGN
    return 1.0 if flow in _FLOWS else UNLIKELY


def _unit(dimension: Known, state_unit: str) -> str:
    """The unit of a balance's terms, as engineers write it; empty if it is not known."""
    if "rad" in state_unit and dimension == of_unit("N.m"):
        return "N.m"
    if dimension == of_unit("W") and of_unit(state_unit) == of_unit("Pa"):
        return "Pa.m3/s"  # gas at a pressure, no heat
    return _named(dimension) or (str(dimension) if isinstance(dimension, Dimension) else "")


def _named(dimension: Known) -> str:
    """The usual name of a dimension, empty without one."""
    return next((name for name in (*_FLOWS, *_RATES) if of_unit(name) == dimension), "")

"""Start values that satisfy the equations, the initial equations and what is declared as fixed."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import casadi as ca
import numpy as np

from fmus.errors import ModelicaError
from fmus.symbolic.dae import Dae, Equation, Quantity, column
from fmus.symbolic.explicit import solve_blocks
from fmus.symbolic.matching import Matching, rows_of
from fmus.symbolic.reduction import Reduced
from fmus.symbolic.solution import Unknown
from fmus.symbolic.structure import listed, place_of

# A fixed start value that follows from others may differ from them by this much, relative to its size.
CONSISTENT = 1e-9


@dataclass(frozen=True)
class Condition:
    """A start value as an equation."""

    quantity: Quantity
    residual: ca.SX


@dataclass(frozen=True)
class Initialization:
    """`consistent(t, u, p, s) -> x0` from proposed start values s of the states; None if these hold as they are."""

    consistent: ca.Function | None
    notes: tuple[str, ...]


def initialize(dae: Dae, reduced: Reduced, sources: ca.SX, defaults: Sequence[Sequence[float]]) -> Initialization:
    """Find out which start values hold, and solve for the others.

    Fixed start values and initial equations hold. If they leave freedom, start values that are not fixed hold too:
    those declared for variables under `der` first, then those of the remaining states, which a note tells.

    Args:
        dae: the model as it is written.
        reduced: the same with a choice of states.
        sources: what the delay operators give at the start.
        defaults: values of time, inputs, parameters and start values of the states, to check the result at.

    Raises:
        ModelicaError: if start conditions contradict each other, or leave something undetermined.
    """
    states = column([q.symbol for q in reduced.states])
    proposed = ca.SX.sym("start", len(reduced.states))
    rates = [q.derivative for q in reduced.states if q.derivative is not None]
    own = {int(s.element_hash()) for s in ca.symvar(states)}
    unknowns = [
        *(Unknown(q.symbol, proposed[i], q.nominal) for i, q in enumerate(reduced.states)),
        *(Unknown(q.symbol, q.guess, q.nominal) for q in reduced.algebraics),
        *(Unknown(s, ca.SX(0)) for s in [*rates, *reduced.hidden] if int(s.element_hash()) not in own),
    ]
    chosen = _Conditions(dae, reduced, proposed, [u.symbol for u in unknowns])
    conditions, redundant = chosen.choose()
    notes = _notes(chosen.assumed, redundant)
    at_states = {int(c.quantity.symbol.element_hash()) for c in conditions}
    if not dae.initial and not redundant and len(conditions) == len(reduced.states) and at_states == own:
        return Initialization(None, notes)
    equations = [*reduced.equations, *dae.initial, *(Equation(c.residual, c.quantity.place) for c in conditions)]
    if dae.knowns.delays.numel():
        equations = [Equation(ca.substitute(e.residual, dae.knowns.delays, sources), e.place) for e in equations]
    arguments = [dae.knowns.time, dae.knowns.inputs, dae.knowns.parameters, proposed]
    solution = solve_blocks(equations, unknowns, ca.vertcat(*arguments), "start")
    consistent = solution.function("consistent", arguments, [states])
    leftover = column([c.residual for c in redundant])
    check = solution.function("check", arguments, [states, leftover])
    _check(check, reduced, redundant, defaults)
    return Initialization(consistent, notes)


def with_guesses(quantities: Sequence[Quantity]) -> list[Quantity]:
    """Write start values that use parameters with `fixed=false` in terms of the guesses of these."""
    symbols = column([q.symbol for q in quantities])
    starts = column([ca.SX(0) if q.start is None else q.start for q in quantities])
    guesses = starts
    for _ in quantities:
        if not ca.depends_on(guesses, symbols):
            break
        guesses = ca.substitute(starts, symbols, guesses)
    return [replace(q, guess=guesses[i]) for i, q in enumerate(quantities)]


def _start(state: Quantity, proposed: ca.SX) -> ca.SX:
    """What a state starts with: the value that may be set from outside, unless it follows from other unknowns."""
    follows = state.start is not None and not ca.is_equal(state.start, state.guess, 100)
    return state.start if follows and state.start is not None else proposed


def _waits(quantity: Quantity, constant: set[int]) -> bool:
    return (
        quantity.fixed is False
        and quantity.derivative is not None
        and quantity.derivative.element_hash() not in constant
    )


class _Conditions:
    """Chooses as many start conditions as there is freedom."""

    def __init__(self, dae: Dae, reduced: Reduced, proposed: ca.SX, unknowns: list[ca.SX]) -> None:
        self.dae, self.unknowns = dae, unknowns
        self.assumed: list[Quantity] = []
        by_state = [Condition(q, q.symbol - _start(q, proposed[i])) for i, q in enumerate(reduced.states)]
        others = [Condition(q, q.symbol - (ca.SX(0) if q.start is None else q.start)) for q in reduced.algebraics]
        self.fixed = [c for c in (*by_state, *others) if c.quantity.fixed]
        loose = [c for c in (*by_state, *others) if c.quantity.fixed is None and c.quantity.derivative is not None]
        self.loose = [c for c in loose if c.quantity.start is not None]
        self.loose += [c for c in by_state if c.quantity.fixed is None and c.quantity.start is None]
        # What is written as fixed=false waits for others; where none is left, its start holds like any other, but for parameters.
        constant = {int(e.residual.element_hash()) for e in dae.equations if e.residual.is_symbolic()}
        self.loose += [c for c in by_state if c.quantity.start is not None and _waits(c.quantity, constant)]
        self.equations = [*reduced.equations, *dae.initial]
        residuals = [*(e.residual for e in self.equations), *(c.residual for c in (*self.fixed, *self.loose))]
        self.matching = Matching(rows_of(ca.jacobian_sparsity(column(residuals), column(unknowns))))

    def choose(self) -> tuple[list[Condition], list[Condition]]:
        """The conditions that hold, and the fixed ones that follow from others."""
        first_initial = len(self.equations) - len(self.dae.initial)
        for row in range(len(self.equations)):
            if not self.matching.add(row):
                self._refuse(row, first_initial)
        first = len(self.equations)
        conditions: list[Condition] = []
        redundant: list[Condition] = []
        for k, condition in enumerate(self.fixed):
            (conditions if self.matching.add(first + k) else redundant).append(condition)
        first += len(self.fixed)
        for k, condition in enumerate(self.loose):
            if self.matching.add(first + k):
                conditions.append(condition)
                self.assumed.append(condition.quantity)
        self._check_complete([*self.fixed, *self.loose])
        return conditions, redundant

    def _check_complete(self, given: Sequence[Condition]) -> None:
        free = {j for j in range(len(self.unknowns)) if j not in self.matching.row_of}
        if not free:
            return
        names = [self.unknowns[j].name() for j in sorted(self.matching.undetermined(free))]
        known = {condition.quantity.name for condition in given}
        possible = [name for name in names if name not in known and not name.startswith("der(")]
        raise ModelicaError(
            f"{len(free)} start condition{'s' if len(free) > 1 else ''} missing: nothing determines "
            f"{listed(possible or names)} at the start; add an initial equation, or a start value with fixed=true"
        )

    def _refuse(self, row: int, first_initial: int) -> None:
        rows, columns = self.matching.overdetermined(row)
        place = place_of([self.equations[row].place])
        initial = sorted({self.equations[k].place for k in rows if k >= first_initial} - {place})
        names = [name for name in (self.unknowns[j].name() for j in sorted(columns)) if not name.startswith("der(")]
        also = f" (with {listed(initial)})" if initial else ""
        raise ModelicaError(
            f"{place}: this initial equation is one too many{also}: {listed(names) or 'everything in it'} follows from "
            "the other equations already"
        )


def _notes(assumed: Sequence[Quantity], redundant: Sequence[Condition]) -> tuple[str, ...]:
    notes = []
    unclear = [q.name for q in assumed]
    if unclear:
        notes.append(f"start values taken as fixed: {listed(unclear)}; write fixed=true to confirm")
    if redundant:
        names = listed([c.quantity.name for c in redundant])
        notes.append(f"fixed start values that follow from others: {names}")
    return tuple(notes)


def _check(
    check: ca.Function, reduced: Reduced, redundant: Sequence[Condition], defaults: Sequence[Sequence[float]]
) -> None:
    values, leftover = (np.array(part).ravel() for part in check(*defaults))
    unsolved = [q for q, value in zip(reduced.states, values, strict=True) if not np.isfinite(value)]
    if unsolved:
        bare = [q.name for q in unsolved if q.start is None]
        begun = f"; the search began at 0, since no start is given for {listed(bare)}" if bare else ""
        raise ModelicaError(
            f"no start values of {listed([q.name for q in unsolved])} were found that satisfy the initial equations{begun}; "
            "give start values nearer to a solution"
        )
    for condition, rest in zip(redundant, leftover, strict=True):
        if not abs(rest) <= CONSISTENT * (1 + float(np.abs(values).max(initial=0.0))):
            place = condition.quantity.place
            raise ModelicaError(
                f"{place}: the fixed start value of {condition.quantity.name} contradicts the others by {rest:.6g}; "
                "fix one variable less"
            )

"""The unknowns of a DAE in terms of its knowns: explicit assignments, and blocks that a solver has to find."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import casadi as ca


@dataclass(frozen=True)
class Unknown:
    """A scalar unknown: its symbol, a first guess (an expression of parameters) and its size if declared."""

    symbol: ca.SX
    guess: ca.SX
    nominal: float | None = None


@dataclass(frozen=True)
class Stage:
    """Unknowns that are found together: `solver(guess, values) -> symbols`, NaN where there is no solution.

    `guess` and `values` are columns of expressions of the knowns and of the symbols of earlier stages.
    """

    symbols: ca.SX
    guess: ca.SX
    values: ca.SX
    solver: ca.Function
    place: str = ""


@dataclass(frozen=True)
class Divisor:
    """What some unknowns are divided by, and the size that its rounding is relative to."""

    names: str
    place: str
    value: ca.SX
    size: ca.SX


@dataclass
class Solution:
    """Assignments in the order of evaluation, and the stages between them."""

    unknowns: list[ca.SX] = field(default_factory=list)
    expressions: list[ca.SX] = field(default_factory=list)
    stages: list[Stage] = field(default_factory=list)
    divisors: list[Divisor] = field(default_factory=list)

    def assign(self, unknown: ca.SX, expression: ca.SX) -> None:
        """Add an assignment; the expression may use what was assigned or solved before."""
        self.unknowns.append(unknown)
        self.expressions.append(expression)

    def express(self, wanted: Sequence[ca.SX]) -> list[ca.SX]:
        """Write expressions in terms of the knowns and of the symbols of the stages."""
        if not self.unknowns or not wanted:
            return list(wanted)
        _, found = ca.substitute_inplace(self.unknowns, self.expressions, list(wanted), False)
        return list(found)

    def function(self, name: str, knowns: Sequence[ca.SX], wanted: Sequence[ca.SX]) -> ca.Function:
        """Make a function of columns of knowns; it is free of solvers where the wanted columns need none.

        Args:
            name: name of the function.
            knowns: columns of symbols.
            wanted: columns of expressions in them, and in what is solved for.
        """
        wanted = self.express(wanted)
        needed = self._needed(wanted)
        if not needed:
            return ca.Function(name, list(knowns), wanted)
        arguments = [ca.MX.sym(f"k{i}", *known.shape) for i, known in enumerate(knowns)]
        symbols: list[ca.SX] = []
        found: list[ca.MX] = []
        for i, stage in enumerate(needed):
            prepare = ca.Function(f"{name}_before{i}", [*knowns, *symbols], [stage.guess, stage.values])
            guess, values = prepare.call([*arguments, *found])
            found.append(stage.solver(guess, values))
            symbols.append(stage.symbols)
        last = ca.Function(f"{name}_after", [*knowns, *symbols], wanted)
        return ca.Function(name, arguments, last.call([*arguments, *found]))

    def _needed(self, wanted: Sequence[ca.SX]) -> list[Stage]:
        needed: list[Stage] = []
        target = ca.vertcat(*[ca.vec(ca.densify(w)) for w in wanted]) if wanted else ca.SX(0, 1)
        for stage in reversed(self.stages):
            if target.numel() and ca.depends_on(target, stage.symbols):
                needed.append(stage)
                target = ca.vertcat(target, stage.guess, stage.values)
        return needed[::-1]

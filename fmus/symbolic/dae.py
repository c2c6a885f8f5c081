"""A model as equations that are zero, before anything is solved."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import casadi as ca


@dataclass(frozen=True)
class Equation:
    """An expression that is zero, and where it is written (`file:line`, empty if the front end made it)."""

    residual: ca.SX
    place: str = ""


@dataclass(frozen=True)
class Quantity:
    """A scalar variable that the equations have to determine.

    `derivative` is its time derivative if that occurs in an equation. `start` is an expression of parameters (also of
    those that the start determines), None if none was declared; `guess` is the start in terms of known parameters, zero
    without one. `fixed` says whether it holds at the start, None where nothing was said. `select` is Modelica's StateSelect in lower case.
    """

    symbol: ca.SX
    derivative: ca.SX | None = None
    start: ca.SX | None = None
    fixed: bool | None = None
    nominal: float | None = None
    select: str = "default"
    place: str = ""
    guess: ca.SX = field(default_factory=lambda: ca.SX(0))

    @property
    def name(self) -> str:
        """Modelica name."""
        return str(self.symbol.name())


@dataclass(frozen=True)
class Knowns:
    """Columns that are given from outside, beside the states."""

    time: ca.SX
    inputs: ca.SX
    delays: ca.SX
    parameters: ca.SX


@dataclass(frozen=True)
class Dae:
    """Quantities and as many equations as they have unknowns; `initial` holds at the start only."""

    knowns: Knowns
    quantities: Sequence[Quantity]
    equations: Sequence[Equation]
    initial: Sequence[Equation] = ()


def column(items: Sequence[ca.SX]) -> ca.SX:
    """Stack scalars, also none of them."""
    return ca.vertcat(ca.SX(0, 1), *items)

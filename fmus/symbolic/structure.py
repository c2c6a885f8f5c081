"""What is wrong with the structure of a set of equations: which are too many, which unknowns are left, and no one solution."""

from collections.abc import Sequence

import casadi as ca
import numpy as np

from fmus.errors import ModelicaError
from fmus.symbolic.matching import Matching, rows_of
from fmus.symbolic.solution import Solution
from fmus.symbolic.system import Variable


def singular_message(incidence: ca.Sparsity, unknowns: Sequence[ca.SX], places: Sequence[str]) -> str:
    """Name the equations that contradict or repeat each other, and the unknowns that nothing determines.

    Args:
        incidence: pattern of equations by unknowns, of deficient structural rank.
        unknowns: symbols of the columns.
        places: where each equation is written.
    """
    matching = Matching(rows_of(incidence))
    idle = [row for row in range(incidence.size1()) if not matching.add(row)]
    free = [unknowns[j].name() for j in range(len(unknowns)) if j not in matching.row_of]
    parts = []
    if free:
        parts.append(f"no equation is left to determine {listed(free)}")
    for row in idle[:2]:
        rows, columns = matching.overdetermined(row)
        where = listed(sorted({places[i] for i in rows if places[i]}))
        names = listed([unknowns[j].name() for j in sorted(columns)])
        about = f"determine only {names}" if columns else "contain no unknown"
        parts.append(f"the equations at {where or 'generated places'} {about}")
    place = place_of([places[row] for row in idle])
    return (f"{place}: " if place else "") + "; ".join(parts)


def place_of(places: Sequence[str]) -> str:
    """The first place that is known."""
    return next((place for place in places if place), "")


def listed(names: Sequence[str], most: int = 6) -> str:
    """Join names for a message, the first few of many."""
    return ", ".join(names[:most]) + (f" and {len(names) - most} more" if len(names) > most else "")


# A determinant this small beside its terms is rounding.
ROUNDING = 1e-13
POINTS = 3


def check_divisors(solution: Solution, knowns: Sequence[ca.SX], defaults: Sequence[Sequence[float]]) -> None:
    """Refuse linear equations that are singular wherever the states and inputs are.

    Args:
        solution: of the model's equations.
        knowns: columns of time, states, inputs, delayed values, parameters.
        defaults: their values at the start; all but the parameters are varied at random around them.

    Raises:
        ModelicaError: naming the unknowns and the place of an equation.
    """
    if not solution.divisors:
        return
    wanted = [ca.vertcat(*[d.value for d in solution.divisors]), ca.vertcat(*[d.size for d in solution.divisors])]
    function = solution.function("divisors", knowns, wanted)
    random = np.random.default_rng(0)
    vanishes = np.ones(len(solution.divisors), dtype=bool)
    for point in range(1 + POINTS):
        spread = 0.0 if point == 0 else 1.0
        values = [np.array(v) + spread * random.standard_normal(len(v)) for v in defaults[:-1]]
        value, size = (np.array(part).ravel() for part in function(*values, list(defaults[-1])))
        vanishes &= np.abs(value) <= ROUNDING * size
    for divisor, zero in zip(solution.divisors, vanishes, strict=True):
        if zero:
            place = f"{divisor.place}: " if divisor.place else ""
            raise ModelicaError(
                f"{place}the equations for {divisor.names} have no unique solution with the declared parameters: what "
                "they are divided by is zero; check parameters that are 0"
            )


def starts_of(variables: Sequence[Variable]) -> list[float]:
    """Start values, zero where none is known."""
    return [v.start or 0.0 for v in variables]

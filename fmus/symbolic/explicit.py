"""Solve the residual equations of a DAE for its unknowns, block by block."""

from collections.abc import Sequence

import casadi as ca

from fmus.errors import ModelicaError
from fmus.symbolic.conditions import decides
from fmus.symbolic.dae import Equation
from fmus.symbolic.linear import MOST_BY_DETERMINANT, by_determinants, determinant, eliminate, magnitude, names_of
from fmus.symbolic.newton import linear_stage, nonlinear_stage
from fmus.symbolic.solution import Divisor, Solution, Unknown
from fmus.symbolic.structure import place_of, singular_message


def solve_blocks(
    equations: Sequence[Equation],
    unknowns: Sequence[Unknown],
    knowns: ca.SX,
    name: str = "block",
    *,
    refinements: int = 0,
) -> Solution:
    """Express each unknown in terms of the known symbols (states, inputs, parameters, time).

    The equations are put into block-triangular form of their incidence. Blocks that are linear in their own unknowns
    are solved by elimination with constant pivots; what is left of them by determinants, or at run time if it is
    large. Other blocks become stages that Newton's method solves.

    Args:
        equations: as many as unknowns.
        unknowns: with their guesses in terms of `knowns`.
        knowns: column of all other symbols.
        name: prefix of the names of the solvers, a C identifier.
        refinements: how often the solution of linear equations is improved by solving for what is left of them.

    Raises:
        ModelicaError: if counts differ or the system is structurally singular.
    """
    symbols = [u.symbol for u in unknowns]
    if len(equations) != len(unknowns):
        raise ModelicaError(f"{len(equations)} equations for {len(unknowns)} unknowns; the model is not balanced")
    solution = Solution()
    if not unknowns:
        return solution
    column = ca.vertcat(*[e.residual for e in equations])
    incidence = ca.jacobian_sparsity(column, ca.vertcat(*symbols))
    if ca.sprank(incidence) < len(unknowns):
        raise ModelicaError(singular_message(incidence, symbols, [e.place for e in equations]))
    count, rows, columns, row_ends, column_ends, _, _ = incidence.btf()
    known = [knowns]
    for block in range(count):
        chosen = [equations[i] for i in rows[row_ends[block] : row_ends[block + 1]]]
        sought = [unknowns[j] for j in columns[column_ends[block] : column_ends[block + 1]]]
        _solve_block(solution, chosen, sought, known, f"{name}{len(solution.stages)}", refinements)
    return solution


def _solve_block(
    solution: Solution,
    equations: list[Equation],
    unknowns: list[Unknown],
    known: list[ca.SX],
    name: str,
    refinements: int,
) -> None:
    symbols = [u.symbol for u in unknowns]
    residuals, column = ca.vertcat(*[e.residual for e in equations]), ca.vertcat(*symbols)
    place = place_of([e.place for e in equations])
    matrix = ca.jacobian(residuals, column)
    if ca.depends_on(matrix, column) or decides(residuals, column):
        [residuals] = solution.express([residuals])
        solution.stages.append(nonlinear_stage(name, residuals, unknowns, ca.vertcat(*known), place))
        known.append(column)
        return
    right = -ca.substitute(residuals, column, ca.DM.zeros(len(unknowns)))
    elimination = eliminate(matrix, right)
    rest, rest_right = elimination.square()
    _, left_over = elimination.left_over
    remaining = [unknowns[j] for j in left_over]
    if len(remaining) <= MOST_BY_DETERMINANT:
        values = by_determinants(rest, rest_right) if remaining else []
        if remaining:
            solution.divisors.append(Divisor(names_of(symbols), place, determinant(rest), magnitude(rest)))
    else:
        rest, rest_right = solution.express([rest, rest_right])
        solution.stages.append(linear_stage(name, rest, rest_right, remaining, place))
        known.append(ca.vertcat(*[u.symbol for u in remaining]))
        values = [u.symbol for u in remaining]
    found = elimination.back(dict(zip(left_over, values, strict=True)))
    if len(unknowns) > 1 and len(remaining) <= MOST_BY_DETERMINANT:
        for _ in range(refinements):
            # Rounding of the residual must not be cancelled symbolically, so the solution gets symbols of its own.
            before = [ca.SX.sym(f"{u.symbol.name()} before") for u in unknowns]
            for symbol, value in zip(before, found, strict=True):
                solution.assign(symbol, value)
            change = _eliminated(matrix, right - ca.mtimes(matrix, ca.vertcat(*before)))
            found = [b + c for b, c in zip(before, change, strict=True)]
    for j, value in enumerate(found):
        if not value.is_symbolic() or not ca.is_equal(value, symbols[j]):
            solution.assign(symbols[j], value)


def _eliminated(matrix: ca.SX, right: ca.SX) -> list[ca.SX]:
    elimination = eliminate(matrix, right)
    rest, rest_right = elimination.square()
    _, left_over = elimination.left_over
    values = by_determinants(rest, rest_right) if left_over else []
    return elimination.back(dict(zip(left_over, values, strict=True)))

"""Nonlinear equations with fewer unknowns: what one equation gives at once needs no guess, and no iteration."""

from collections.abc import Sequence
from dataclasses import dataclass

import casadi as ca

from fmus.symbolic.conditions import decides
from fmus.symbolic.solution import Unknown


@dataclass(frozen=True)
class Torn:
    """What is left to solve, and what follows: the last assignment depends on what is left only, those before on later ones, too."""

    equations: list[ca.SX]
    unknowns: list[Unknown]
    assignments: list[tuple[ca.SX, ca.SX]]


def tear(equations: Sequence[ca.SX], unknowns: Sequence[Unknown]) -> Torn:
    """Take out unknowns without a start value in which some equation is linear, with a number as coefficient.

    Args:
        equations: expressions that become zero, as many as unknowns.
        unknowns: with their guesses; those with one other than zero, or with a nominal value, stay.
    """
    rest, left = list(equations), list(unknowns)
    assignments: list[tuple[ca.SX, ca.SX]] = []
    while len(left) > 1:
        found = _assignment(rest, left)
        if found is None:
            break
        row, position, value = found
        symbol = left.pop(position).symbol
        del rest[row]
        rest = ca.vertsplit(ca.substitute(ca.vertcat(*rest), symbol, value))
        assignments.append((symbol, value))
    return Torn(rest, left, assignments)


def _assignment(equations: Sequence[ca.SX], unknowns: Sequence[Unknown]) -> tuple[int, int, ca.SX] | None:
    """Equation and unknown by position, and what the unknown is; of the equations the one with the fewest unknowns."""
    symbols = ca.vertcat(*[u.symbol for u in unknowns])
    loose = {k for k, u in enumerate(unknowns) if u.guess.is_zero() and not u.nominal}
    matrix = ca.jacobian(ca.vertcat(*equations), symbols)
    rows, columns = matrix.sparsity().get_triplet()
    entries = [
        (rows.count(i), i, j, float(value))
        for i, j, value in zip(rows, columns, ca.vertsplit(matrix.nz[:]), strict=True)
        if j in loose and value.is_constant() and not value.is_zero()
    ]
    for _, row, position, factor in sorted(entries):
        symbol = unknowns[position].symbol
        if not decides(equations[row], symbol):
            return row, position, ca.simplify(-ca.substitute(equations[row], symbol, ca.SX(0)) / factor)
    return None

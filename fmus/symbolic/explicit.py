"""Solve the residual equations of a DAE for its unknowns, block by block."""

from collections.abc import Sequence

import casadi as ca
import numpy as np

from fmus.errors import ModelicaError


def solve_blocks(residuals: Sequence[ca.SX], unknowns: Sequence[ca.SX], places: Sequence[str]) -> list[ca.SX]:
    """Express each unknown in terms of the other symbols (states, inputs, parameters, time).

    The equations are put into block-triangular form of their incidence; each block must be linear in its own
    unknowns and is solved by elimination, constant pivots first.

    Args:
        residuals: expressions that are zero.
        unknowns: scalar symbols, as many as there are equations.
        places: source position of each equation, for messages.

    Raises:
        ModelicaError: if counts differ, the system is structurally singular or a block is nonlinear.
    """
    if len(residuals) != len(unknowns):
        raise ModelicaError(f"{len(residuals)} equations for {len(unknowns)} unknowns; the model is not balanced")
    if not unknowns:
        return []
    equations, symbols = ca.vertcat(*residuals), ca.vertcat(*unknowns)
    incidence = ca.jacobian_sparsity(equations, symbols)
    if ca.sprank(incidence) < len(unknowns):
        raise ModelicaError(_singular_message(incidence, unknowns, places))
    count, rows, columns, row_ends, column_ends, _, _ = incidence.btf()
    order, solutions = [], []
    for block in range(count):
        block_rows = rows[row_ends[block] : row_ends[block + 1]]
        block_columns = columns[column_ends[block] : column_ends[block + 1]]
        order.extend(block_columns)
        solutions.extend(
            _solve_block(
                [residuals[i] for i in block_rows],
                [unknowns[j] for j in block_columns],
                [places[i] for i in block_rows],
            )
        )
    ordered = [unknowns[j] for j in order]
    solved, _ = ca.substitute_inplace(ordered, solutions, [ca.SX(0)], False)
    by_column = dict(zip(order, solved, strict=True))
    return [by_column[j] for j in range(len(unknowns))]


def _solve_block(residuals: list[ca.SX], unknowns: list[ca.SX], places: list[str]) -> list[ca.SX]:
    equations, symbols = ca.vertcat(*residuals), ca.vertcat(*unknowns)
    matrix = ca.jacobian(equations, symbols)
    if ca.depends_on(matrix, symbols):
        names = ", ".join(u.name() for u in unknowns[:4])
        raise ModelicaError(f"{_at(places)}nonlinear equations for {names} are not supported; solve them by hand")
    right = -ca.substitute(equations, symbols, ca.DM.zeros(len(unknowns)))
    n = len(unknowns)
    rows: list[dict[int, ca.SX]] = [
        {j: matrix[i, j] for j in range(n) if matrix.sparsity().has_nz(i, j)} for i in range(n)
    ]
    return _eliminate(rows, [right[i] for i in range(n)], places)


def _eliminate(rows: list[dict[int, ca.SX]], right: list[ca.SX], places: list[str]) -> list[ca.SX]:
    """Gauss elimination of a small sparse symbolic system; constant pivots in short rows come first."""
    open_rows, pivots = set(range(len(rows))), []
    while open_rows:
        choices = [
            (not value.is_constant(), len(rows[i]), i, j)
            for i in open_rows
            for j, value in rows[i].items()
            if not value.is_zero()
        ]
        if not choices:
            raise ModelicaError(f"{_at(places)}the equations are singular")
        _, _, i, j = min(choices)
        open_rows.remove(i)
        pivots.append((i, j))
        for k in open_rows:
            factor = rows[k].pop(j, None)
            if factor is None:
                continue
            factor = factor / rows[i][j]
            for column, value in rows[i].items():
                if column != j:
                    rows[k][column] = rows[k].get(column, ca.SX(0)) - factor * value
            right[k] = right[k] - factor * right[i]
    solution: dict[int, ca.SX] = {}
    for i, j in reversed(pivots):
        rest = sum((value * solution[c] for c, value in rows[i].items() if c != j), ca.SX(0))
        solution[j] = (right[i] - rest) / rows[i][j]
    return [solution[j] for j in range(len(rows))]


def _singular_message(incidence: ca.Sparsity, unknowns: Sequence[ca.SX], places: Sequence[str]) -> str:
    pattern = np.array(ca.DM(incidence, 1).full(), dtype=bool)
    free = [unknowns[j].name() for j in range(len(unknowns)) if not pattern[:, j].any()]
    if free:
        return f"no equation determines {', '.join(free[:4])}"
    idle = [places[i] for i in range(len(places)) if not pattern[i].any()]
    if idle:
        return f"{_at(idle)}an equation contains no unknown; rigidly coupled states are not supported"
    return "the equations are structurally singular; rigidly coupled states (index reduction) are not supported"


def _at(places: Sequence[str]) -> str:
    known = [place for place in places if place]
    return f"{known[0]}: " if known else ""

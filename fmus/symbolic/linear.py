"""Linear equations with symbolic coefficients: elimination by pivots that cannot vanish, then determinants."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import casadi as ca

# Up to this size a determinant costs no more than elimination, and divides by nothing that a parameter may make zero.
MOST_BY_DETERMINANT = 3


@dataclass
class Elimination:
    """The steps of a Gauss elimination: pivots (row, column) in order, and the rest of the rows."""

    rows: list[dict[int, ca.SX]]
    right: list[ca.SX]
    pivots: list[tuple[int, int]] = field(default_factory=list)

    def back(self, solution: dict[int, ca.SX]) -> list[ca.SX]:
        """Complete the solution of the columns that were left over."""
        for i, j in reversed(self.pivots):
            rest = sum((value * solution[c] for c, value in self.rows[i].items() if c != j), ca.SX(0))
            solution[j] = (self.right[i] - rest) / self.rows[i][j]
        return [solution[j] for j in range(len(self.rows))]

    @property
    def left_over(self) -> tuple[list[int], list[int]]:
        """Rows and columns without a constant pivot."""
        done_rows, done_columns = {i for i, _ in self.pivots}, {j for _, j in self.pivots}
        everything = range(len(self.rows))
        return [i for i in everything if i not in done_rows], [j for j in everything if j not in done_columns]

    def square(self) -> tuple[ca.SX, ca.SX]:
        """Matrix and right side of what is left over."""
        rows, columns = self.left_over
        matrix = ca.SX(len(rows), len(columns))
        for k, i in enumerate(rows):
            for m, j in enumerate(columns):
                value = self.rows[i].get(j)
                if value is not None and not value.is_zero():
                    matrix[k, m] = value
        return matrix, ca.vertcat(ca.SX(0, 1), *[self.right[i] for i in rows])


def eliminate(matrix: ca.SX, right: ca.SX) -> Elimination:
    """Eliminate with constant pivots only, those of short rows first."""
    n = matrix.shape[0]
    rows: list[dict[int, ca.SX]] = [{} for _ in range(n)]
    for k, (i, j) in enumerate(zip(*matrix.sparsity().get_triplet(), strict=True)):
        rows[i][j] = matrix.nz[k]
    state = Elimination(rows, [right[i] for i in range(n)])
    open_rows = set(range(n))
    while open_rows:
        choices = [
            (len(rows[i]), i, j)
            for i in open_rows
            for j, value in rows[i].items()
            if value.is_constant() and not value.is_zero()
        ]
        if not choices:
            break
        _, i, j = min(choices)
        open_rows.remove(i)
        state.pivots.append((i, j))
        for k in open_rows:
            factor = rows[k].pop(j, None)
            if factor is None:
                continue
            factor = factor / rows[i][j]
            for column, value in rows[i].items():
                if column != j:
                    rows[k][column] = rows[k].get(column, ca.SX(0)) - factor * value
            state.right[k] = state.right[k] - factor * state.right[i]
    return state


def by_determinants(matrix: ca.SX, right: ca.SX) -> list[ca.SX]:
    """Cramer's rule, for up to `MOST_BY_DETERMINANT` unknowns."""
    n = matrix.shape[0]
    if n == 1:
        return [right[0] / matrix[0, 0]]
    whole = determinant(matrix)
    found = []
    for j in range(n):
        replaced = ca.SX(matrix)
        replaced[:, j] = right
        found.append(determinant(replaced) / whole)
    return found


def determinant(matrix: ca.SX) -> ca.SX:
    """Determinant by expansion along the first row; meant for small matrices."""
    return _expansion(matrix, lambda entry, column: (-1) ** column * entry)


def magnitude(matrix: ca.SX) -> ca.SX:
    """The determinant with all its terms positive: what rounding of the determinant is relative to."""
    return _expansion(matrix, lambda entry, column: ca.fabs(entry))


def _expansion(matrix: ca.SX, weight: Callable[[ca.SX, int], ca.SX]) -> ca.SX:
    """Sum over the first row of the weight of each entry times the same expansion of what is left without it."""
    n = matrix.shape[0]
    if n == 0:
        return ca.SX(1)
    total = ca.SX(0)
    for j in range(n):
        if matrix.sparsity().has_nz(0, j):
            others = [k for k in range(n) if k != j]
            total += weight(matrix[0, j], j) * _expansion(matrix[1:, others] if others else ca.SX(0, 0), weight)
    return total


def names_of(symbols: Sequence[ca.SX], most: int = 4) -> str:
    """Names for a message, the first few of many."""
    names = [symbol.name() for symbol in symbols]
    return ", ".join(names[:most]) + (f" and {len(names) - most} more" if len(names) > most else "")

"""Assign equations to unknowns so that each equation can determine one."""

from collections.abc import Callable

import casadi as ca


class Matching:
    """A matching that grows row by row; rows added first keep a place."""

    def __init__(self, incidence: ca.Sparsity) -> None:
        self.columns_of: list[list[int]] = [[] for _ in range(incidence.size1())]
        for row, column in zip(*incidence.get_triplet(), strict=True):
            self.columns_of[row].append(column)
        self.row_of: dict[int, int] = {}

    def add(self, row: int, allowed: Callable[[int], bool] = lambda column: True) -> bool:
        """Give a row a column, moving other rows if need be; False if there is none for it."""
        return self._augment(row, set(), allowed)

    def _augment(self, row: int, seen: set[int], allowed: Callable[[int], bool]) -> bool:
        # Iterative depth-first search: chains of connected components are longer than Python's stack.
        path = [(row, iter(self.columns_of[row]))]
        taken: list[int] = []
        while path:
            current, columns = path[-1]
            column = next((c for c in columns if c not in seen and allowed(c)), None)
            if column is None:
                path.pop()
                if taken:
                    taken.pop()
                continue
            seen.add(column)
            taken.append(column)
            owner = self.row_of.get(column)
            if owner is None:
                for (r, _), c in zip(path, taken, strict=True):
                    self.row_of[c] = r
                return True
            path.append((owner, iter(self.columns_of[owner])))
        return False

    def overdetermined(self, row: int) -> tuple[set[int], set[int]]:
        """Rows that share too few columns with a row that found none, and these columns."""
        rows, columns, open_rows = {row}, set[int](), [row]
        while open_rows:
            for column in self.columns_of[open_rows.pop()]:
                if column not in columns:
                    columns.add(column)
                    owner = self.row_of.get(column)
                    if owner is not None and owner not in rows:
                        rows.add(owner)
                        open_rows.append(owner)
        return rows, columns

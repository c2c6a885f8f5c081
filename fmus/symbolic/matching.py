"""Assign equations to unknowns so that each equation can determine one."""

from collections.abc import Callable, Iterable

import casadi as ca


def anything(column: int) -> bool:
    """Allow every column."""
    return True


class Matching:
    """A matching that grows row by row; rows added first keep a place."""

    def __init__(self, columns_of: Iterable[Iterable[int]] = ()) -> None:
        self.columns_of = [list(columns) for columns in columns_of]
        self.row_of: dict[int, int] = {}

    def add(self, row: int, allowed: Callable[[int], bool] = anything) -> bool:
        """Give a row a column, moving other rows if need be; False if there is none for it."""
        # Depth first without recursion: chains of connected components are longer than Python's stack.
        seen: set[int] = set()
        path = [(row, iter(self.columns_of[row]))]
        taken: list[int] = []
        while path:
            column = next((c for c in path[-1][1] if c not in seen and allowed(c)), None)
            if column is None:
                path.pop()
                if taken:
                    taken.pop()
                continue
            seen.add(column)
            taken.append(column)
            owner = self.row_of.get(column)
            if owner is None:
                for (mover, _), chosen in zip(path, taken, strict=True):
                    self.row_of[chosen] = mover
                return True
            path.append((owner, iter(self.columns_of[owner])))
        return False

    def overdetermined(self, row: int, allowed: Callable[[int], bool] = anything) -> tuple[set[int], set[int]]:
        """Rows that share too few columns with a row that found none, and these columns."""
        rows, columns, open_rows = {row}, set[int](), [row]
        while open_rows:
            for column in self.columns_of[open_rows.pop()]:
                if column not in columns and allowed(column):
                    columns.add(column)
                    owner = self.row_of.get(column)
                    if owner is not None and owner not in rows:
                        rows.add(owner)
                        open_rows.append(owner)
        return rows, columns

    def undetermined(self, free: Iterable[int]) -> set[int]:
        """Columns that could be left over instead of those that are."""
        rows_with: dict[int, list[int]] = {}
        for row in self.row_of.values():
            for column in self.columns_of[row]:
                rows_with.setdefault(column, []).append(row)
        column_of = {row: column for column, row in self.row_of.items()}
        columns, open_columns = set(free), list(free)
        while open_columns:
            for row in rows_with.get(open_columns.pop(), []):
                if column_of[row] not in columns:
                    columns.add(column_of[row])
                    open_columns.append(column_of[row])
        return columns


def rows_of(pattern: ca.Sparsity) -> list[list[int]]:
    """The columns of each row of a pattern."""
    rows: list[list[int]] = [[] for _ in range(pattern.size1())]
    for row, column in zip(*pattern.get_triplet(), strict=True):
        rows[row].append(column)
    return rows

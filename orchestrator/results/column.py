"""Columns of a result: their names, units and types, and which of them are wanted."""

from collections.abc import Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from fnmatch import fnmatchcase

from fmus.errors import MisfitError

INTEGER_KINDS = ("Int8", "UInt8", "Int16", "UInt16", "Int32", "UInt32", "Int64", "UInt64", "Enumeration")


@dataclass(frozen=True)
class Column:
    """A recorded variable, `component.variable` or `component.variable[i]`; time is no column.

    `kind` is the type's name in FMI 3 (Float64, Int32, Boolean, Enumeration, ...). Values travel as float64 and get
    the type of their kind in files that have types.
    """

    name: str
    unit: str = ""
    kind: str = "Float64"
    description: str = ""

    @property
    def stored_as(self) -> str:
        """Type in files: float64, int64 or bool; half of the numbers of UInt64 are beyond int64."""
        if self.kind == "Boolean":
            return "bool"
        return "int64" if self.kind in INTEGER_KINDS and self.kind != "UInt64" else "float64"


def chosen(columns: Sequence[Column], patterns: Sequence[str]) -> list[int]:
    """Positions of the columns that any of the patterns matches, in their order; all without patterns.

    A pattern is a name, where `*` stands for any characters and `?` for one. Brackets mean themselves, since arrays have
    them: `arm.q[1]`, `arm.q*`.

    Raises:
        MisfitError: if a pattern matches nothing.

    Example:
        >>> chosen([Column("mass.x"), Column("mass.v"), Column("spring.F2")], ["mass.*"])
        [0, 1]
    """
    if not patterns:
        return list(range(len(columns)))
    names = [column.name for column in columns]
    found: set[int] = set()
    for pattern in patterns:
        escaped = pattern.replace("[", "[[]")
        matching = {k for k, name in enumerate(names) if fnmatchcase(name, escaped)}
        if not matching:
            near = get_close_matches(pattern, names, n=3) or names[:5]
            raise MisfitError(f"--record {pattern} matches no variable; there are, for example, {', '.join(near)}")
        found |= matching
    return sorted(found)

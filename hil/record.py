"""Values that are made anew in every cycle: plain classes, which compiled code makes in a fraction of the time of a named
tuple or a dataclass. Nobody changes one that somebody else has.
"""

import math
from typing import Any, TypeVar


def is_finite(value: float) -> bool:
    """Whether it is a number; compiled, these two are machine instructions, and `math.isfinite` is none."""
    return not (math.isnan(value) or math.isinf(value))


class Record:
    """Named values: two are equal if all their values are."""

    def __eq__(self, other: object) -> bool:
        """Whether the other is of the same kind, with the same values."""
        return type(other) is type(self) and values_of(other) == values_of(self)

    def __hash__(self) -> int:
        """By the values, so that equal ones have equal hashes."""
        return hash(tuple(values_of(self).values()))

    def __repr__(self) -> str:
        """All values by name."""
        return f"{type(self).__name__}({', '.join(f'{name}={value!r}' for name, value in values_of(self).items())})"


def values_of(record: object) -> dict[str, Any]:
    """The values of a record by name; compiled classes list their names and have no dictionary."""
    names = getattr(type(record), "__mypyc_attrs__", None)
    return dict(vars(record)) if names is None else {name: getattr(record, name) for name in names}


_Kind = TypeVar("_Kind", bound=Record)


def replaced(record: _Kind, **changes: Any) -> _Kind:
    """A new record with other values of some names.

    Raises:
        TypeError: if it has no value of such a name.
    """
    return type(record)(**{**values_of(record), **changes})

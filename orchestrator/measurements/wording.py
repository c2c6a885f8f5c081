"""How names and values from a user's file appear in a one-line message."""

from collections.abc import Iterable

_LONGEST_VALUE = 60
_MOST_NAMES = 15


def shown(value: object) -> str:
    r"""Quote a value from a file so that it stays on one line and short.

    Example:
        >>> shown("two\nlines")
        "'two\\nlines'"
    """
    text = repr(value)
    if len(text) <= _LONGEST_VALUE:
        return text
    return text[: _LONGEST_VALUE - 3] + "..."


def listed(names: Iterable[str]) -> str:
    """Quote names in a row; a long row is cut and says how many are missing.

    Example:
        >>> listed(["time", "q1"])
        "'time', 'q1'"
    """
    every = list(names)
    text = ", ".join(shown(name) for name in every[:_MOST_NAMES])
    if len(every) > _MOST_NAMES:
        text += f" and {len(every) - _MOST_NAMES} more"
    return text or "none"

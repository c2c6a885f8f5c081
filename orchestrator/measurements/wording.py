"""How names and values from a user's file appear in a one-line message, and which name was probably meant."""

from collections.abc import Iterable
from difflib import get_close_matches
from itertools import islice

_LONGEST_VALUE = 60
_MOST_NAMES = 15
# Comparing with each of 100,000 names takes seconds.
_MOST_COMPARED = 5000


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


def counted(number: int, word: str) -> str:
    """A number of things.

    Example:
        >>> counted(1, "sample"), counted(3, "row")
        ('1 sample', '3 rows')
    """
    return f"{number} {word}{'' if number == 1 else 's'}"


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


def nearest(name: str, known: Iterable[str]) -> str:
    """Say which known name was probably meant, or list the known ones.

    Example:
        >>> nearest("sping", ["spring", "mass"])
        "did you mean 'spring'?"
        >>> nearest("x", ["spring", "mass"])
        "there are 'spring', 'mass'"
    """
    names = list(islice(known, _MOST_COMPARED))
    near = get_close_matches(name, names, n=1) or [n for n in names if n.lower() == name.lower()]
    if near:
        return f"did you mean {near[0]!r}?"
    return f"there are {listed(names)}" if names else "there is none"

"""How names that are not there are answered: with the nearest one that is."""

from collections.abc import Iterable
from difflib import get_close_matches
from itertools import islice

from orchestrator.measurements.wording import listed

# Comparing with each of 100,000 names takes seconds.
_MOST_COMPARED = 5000


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

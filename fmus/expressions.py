"""Expressions as Python reads them, one thread at a time."""

import ast
import threading
from functools import lru_cache

# Before 3.11.8 Python counts how deep all threads are in `ast.parse` together, and raises SystemError where the count is off (gh-106905).
_ONE_AT_A_TIME = threading.Lock()


@lru_cache(maxsize=4096)
def parsed_expression(text: str) -> ast.Expression:
    """The syntax tree of an expression; it is shared, so nobody may change it.

    Raises:
        SyntaxError: for what is no expression.
        ValueError: for a text with null characters.
    """
    with _ONE_AT_A_TIME:
        return ast.parse(text, mode="eval")

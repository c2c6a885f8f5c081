"""Names in Modelica text: which it uses, and the same text with others."""

import re
from collections.abc import Callable, Mapping

from fmus.frontend.lint.tokens import Token, tokens_of
from fmus.frontend.lint.tree import ClassDef, Span

_PART = re.compile(r"\[[^\]]*\]")


def references(text: str) -> list[tuple[int, int, str]]:
    """Each dotted name in an expression with its first and last character; what is called is left out."""
    tokens, found, at = tokens_of(text, "expression"), [], 0
    while tokens[at].kind != "end":
        first = at
        if tokens[at].kind != "name":
            at += 1
            continue
        at = _end_of_reference(tokens, at)
        if tokens[at].text != "(":
            found.append((tokens[first].start, tokens[at - 1].end, text[tokens[first].start : tokens[at - 1].end]))
    return found


def _end_of_reference(tokens: list[Token], at: int) -> int:
    """Position behind `a.b[1].c`."""
    at += 1
    while tokens[at].text in (".", "["):
        if tokens[at].text == ".":
            at += 2
            continue
        depth = 0
        while True:
            depth += (tokens[at].text == "[") - (tokens[at].text == "]")
            at += 1
            if depth == 0:
                break
    return at


def replaced(text: str, change: Callable[[str], str]) -> str:
    """An expression with each name changed."""
    for first, last, name in reversed(references(text)):
        text = text[:first] + change(name) + text[last:]
    return text


def renamed(text: str, names: Mapping[str, str]) -> str:
    """An expression with other variables: `{"x": "xActual"}` turns `x[1]` into `xActual[1]`."""

    def change(name: str) -> str:
        head = re.split(r"[.\[]", name, maxsplit=1)[0]
        return names[head] + name[len(head) :] if head in names else name

    return replaced(text, change)


def heads(text: str) -> set[str]:
    """The names of an expression without subscripts of their last part: `rooms[2].T`, `x`."""
    return {re.sub(r"\[[^\]]*\]$", "", name.replace(" ", "")) for _, _, name in references(text)}


def uses(text: str, definition: ClassDef, name: str, own: Span | None) -> list[tuple[Span, str]]:
    """Where a class uses one of its variables, and the text of the connect equation around it, if it is one.

    Args:
        text: the file.
        definition: the class.
        name: the variable.
        own: its declaration in this class, which is no use; None if it is inherited.
    """
    skipped = [nested.span for nested in definition.classes.values()] + ([own] if own is not None else [])
    found: list[tuple[Span, str]] = []
    first, last = definition.header, definition.span[1]
    depth, previous = 0, ""
    tokens = [t for t in tokens_of(text, definition.file) if first <= t.start < last]
    for k, token in enumerate(tokens):
        depth += (token.text == "(") - (token.text == ")")
        is_part, previous = previous == ".", token.text
        if token.kind != "name" or token.text != name or is_part or any(a <= token.start < b for a, b in skipped):
            continue
        following = tokens[k + 1].text if k + 1 < len(tokens) else ""
        # A modifier, or the name of an argument of a function.
        if following == "(" or (depth and following == "="):
            continue
        found.append(((token.start, token.end), _connect_around(tokens, k)))
    return found


def _connect_around(tokens: list[Token], k: int) -> str:
    while k >= 0 and tokens[k].text not in (";", "connect"):
        k -= 1
    return "connect" if k >= 0 and tokens[k].text == "connect" else ""


def plain(name: str) -> str:
    """A flat name without subscripts."""
    return _PART.sub("", name)


def position(name: str) -> tuple[int, ...]:
    """Subscripts of the last part of a flat name, from 0; empty for a scalar."""
    found = re.search(r"\[([\d,\s]+)\]$", name)
    return tuple(int(k) - 1 for k in found.group(1).split(",")) if found else ()

"""Modelica text with what is no code blanked out, and where its declarations and equations are."""

import re
from collections.abc import Iterator
from dataclasses import dataclass

_NO_CODE = re.compile(r'"(?:[^"\\]|\\.)*"|//[^\n]*|/\*.*?\*/', re.DOTALL)
_SECTION = re.compile(r"\s*(initial equation|equation|algorithm|protected|public)\b")


@dataclass(frozen=True)
class Line:
    """One line: its number from 0, its text with strings and comments blanked, and whether it holds equations."""

    number: int
    code: str
    is_equation: bool


def lines_of(text: str) -> Iterator[Line]:
    """Yield the lines that say what a class does: declarations and equations, without imports and annotations."""
    blanked = _NO_CODE.sub(lambda found: re.sub(r"[^\n]", " ", found.group()), text)
    is_equation = False
    for number, code in enumerate(blanked.splitlines()):
        if code.lstrip().startswith("annotation"):
            is_equation = False
            continue
        section = _SECTION.match(code)
        if section:
            is_equation = section.group(1) in ("equation", "algorithm", "initial equation")
        elif not re.match(r"\s*(within|import|end|model|package|function|partial)\b", code):
            yield Line(number, code, is_equation)


def end_of_term(code: str, start: int) -> int:
    """Return where the term that begins at `start` ends: at the next +, -, comma, bracket or keyword of its own level."""
    depth = 0
    for k in range(start, len(code)):
        c = code[k]
        if c in "([{":
            depth += 1
        elif c in ")]}":
            depth -= 1
            if depth < 0:
                return k
        elif depth == 0 and (c in ",;=<>" or (c in "+-" and k > start) or re.match(r"\s(then|else|loop)\b", code[k:])):
            return k
    return len(code)


def arguments_of(code: str, bracket: int) -> tuple[list[str], int]:
    """Return the arguments of a call whose bracket opens at `bracket`, and where it closes; none where it does not."""
    depth, begin, found = 0, bracket + 1, []
    for k in range(bracket, len(code)):
        if code[k] in "([{":
            depth += 1
        elif code[k] in ")]}":
            depth -= 1
            if depth == 0:
                return [*found, code[begin:k]], k
        elif code[k] == "," and depth == 1:
            found.append(code[begin:k])
            begin = k + 1
    return [], len(code)

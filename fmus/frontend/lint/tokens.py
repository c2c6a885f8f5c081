"""Modelica text as tokens with their lines."""

import re
from dataclasses import dataclass

from fmus.errors import ModelicaError

_KEYWORDS = """
    algorithm and annotation block break class connect connector constant constrainedby der discrete each else elseif
    elsewhen encapsulated end enumeration equation expandable extends external false final flow for function if import
    impure in initial inner input loop model not operator or outer output package parameter partial protected public
    pure record redeclare replaceable return stream then true type when while within
"""
KEYWORDS = frozenset(_KEYWORDS.split())
_TOKEN = re.compile(
    r"(?P<space>[ \t\r\f\ufeff]+)|(?P<newline>\n)|(?P<comment>//[^\n]*|/\*.*?\*/)"
    r"|(?P<name>[A-Za-z_]\w*|'(?:[^'\\\n]|\\.)*')"
    r"|(?P<number>\d+(?:\.(?!\*)\d*)?(?:[eE][+-]?\d+)?|\.\d+(?:[eE][+-]?\d+)?)"
    r'|(?P<string>"(?:[^"\\]|\\.)*")'
    r"|(?P<symbol>:=|==|<>|<=|>=|\.[-+*/^]|[-+*/^()\[\]{},;:=<>.])",
    re.DOTALL,
)


@dataclass(frozen=True, slots=True)
class Token:
    """One token; `kind` is name, keyword, number, string, symbol or end, `start` its first character in the text."""

    kind: str
    text: str
    line: int
    start: int = 0

    @property
    def end(self) -> int:
        """Where the text goes on behind the token."""
        return self.start + len(self.text)


def tokens_of(text: str, file: str) -> list[Token]:
    """Split Modelica text; the last token is of kind `end`.

    Raises:
        ModelicaError: for a character that starts no token, such as an unclosed string.
    """
    found: list[Token] = []
    position, line = 0, 1
    while position < len(text):
        match = _TOKEN.match(text, position)
        if match is None:
            rest = text[position:].split("\n", 1)[0][:20]
            why = "this string or comment is not closed" if rest[0] in "\"'/" else "this character means nothing here"
            raise ModelicaError(f"{file}:{line}: {why}: {rest}")
        kind, piece = str(match.lastgroup), match.group()
        if kind not in ("space", "newline", "comment"):
            found.append(Token("keyword" if piece in KEYWORDS else kind, piece, line, position))
        line += piece.count("\n")
        position = match.end()
    found.append(Token("end", "end of file", line, len(text)))
    return found

"""Grammar of Modelica expressions: only correctness is checked, nothing is kept but shape and place."""

from typing import NoReturn

from fmus.errors import ModelicaError
from fmus.frontend.lint.tokens import Token
from fmus.frontend.lint.tree import Name, Value

_ADD = frozenset(("+", "-", ".+", ".-"))
_MULTIPLY = frozenset(("*", "/", ".*", "./"))
_RELATIONS = frozenset(("<", "<=", ">", ">=", "==", "<>"))
_CALLED_KEYWORDS = frozenset(("der", "initial", "pure"))


class Expressions:
    """Cursor over tokens with one method for each rule of the expression grammar."""

    def __init__(self, tokens: list[Token], file: str) -> None:
        self.tokens, self.file, self.at = tokens, file, 0

    @property
    def token(self) -> Token:
        """The next token."""
        return self.tokens[self.at]

    @property
    def text(self) -> str:
        """Text of the next token; a string literal never looks like a symbol or keyword."""
        return self.tokens[self.at].text

    def refuse(self, what: str, line: int | None = None) -> NoReturn:
        """Raise a syntax error at the next token, or at a line."""
        raise ModelicaError(f"{self.file}:{self.token.line if line is None else line}: {what}")

    def accept(self, *texts: str) -> bool:
        """Step over the next token if it is one of `texts`."""
        if self.text in texts:
            self.at += 1
            return True
        return False

    def expect(self, text: str) -> None:
        """Step over `text`; what is missing is reported where the token before it stands."""
        if self.text != text:
            before = self.tokens[self.at - 1]
            self.refuse(f"'{text}' is missing between '{_brief(before)}' and '{_brief(self.token)}'", before.line)
        self.at += 1

    def identifier(self) -> str:
        """Step over a name and return it."""
        if self.token.kind != "name":
            self.refuse(f"a name is expected before '{_brief(self.token)}'")
        self.at += 1
        return self.tokens[self.at - 1].text

    def name(self) -> Name:
        """Step over a dotted name."""
        self.accept(".")
        parts = [self.identifier()]
        while self.text == "." and self.tokens[self.at + 1].kind == "name":
            self.at += 1
            parts.append(self.identifier())
        return tuple(parts)

    def value(self) -> Value:
        """Step over an expression and return where it stands."""
        start = self.at
        length = self.expression()
        text, span = " ".join(t.text for t in self.tokens[start : self.at]), self.tokens[start].start
        return Value(self.tokens[start].line, length, text, (span, self.tokens[self.at - 1].end))

    def expression(self) -> int | None:
        """Step over an expression; the number of elements if it is an array constructor and nothing else."""
        if not self.accept("if"):
            return self._range()
        self.expression()
        self.expect("then")
        self.expression()
        while self.accept("elseif"):
            self.expression()
            self.expect("then")
            self.expression()
        self.expect("else")
        self.expression()
        return None

    def _range(self) -> int | None:
        length = self._logical()
        while self.text == ":":
            self.at += 1
            length = None
            self._logical()
        return length

    def _logical(self) -> int | None:
        length = self._relation()
        while self.accept("and", "or"):
            length = None
            self._relation()
        return length

    def _relation(self) -> int | None:
        negated = self.accept("not")
        length = self._sum()
        if self.text in _RELATIONS:
            self.at += 1
            self._sum()
            return None
        return None if negated else length

    def _sum(self) -> int | None:
        if self.text in _ADD:
            self.at += 1
        length = self._product()
        while self.text in _ADD:
            self.at += 1
            length = None
            self._product()
        return length

    def _product(self) -> int | None:
        length = self._power()
        while self.text in _MULTIPLY:
            self.at += 1
            length = None
            self._power()
        return length

    def _power(self) -> int | None:
        length = self._primary()
        if self.accept("^", ".^"):
            self._primary()
            return None
        return length

    def _primary(self) -> int | None:
        token = self.token
        if token.kind in ("number", "string") or token.text in ("true", "false", "end"):
            self.at += 1
        elif token.text in _CALLED_KEYWORDS:
            self.at += 1
            self.arguments()
        elif token.kind == "name" or token.text == ".":
            self.reference()
            if self.text == "(":
                self.arguments()
        elif self.accept("{"):
            return self._constructor()
        elif self.accept("("):
            self._outputs()
        elif self.accept("["):
            self._rows()
        else:
            self.refuse(f"'{_brief(token)}' cannot stand here; a value is expected")
        if self.text == "[":
            self.subscripts()
        return None

    def _constructor(self) -> int | None:
        if self.accept("}"):
            return 0
        count = 1
        self.expression()
        if self.accept("for"):
            self.iterators()
            self.expect("}")
            return None
        while self.accept(","):
            self.expression()
            count += 1
        self.expect("}")
        return count

    def _outputs(self) -> None:
        while not self.accept(")"):
            if not self.accept(","):
                self.expression()
                if self.text not in (",", ")"):
                    self.expect(")")

    def _rows(self) -> None:
        self.expression()
        while self.accept(",", ";"):
            self.expression()
        self.expect("]")

    def reference(self) -> None:
        """Step over `a.b[1].c`."""
        self.accept(".")
        self.identifier()
        while True:
            if self.text == "[":
                self.subscripts()
            elif self.text == ".":
                self.at += 1
                self.identifier()
            else:
                return

    def subscripts(self) -> list[str]:
        """Step over `[i, :]` and return the text of each subscript."""
        self.expect("[")
        found = []
        while True:
            start = self.at
            if not self.accept(":"):
                self.expression()
            found.append(" ".join(t.text for t in self.tokens[start : self.at]))
            if not self.accept(","):
                break
        self.expect("]")
        return found

    def arguments(self) -> None:
        """Step over the arguments of a call."""
        self.expect("(")
        if self.accept(")"):
            return
        while True:
            if self.token.kind == "name" and self.tokens[self.at + 1].text == "=":
                self.at += 2
            if self.accept("function"):
                self.name()
                self.arguments()
            else:
                self.expression()
            if self.accept("for"):
                self.iterators()
            if not self.accept(","):
                break
        self.expect(")")

    def iterators(self) -> list[str]:
        """Step over `i in 1:n, j in 1:m` and return the names."""
        found = []
        while True:
            found.append(self.identifier())
            if self.accept("in"):
                self.expression()
            if not self.accept(","):
                return found


def _brief(token: Token) -> str:
    return token.text if len(token.text) <= 20 else f"{token.text[:17]}..."

"""Grammar of equations and algorithms: only correctness is checked."""

from fmus.frontend.lint.expressions import Expressions
from fmus.frontend.lint.tokens import Token
from fmus.frontend.lint.tree import EquationText


class Statements(Expressions):
    """Adds equations and statements to the expression grammar; `equations` collects those of the present class."""

    def __init__(self, tokens: list[Token], file: str) -> None:
        super().__init__(tokens, file)
        self.equations: list[EquationText] = []
        self._loops: list[str] = []
        self._branches: list[int] = []

    def section(self, is_algorithm: bool) -> None:
        """Step over the equations or statements of a section, up to the keyword that ends it."""
        while self._starts_statement():
            self._statement(is_algorithm)
            self.comment()
            self.expect(";")

    def _starts_statement(self) -> bool:
        if self.text == "initial" and self.tokens[self.at + 1].text in ("equation", "algorithm"):
            return False
        opening = ("if", "for", "when", "while", "connect", "break", "return", "(", "{", "[", "-", "+", "not", ".")
        return self.token.kind in ("name", "number") or self.text in (*opening, "der", "initial", "true", "false")

    def comment(self) -> None:
        """Step over a description and an annotation."""
        self.description()
        if self.accept("annotation"):
            self.annotation()

    def description(self) -> None:
        """Step over a description string."""
        if self.token.kind == "string":
            self.at += 1
            while self.accept("+"):
                self.at += 1

    def annotation(self) -> None:
        """Step over the parentheses of an annotation, whose content is for tools."""
        self.expect("(")
        start, depth = self.tokens[self.at - 1].line, 1
        while depth:
            if self.token.kind == "end":
                self.refuse("the parenthesis of this annotation is not closed", start)
            depth += (self.text == "(") - (self.text == ")")
            self.at += 1

    def _statement(self, is_algorithm: bool) -> None:
        text = self.text
        if text in ("if", "when", "while", "for"):
            self._block(text, is_algorithm)
        elif text == "connect":
            self.at += 1
            self.arguments()
        elif text in ("break", "return"):
            self.at += 1
        else:
            self._equation(is_algorithm)

    def _equation(self, is_algorithm: bool) -> None:
        line, start = self.token.line, self.token.start
        self.expression()
        if is_algorithm and self.text == "=":
            self.refuse("an assignment in an algorithm is written with ':='")
        if not is_algorithm and self.text == ":=":
            self.refuse("an equation is written with '='")
        if self.accept("=", ":="):
            self.expression()
        elif self.tokens[self.at - 1].text != ")":
            self.refuse("this is neither an equation nor a call", line)
        if not is_algorithm:
            span = (start, self.tokens[self.at - 1].end)
            self.equations.append(EquationText(span, line, tuple(self._loops), tuple(self._branches)))

    def _block(self, kind: str, is_algorithm: bool) -> None:
        line = self.token.line
        self.at += 1
        depth, inside = len(self._loops), len(self._branches)
        if kind == "if":
            self._branches.append(self.token.start)
        if kind == "for":
            self._loops += self.iterators()
        else:
            self.expression()
        self.expect("then" if kind in ("if", "when") else "loop")
        self.section(is_algorithm)
        while self.accept("elseif", "elsewhen"):
            self.expression()
            self.expect("then")
            self.section(is_algorithm)
        if self.accept("else"):
            self.section(is_algorithm)
        if self.text != "end" or self.tokens[self.at + 1].text != kind:
            self.refuse(f"the '{kind}' of line {line} is not closed; write 'end {kind};'")
        self.at += 2
        del self._loops[depth:], self._branches[inside:]

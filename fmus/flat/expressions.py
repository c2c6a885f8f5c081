"""Modelica expressions as trees: nested tuples that begin with what they are."""

from typing import Any

from fmus.errors import ModelicaError
from fmus.frontend.lint.tokens import Token

Tree = tuple[Any, ...]

_RELATIONS = ("<", "<=", ">", ">=", "==", "<>")


class Parser:
    """Cursor over tokens, one method for each rule of the grammar.

    Trees are `("number", x)`, `("name", "a.b", subscripts)`, `("call", name, arguments)`, `("array", items)`,
    `("for", body, iterators)`, `("if", condition, then, else)`, `("range", first, step, last)`, `("unary", op, a)`,
    `("binary", op, a, b)`, `("index", base, subscripts)`, `("outputs", items)`, `("named", name, argument)` and `("all",)` for a
    colon.
    """

    def __init__(self, tokens: list[Token]) -> None:
        self.tokens, self.at = tokens, 0

    @property
    def text(self) -> str:
        """Text of the next token."""
        return self.tokens[self.at].text

    @property
    def kind(self) -> str:
        """Kind of the next token."""
        return self.tokens[self.at].kind

    def step(self) -> str:
        """Step over a token and return its text."""
        self.at += 1
        return self.tokens[self.at - 1].text

    def accept(self, *texts: str) -> bool:
        """Step over the next token if it is one of `texts`."""
        if self.text in texts and self.kind != "string":
            self.at += 1
            return True
        return False

    def expect(self, text: str) -> None:
        """Step over `text`."""
        if not self.accept(text):
            raise ModelicaError(f"flat text: '{text}' expected before '{self.text}'")

    def expression(self) -> Tree:
        """An expression."""
        if not self.accept("if"):
            return self._range()
        branches = []
        while True:
            condition = self.expression()
            self.expect("then")
            branches.append((condition, self.expression()))
            if not self.accept("elseif"):
                break
        self.expect("else")
        tree = self.expression()
        for condition, value in reversed(branches):
            tree = ("if", condition, value, tree)
        return tree

    def _range(self) -> Tree:
        first = self._or()
        if not self.accept(":"):
            return first
        second = self._or()
        if not self.accept(":"):
            return ("range", first, ("number", 1.0), second)
        return ("range", first, second, self._or())

    def _or(self) -> Tree:
        tree = self._and()
        while self.accept("or"):
            tree = ("binary", "or", tree, self._and())
        return tree

    def _and(self) -> Tree:
        tree = self._relation()
        while self.accept("and"):
            tree = ("binary", "and", tree, self._relation())
        return tree

    def _relation(self) -> Tree:
        if self.accept("not"):
            return ("unary", "not", self._relation())
        tree = self._sum()
        if self.text in _RELATIONS:
            tree = ("binary", self.step(), tree, self._sum())
        return tree

    def _sum(self) -> Tree:
        sign = self.step() if self.text in ("+", "-", ".+", ".-") else "+"
        tree = self._product()
        if sign in ("-", ".-"):
            tree = ("unary", "-", tree)
        while self.text in ("+", "-", ".+", ".-"):
            tree = ("binary", self.step()[-1], tree, self._product())
        return tree

    def _product(self) -> Tree:
        tree = self._power()
        while self.text in ("*", "/", ".*", "./"):
            tree = ("binary", self.step(), tree, self._power())
        return tree

    def _power(self) -> Tree:
        tree = self._primary()
        if self.text in ("^", ".^"):
            tree = ("binary", self.step(), tree, self._primary())
        return tree

    def _primary(self) -> Tree:
        if self.kind == "number":
            tree: Tree = ("number", float(self.step()))
        elif self.kind == "string":
            tree = ("string", self.step())
        elif self.accept("true"):
            tree = ("number", True)
        elif self.accept("false"):
            tree = ("number", False)
        elif self.accept("end"):
            tree = ("end",)
        elif self.accept("("):
            tree = self._outputs()
        elif self.accept("{"):
            tree = self._array("}")
        elif self.accept("["):
            tree = self._matrix()
        else:
            tree = self._reference()
        while self.text == "[":
            tree = ("index", tree, self.subscripts())
        return tree

    def _outputs(self) -> Tree:
        items = [self.expression()]
        while self.accept(","):
            items.append(self.expression())
        self.expect(")")
        return items[0] if len(items) == 1 else ("outputs", items)

    def _array(self, closing: str) -> Tree:
        items = [] if self.text == closing else [self.expression()]
        if self.accept("for"):
            iterators = self.iterators()
            self.expect(closing)
            return ("for", items[0], iterators)
        while self.accept(","):
            items.append(self.expression())
        self.expect(closing)
        return ("array", items)

    def _matrix(self) -> Tree:
        rows = [[self.expression()]]
        while self.text in (",", ";"):
            if self.step() == ";":
                rows.append([])
            rows[-1].append(self.expression())
        self.expect("]")
        return ("matrix", rows)

    def iterators(self) -> list[tuple[str, Tree]]:
        """`i in 1:n, j in 1:m`."""
        found = []
        while True:
            name = self.step()
            self.expect("in")
            found.append((name, self.expression()))
            if not self.accept(","):
                return found

    def name(self) -> str:
        """A dotted name whose parts may have literal subscripts: `muscle[1].F`."""
        text = self.step()
        while self.text == "." or (self.text == "[" and self._is_part()):
            if self.text == "[":
                while self.tokens[self.at - 1].text != "]":
                    text += self.step()
            else:
                text += self.step() + self.step()
        return text

    def _is_part(self) -> bool:
        """Whether subscripts are followed by a dot, so that they belong to the name."""
        depth, k = 0, self.at
        while True:
            depth += (self.tokens[k].text == "[") - (self.tokens[k].text == "]")
            k += 1
            if depth == 0:
                return self.tokens[k].text == "."

    def _reference(self) -> Tree:
        self.accept(".")  # a name looked up at the top
        if self.kind not in ("name", "keyword") or (self.kind == "keyword" and self.text not in ("der", "initial")):
            raise ModelicaError(f"flat text: '{self.text}' cannot stand in an expression")
        name = self.name()
        if not self.accept("("):
            return ("name", name)
        arguments: list[Tree] = []
        while self.text != ")":
            if self.kind == "name" and self.tokens[self.at + 1].text == "=":
                arguments.append(("named", self.step(), self.step() and self.expression()))
            else:
                arguments.append(self.expression())
            if self.accept("for"):
                arguments = [("for", arguments[0], self.iterators())]
            self.accept(",")
        self.expect(")")
        return ("call", name, arguments)

    def subscripts(self) -> list[Tree]:
        """`[i, :]`."""
        self.expect("[")
        found: list[Tree] = []
        while True:
            found.append(("all",) if self.accept(":") else self.expression())
            if not self.accept(","):
                break
        self.expect("]")
        return found

"""Functions of the Modelica sources, run statement by statement."""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from fmus.errors import ModelicaError
from fmus.flat.evaluate import Evaluator, Number, Unknown
from fmus.flat.expressions import Parser, Tree
from fmus.flat.external import external
from fmus.flat.names import Names
from fmus.frontend.lint.scope import View, base_of
from fmus.frontend.lint.tokens import Token, tokens_of
from fmus.frontend.lint.tree import ClassDef

MOST_ROUNDS = 10_000  # of a while loop


@dataclass(frozen=True)
class Named:
    """An argument that is given by its name."""

    name: str
    value: Number


@dataclass(frozen=True)
class Variable:
    """An input, an output or a local variable of a function."""

    name: str
    role: str
    sizes: list[Tree]
    default: Tree | None


@dataclass(frozen=True)
class Function:
    """What a function declares, and its statements as trees, or the C function behind it with its arguments."""

    variables: list[Variable]
    body: list[Tree]
    external: tuple[str, list[Tree]] | None = None

    def named(self, role: str) -> list[Variable]:
        """The variables of a role, in order."""
        return [v for v in self.variables if v.role == role]


class Functions:
    """The functions and constants of some source texts."""

    def __init__(self, texts: Sequence[str]) -> None:
        self._names = Names(texts)
        self._known: dict[ClassDef, Function] = {}
        self._constants: dict[str, Number] = {}

    def run(self, name: str, arguments: Sequence[Number], scope: View | None = None) -> list[Number]:
        """The outputs of a function.

        Args:
            name: of the function, in full without a scope.
            arguments: values in the order of its inputs, or `Named` ones.
            scope: the function that calls it.

        Raises:
            Unknown: if the function is not found, found twice, or uses what is not supported here.
        """
        view = self._names.function(name, scope)
        return self._execute(self._function(view), arguments, view)

    def constant(self, name: str, scope: View | None = None) -> Number:
        """The value of a constant of a package, or the number of a literal of an enumeration.

        Raises:
            Unknown: if there is none of that name.
        """
        if scope is None and name in self._constants:
            return self._constants[name]
        found = self._names.constant(name, scope)
        if isinstance(found, float):
            return found
        written = getattr(found.element, "value", None)
        if written is None:
            raise Unknown(f"the constant {name} without a value")
        tree = Parser(tokens_of(written.text, name)).expression()
        evaluator = Evaluator(
            partial(self.constant, scope=found.home), lambda name, trees: self._call(name, trees, found.home, evaluator)
        )
        value = evaluator.value(tree)
        if scope is None:
            self._constants[name] = value
        return value

    def _function(self, view: View) -> Function:
        definition = view.definition
        if "replaceable" in definition.prefixes:
            raise Unknown(f"the replaceable function {definition.name}")
        if definition not in self._known:
            if definition.short is not None:
                base = base_of(view, definition.short)
                if base is None or definition.short.modifiers:
                    raise Unknown(f"the function {definition.name}")
                self._known[definition] = self._function(base)
                return self._known[definition]
            try:
                self._known[definition] = _read(tokens_of(self._names.text_of(definition), "source"))
            except (ModelicaError, IndexError) as error:
                raise Unknown(f"the function {definition.name}") from error
        return self._known[definition]

    def _call(self, name: str, trees: list[Tree], scope: View, evaluator: Evaluator) -> Number:
        return self.run(name, _arguments(trees, evaluator), scope)[0]

    def _execute(self, function: Function, arguments: Sequence[Number], scope: View) -> list[Number]:
        values: dict[str, Number] = {}

        def lookup(name: str) -> Number:
            return values[name] if name in values else self.constant(name, scope)

        evaluator = Evaluator(lookup, lambda name, trees: self._call(name, trees, scope, evaluator))
        inputs = function.named("input")
        values.update({v.name: a for v, a in zip(inputs, arguments, strict=False) if not isinstance(a, Named)})
        values.update({a.name: a.value for a in arguments if isinstance(a, Named)})
        for variable in function.variables:
            if variable.name in values:
                continue
            if variable.default is not None:
                values[variable.name] = evaluator.value(variable.default)
            elif variable.role == "input":
                raise Unknown(f"the input {variable.name} without a value")
            elif variable.sizes and ("all",) not in variable.sizes:
                values[variable.name] = np.zeros([int(evaluator.value(size)) for size in variable.sizes])
        if function.external is not None:
            symbol, trees = function.external
            return [external(symbol, [evaluator.value(tree) for tree in trees], values)]
        with suppress(_Return):
            self._run(function.body, evaluator, values, scope)
        return [lookup(v.name) for v in function.named("output")]

    def _run(self, statements: list[Tree], evaluator: Evaluator, values: dict[str, Number], scope: View) -> None:
        for statement in statements:
            kind = statement[0]
            if kind == "assign":
                _assign(statement[1], evaluator.value(statement[2]), evaluator, values)
            elif kind == "assign_outputs":
                call = statement[2]
                outputs = self.run(call[1], _arguments(call[2], evaluator), scope)
                for target, output in zip(statement[1], outputs, strict=False):
                    _assign(target, output, evaluator, values)
            elif kind == "branches":
                for condition, body in statement[1]:
                    if bool(evaluator.value(condition)):
                        self._run(body, evaluator, values, scope)
                        break
            elif kind == "loop":
                with suppress(_Break):
                    for value in np.ravel(evaluator.value(statement[2])):
                        values[statement[1]] = value
                        self._run(statement[3], evaluator, values, scope)
            elif kind == "while":
                with suppress(_Break):
                    for _ in range(MOST_ROUNDS):
                        if not bool(evaluator.value(statement[1])):
                            break
                        self._run(statement[2], evaluator, values, scope)
            else:
                raise _Return if kind == "return" else _Break


class _Return(Exception):
    """The rest of a function is left out."""


class _Break(Exception):
    """The rest of a loop is left out."""


def _arguments(trees: Sequence[Tree], evaluator: Evaluator) -> list[Number]:
    return [Named(tree[1], evaluator.value(tree[2])) if tree[0] == "named" else evaluator.value(tree) for tree in trees]


def _assign(target: Tree, value: Number, evaluator: Evaluator, values: dict[str, Number]) -> None:
    if target[0] == "name":
        values[target[1]] = np.array(value, dtype=float) if np.ndim(value) else value
    elif target[0] == "index" and target[1][0] == "name":
        array = values[target[1][1]]
        array[evaluator.positions(target[2], np.shape(array))] = value
    else:
        raise Unknown("an assignment")


def _read(tokens: list[Token]) -> Function:
    """Read a function from its name on."""
    parser = Parser(tokens)
    name = parser.step()
    _skip_text(parser)
    variables: list[Variable] = []
    body: list[Tree] = []
    behind: tuple[str, list[Tree]] | None = None
    while not (parser.text == "end" and tokens[parser.at + 1].text == name):
        if parser.accept("public", "protected"):
            continue
        if parser.accept("algorithm"):
            body = _statements(parser)
            continue
        if parser.accept("external"):
            behind = _external(parser)
            continue
        if parser.text == "annotation":
            _skip_text(parser)
            parser.expect(";")
            continue
        if parser.accept("extends"):
            if "Icons" not in parser.name().split("."):
                raise ModelicaError("a function that extends one that may have variables")
            parser.expect(";")
            continue
        variables.extend(_variables(parser))
    return Function(variables, body, behind)


def _external(parser: Parser) -> tuple[str, list[Tree]]:
    """`"C" y = symbol(x)`."""
    if parser.kind == "string":
        parser.step()
    tree = parser.expression()
    if parser.accept("="):
        tree = parser.expression()
    if tree[0] != "call":
        raise ModelicaError("an external function without its call")
    _skip_text(parser)
    parser.expect(";")
    return tree[1], tree[2]


def _variables(parser: Parser) -> list[Variable]:
    role = "local"
    while parser.kind == "keyword" and parser.text in ("input", "output", "constant", "parameter", "final"):
        word = parser.step()
        role = word if word in ("input", "output") else role
    if parser.kind != "name":
        raise ModelicaError(f"a declaration begins with {parser.text}")
    parser.name()
    common = parser.subscripts() if parser.text == "[" else []
    found = []
    while True:
        name = parser.step()
        sizes = parser.subscripts() if parser.text == "[" else common
        if parser.text == "(":
            _skip_parentheses(parser)
        default = parser.expression() if parser.accept("=", ":=") else None
        found.append(Variable(name, role, sizes, default))
        if not parser.accept(","):
            break
    _skip_text(parser)
    parser.expect(";")
    return found


def _statements(parser: Parser) -> list[Tree]:
    found: list[Any] = []
    while parser.text not in ("end", "else", "elseif", "annotation", "public", "protected"):
        if parser.text in ("return", "break"):
            found.append((parser.step(),))
        elif parser.accept("if"):
            found.append(("branches", _branches(parser)))
        elif parser.accept("for"):
            [(name, values)] = parser.iterators()
            parser.expect("loop")
            found.append(("loop", name, values, _statements(parser)))
            parser.expect("end")
            parser.expect("for")
        elif parser.accept("while"):
            condition = parser.expression()
            parser.expect("loop")
            found.append(("while", condition, _statements(parser)))
            parser.expect("end")
            parser.expect("while")
        else:
            found.extend(_assignment(parser))
        _skip_text(parser)
        parser.expect(";")
    return found


def _branches(parser: Parser) -> list[tuple[Tree, list[Tree]]]:
    found = [(parser.expression(), _after(parser, "then"))]
    while parser.accept("elseif"):
        found.append((parser.expression(), _after(parser, "then")))
    if parser.accept("else"):
        found.append((("number", True), _statements(parser)))
    parser.expect("end")
    parser.expect("if")
    return found


def _after(parser: Parser, word: str) -> list[Tree]:
    parser.expect(word)
    return _statements(parser)


def _assignment(parser: Parser) -> list[Tree]:
    target = parser.expression()
    if target[0] == "call" and target[1] == "assert":
        return []
    parser.expect(":=")
    value = parser.expression()
    return [("assign_outputs", target[1], value) if target[0] == "outputs" else ("assign", target, value)]


def _skip_text(parser: Parser) -> None:
    """Step over a description and an annotation."""
    while parser.kind == "string" or (parser.text == "+" and parser.tokens[parser.at - 1].kind == "string"):
        parser.step()
    if parser.accept("annotation"):
        _skip_parentheses(parser)


def _skip_parentheses(parser: Parser) -> None:
    depth = 0
    while True:
        if parser.kind == "symbol":
            depth += (parser.text == "(") - (parser.text == ")")
        parser.step()
        if depth == 0:
            return

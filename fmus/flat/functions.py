"""Functions of the Modelica sources, run statement by statement."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from fmus.errors import ModelicaError
from fmus.flat.evaluate import BUILT_IN, Evaluator, Number, Unknown
from fmus.flat.expressions import Parser, Tree
from fmus.frontend.lint.tokens import Token, tokens_of

MOST_ROUNDS = 10_000  # of a while loop


@dataclass(frozen=True)
class Variable:
    """An input, an output or a local variable of a function."""

    name: str
    role: str
    sizes: list[Tree]
    default: Tree | None


@dataclass(frozen=True)
class Function:
    """What a function declares, and its statements as trees."""

    variables: list[Variable]
    body: list[Tree]

    def named(self, role: str) -> list[Variable]:
        """The variables of a role, in order."""
        return [v for v in self.variables if v.role == role]


class Functions:
    """The functions of some source texts, by the last part of their names."""

    def __init__(self, texts: Sequence[str]) -> None:
        self._places: dict[str, list[tuple[list[Token], int]]] = {}
        self._known: dict[str, Function] = {}
        for text in texts:
            if "function" not in text:
                continue
            tokens = tokens_of(text, "source")
            for k, token in enumerate(tokens[:-1]):
                ends = k > 0 and tokens[k - 1].text == "end"
                if token.kind == "keyword" and token.text == "function" and not ends and tokens[k + 1].kind == "name":
                    self._places.setdefault(tokens[k + 1].text, []).append((tokens, k + 1))

    def run(self, name: str, arguments: Sequence[Number]) -> list[Number]:
        """The outputs of a function.

        Raises:
            Unknown: if the function is not found, found twice, or uses what is not supported here.
        """
        short = name.rsplit(".", 1)[-1]
        places = self._places.get(short, [])
        if len(places) != 1:
            raise Unknown(f"the function {short}" + (f" ({len(places)} of that name)" if places else ""))
        if (symbol := _built_in(*places[0])) in BUILT_IN:
            return [BUILT_IN[symbol](*arguments)]
        if short not in self._known:
            try:
                self._known[short] = _read(*places[0])
            except (ModelicaError, IndexError) as error:
                raise Unknown(f"the function {short}") from error
        return self._execute(self._known[short], arguments)

    def _execute(self, function: Function, arguments: Sequence[Number]) -> list[Number]:
        values: dict[str, Number] = {}

        def lookup(name: str) -> Number:
            if name not in values:
                raise Unknown(f"the name {name} in a function")
            return values[name]

        def call(name: str, trees: list[Tree]) -> Number:
            return self.run(name, [evaluator.value(tree) for tree in trees])[0]

        evaluator = Evaluator(lookup, call)
        inputs = function.named("input")
        values.update({v.name: a for v, a in zip(inputs, arguments, strict=False)})
        for variable in function.variables:
            if variable.name in values:
                continue
            if variable.default is not None:
                values[variable.name] = evaluator.value(variable.default)
            elif variable.role == "input":
                raise Unknown(f"the input {variable.name} without a value")
            elif variable.sizes and ("all",) not in variable.sizes:
                values[variable.name] = np.zeros([int(evaluator.value(size)) for size in variable.sizes])
        self._run(function.body, evaluator, values)
        return [lookup(v.name) for v in function.named("output")]

    def _run(self, statements: list[Tree], evaluator: Evaluator, values: dict[str, Number]) -> None:
        for statement in statements:
            kind = statement[0]
            if kind == "assign":
                _assign(statement[1], evaluator.value(statement[2]), evaluator, values)
            elif kind == "assign_outputs":
                call = statement[2]
                outputs = self.run(call[1], [evaluator.value(tree) for tree in call[2]])
                for target, output in zip(statement[1], outputs, strict=False):
                    _assign(target, output, evaluator, values)
            elif kind == "branches":
                for condition, body in statement[1]:
                    if bool(evaluator.value(condition)):
                        self._run(body, evaluator, values)
                        break
            elif kind == "loop":
                for value in np.ravel(evaluator.value(statement[2])):
                    values[statement[1]] = value
                    self._run(statement[3], evaluator, values)
            elif kind == "while":
                for _ in range(MOST_ROUNDS):
                    if not bool(evaluator.value(statement[1])):
                        break
                    self._run(statement[2], evaluator, values)


def _assign(target: Tree, value: Number, evaluator: Evaluator, values: dict[str, Number]) -> None:
    if target[0] == "name":
        values[target[1]] = np.array(value, dtype=float) if np.ndim(value) else value
    elif target[0] == "index" and target[1][0] == "name":
        array = values[target[1][1]]
        array[evaluator.positions(target[2], np.shape(array))] = value
    else:
        raise Unknown("an assignment")


def _read(tokens: list[Token], at: int) -> Function:
    """Read a function whose name stands at a position."""
    parser = Parser(tokens)
    parser.at = at
    name = parser.step()
    _skip_text(parser)
    variables: list[Variable] = []
    body: list[Tree] = []
    while not (parser.text == "end" and tokens[parser.at + 1].text == name):
        if parser.accept("public", "protected"):
            continue
        if parser.accept("algorithm"):
            body = _statements(parser)
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
    return Function(variables, body)


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
        if parser.accept("if"):
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


# What follows the name in a declaration begins with one of these.
_BEHIND_A_NAME = ';(=:"'


def _skip_parentheses(parser: Parser) -> None:
    depth = 0
    while True:
        if parser.kind == "symbol":
            depth += (parser.text == "(") - (parser.text == ")")
        parser.step()
        if depth == 0:
            return


def _built_in(tokens: list[Token], at: int) -> str:
    """What a function is another name of, such as sin for `external "builtin" y = sin(u);`; empty for a function of its own, or one
    whose inputs are handed on in another order."""
    inputs: list[str] = []
    for k in range(at, len(tokens) - 2):
        if tokens[k].text == "end" and tokens[k + 1].text == tokens[at].text:
            return ""
        if tokens[k].text == "input":
            behind = (j for j in range(k, len(tokens)) if tokens[j].text[0] in _BEHIND_A_NAME)
            inputs.append(tokens[next(behind) - 1].text)
        if tokens[k].text == "external":
            opening, closing = (next(j for j in range(k, len(tokens)) if tokens[j].text == sign) for sign in "()")
            same = [token.text for token in tokens[opening + 1 : closing : 2]] == inputs
            return tokens[opening - 1].text if tokens[k + 1].text == '"builtin"' and same else ""
    return ""

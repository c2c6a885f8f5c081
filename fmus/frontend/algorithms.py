"""Algorithms of models as equations: what each assigned variable is in the end.

rumoca 0.10.2 takes an algorithm only if it has one assigned variable and reads none that changes later on. Statements are carried out
with texts instead of values: a read of a variable that is assigned again later becomes the expression that it stands for there.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

from fmus.errors import ModelicaError
from fmus.frontend.lint.expressions import Expressions
from fmus.frontend.lint.statements import Statements
from fmus.frontend.lint.tokens import Token, tokens_of

# Texts double where a variable is read twice and assigned again.
LONGEST = 20_000
_OF_THE_PAST = [["pre", "("], ["edge", "("], ["change", "("]]
Texts = dict[str, str]


class _Leave(Exception):
    """Something that no equation says, such as a loop, or a value of the last step."""


@dataclass
class _Assignment:
    names: list[str]
    value: list[Token]
    line: int


@dataclass
class _Call:
    """`assert(...)` and the like, which are the same in an equation."""

    value: list[Token]
    line: int


@dataclass
class _If:
    line: int
    conditions: list[list[Token]] = field(default_factory=list)
    bodies: list[list["_Statement"]] = field(default_factory=list)


_Statement = _Assignment | _Call | _If


def as_equations(section: str, file: str) -> str | None:
    """Return a section `algorithm ...` as a section `equation ...`, each statement's line kept as far as may be.

    Args:
        section: the text from the keyword on.
        file: for messages.

    Returns:
        None if there are statements that have no equation (for, while, when, subscripts on the left side, a read before the first assignment).
    """
    try:
        reader = _Reader(tokens_of(section, file)[1:], file)
        statements = reader.statements()
        written = list(_equations(statements))
    except (_Leave, ModelicaError):
        return None
    lines: dict[int, str] = {}
    for line, equation in written:
        lines[line] = f"{lines.get(line, '')} {equation};"
    rows = [lines.get(n, "") for n in range(1, section.count("\n") + 2)]
    return "equation" + "\n".join(rows)


class _Reader(Statements):
    """Reads statements as trees."""

    def statements(self) -> list[_Statement]:
        found: list[_Statement] = []
        while self._starts_statement():
            found.append(self._one())
            self.comment()
            self.expect(";")
        return found

    def _one(self) -> _Statement:
        line = self.token.line
        if self.text == "if":
            return self._choice(line)
        if self.text in ("for", "while", "when", "break", "return"):
            raise _Leave
        if self.text == "(":
            names, value = self._several()
            return _Assignment(names, value, line)
        if self.tokens[self.at + 1].text == ":=":
            name = self.identifier()
            self.at += 1
            return _Assignment([name], self._taken(), line)
        value = self._taken()
        if self.text == ":=":
            raise _Leave
        return _Call(value, line)

    def _choice(self, line: int) -> _If:
        found = _If(line)
        self.at += 1
        while True:
            found.conditions.append(self._taken())
            self.expect("then")
            found.bodies.append(self.statements())
            if not self.accept("elseif"):
                break
        found.bodies.append(self.statements() if self.accept("else") else [])
        self.at += 2
        return found

    def _several(self) -> tuple[list[str], list[Token]]:
        self.expect("(")
        names = [self.identifier()]
        while self.accept(","):
            names.append(self.identifier())
        self.expect(")")
        self.expect(":=")
        return names, self._taken()

    def _taken(self) -> list[Token]:
        start = self.at
        Expressions.expression(self)
        return self.tokens[start : self.at]


def _assigned(statements: list[_Statement]) -> Iterator[str]:
    """The names that statements assign; one of an if-statement once for each of its branches."""
    for each in statements:
        if isinstance(each, _Assignment):
            yield from each.names
        elif isinstance(each, _If):
            for body in each.bodies:
                yield from _assigned(body)


def _equations(statements: list[_Statement]) -> Iterator[tuple[int, str]]:
    """Line and text of each equation."""
    all_names = set(_assigned(statements))
    last = {name: k for k, each in enumerate(statements) for name in _assigned([each])}
    texts: Texts = {}
    for k, each in enumerate(statements):
        if isinstance(each, _Call):
            yield each.line, _read(each.value, texts, all_names)
        elif isinstance(each, _Assignment) and len(each.names) > 1:
            if any(last[name] != k or name in texts for name in each.names):
                raise _Leave
            yield each.line, f"({', '.join(each.names)}) = {_read(each.value, texts, all_names)}"
            texts |= {name: name for name in each.names}
        else:
            texts = _carried_out(each, texts, all_names)
            for name in dict.fromkeys(_assigned([each])):
                if last[name] == k:
                    yield each.line, f"{name} = {texts[name]}"
                    texts[name] = name


def _carried_out(statement: _Statement, before: Texts, all_names: set[str]) -> Texts:
    """The texts of all variables behind a statement."""
    if isinstance(statement, _Assignment) and len(statement.names) == 1:
        return {**before, statement.names[0]: _read(statement.value, before, all_names)}
    if not isinstance(statement, _If):
        raise _Leave
    conditions = [_read(each, before, all_names) for each in statement.conditions]
    ends = []
    for body in statement.bodies:
        texts = before
        for each in body:
            texts = _carried_out(each, texts, all_names)
        ends.append(texts)
    after = dict(before)
    for name in dict.fromkeys(_assigned([statement])):
        if any(name not in end for end in ends):
            raise _Leave
        pairs = zip(conditions, ends[:-1], strict=True)
        choice = " else".join(f"if {condition} then {_whole(end[name])}" for condition, end in pairs)
        after[name] = _short(f"{choice} else {_whole(ends[-1][name])}")
    return after


def _read(tokens: list[Token], texts: Mapping[str, str], all_names: set[str]) -> str:
    """An expression with the texts of the variables that it reads."""
    found = []
    for k, token in enumerate(tokens):
        behind = tokens[k + 1].text if k + 1 < len(tokens) else ""
        before = [each.text for each in tokens[max(k - 2, 0) : k]]
        is_own = token.kind == "name" and before[-1:] != ["."] and behind not in ("=", "(")
        is_own = is_own and before not in _OF_THE_PAST
        if token.text == "for" and token.kind == "keyword":
            raise _Leave
        if not is_own or token.text not in all_names:
            found.append(token.text)
        elif token.text not in texts or (texts[token.text] != token.text and behind in ("[", ".")):
            raise _Leave
        else:
            text = texts[token.text]
            found.append(text if text == token.text else f"({text})")
    return _short(" ".join(found))


def _whole(text: str) -> str:
    return f"({text})" if text.startswith("if ") else text


def _short(text: str) -> str:
    if len(text) > LONGEST:
        raise _Leave
    return text

"""What the compiler misreads, written in another way that means the same; every line stays where it is."""

import re
from collections import Counter
from collections.abc import Iterator

from fmus.errors import ModelicaError
from fmus.frontend.algorithms import as_equations
from fmus.frontend.lint.parser import parse
from fmus.frontend.lint.tree import ClassDef, Component

_END = re.compile(r"[\w. ]*\bgetT\w+[TU](min|max) \( tableID \)")
_ROW = {"min": "1:min(1, size(table, 1))", "max": "max(1, size(table, 1)):size(table, 1)"}  # none, if it is empty
# From character, to character, and what stands there instead.
Edit = tuple[int, int, str]


def rewritten(text: str, file: str) -> str:
    """Return a Modelica text for the compiler.

    A value that is looked up in a table of the Standard Library is counted twice by rumoca 0.10.2 if it stands in a declaration, so
    it becomes an equation, and a parameter that needs it a variable. Algorithms of models become equations.
    """
    if "ExternalCombiTable" not in text and "algorithm" not in text:
        return text
    try:
        classes = parse(text, file)
    except ModelicaError:  # which the linter tells, if the class needs this file
        return text
    for start, end, new in sorted((edit for each in classes for edit in _edits(each, text)), reverse=True):
        text = text[:start] + new + text[end:]
    return text


def _edits(definition: ClassDef, text: str) -> Iterator[Edit]:
    for inner in definition.classes.values():
        yield from _edits(inner, text)
    for start, end in definition.algorithms if definition.kind != "function" else ():
        if (equations := as_equations(text[start:end], definition.file)) is not None:
            yield start, end, equations
    clauses = Counter(c.clause for c in definition.components.values())
    alone = {name: c for name, c in definition.components.items() if clauses[c.clause] == 1 and not c.sizes}
    values = {name: c.value.text for name, c in alone.items() if c.value is not None}
    tables = {name for name, c in definition.components.items() if c.type_name[-1].startswith("ExternalCombiTable")}
    looked_up: set[str] = set()
    while more := {n for n in values.keys() - looked_up - tables if _words(values[n]) & (tables | looked_up)}:
        looked_up |= more
    is_block = {"table", "tableOnFile"} <= definition.components.keys()
    for name in looked_up:
        yield from _as_equation(
            definition.components[name], _with_rows(values[name]) if is_block else values[name], text
        )


def _words(text: str) -> set[str]:
    return set(re.findall(r"(?<![\w.])[A-Za-z_]\w*", text))


def _with_rows(value: str) -> str:
    """A value with the first or last abscissa of a table as a function of the rows, which are parameters; rumoca makes it a number."""
    return _END.sub(lambda found: f"(if tableOnFile then {found[0]} else sum(table[{_ROW[found[1]]}, 1]))", value)


def _as_equation(component: Component, value: str, text: str) -> Iterator[Edit]:
    assert component.value is not None
    start, end = component.value.span
    equals = text.rindex("=", component.span[0], start)
    yield (component.clause[0], component.type_span[0], "")
    yield (equals, end, "\n" * text.count("\n", equals, end))
    section = "protected" if component.is_protected else "public"
    yield (component.clause[1], component.clause[1], f" equation {component.name} = {value}; {section}")

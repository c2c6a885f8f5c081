"""The file of a changed class: the user's own text, and the new classes beside the originals."""

import re
from collections.abc import Mapping
from typing import Any

from fmus.catalogue import ModelicaModel
from fmus.errors import ModelicaError
from fmus.frontend.lint.scope import View
from fmus.frontend.lint.sources import modelica_text, without_within
from fmus.frontend.lint.tokens import tokens_of
from fmus.frontend.lint.tree import ClassDef, Import
from orchestrator.effects.copies import Copies, Copy, applied, is_stored, outermost


def literal(value: float | Mapping[str, float]) -> str:
    """A number, or an array by its elements' full names, such as `m[1,2]` or `part[1].m[2]`, row-major."""
    if isinstance(value, int | float):
        return f"{float(value)!r}".removesuffix(".0") if abs(value) < 1e15 else repr(float(value))
    numbers = [literal(item) for item in value.values()]
    shape = [int(part) for part in re.findall(r"[\[,](\d+)", list(value)[-1])]
    for length in reversed(shape[1:]):
        numbers = ["{" + ", ".join(numbers[k : k + length]) + "}" for k in range(0, len(numbers), length)]
    return "{" + ", ".join(numbers) + "}"


def extended(name: str, base: str, values: Mapping[str, float | Mapping[str, float]], definition: ClassDef) -> str:
    """A class that extends another one of the same place with other values, without the last semicolon.

    Args:
        name: name of the new class.
        base: name of the class that it extends.
        values: values by full name such as `arm.joint1.d`, in the parameters' units.
        definition: the class that it extends, as it was read.
    """
    tree: dict[str, Any] = {}
    for full, value in values.items():
        *parts, last = full.split(".")
        place = tree
        for part in parts:
            place = place.setdefault(part, {})
        place[last] = literal(value)
    modifiers = ",\n    ".join(_written(tree))
    kind = "block" if definition.kind == "block" else "model"
    return f"{kind} {name}\n  // values adjusted by misfit\n  extends {base}(\n    {modifiers});\nend {name}"


def _written(tree: Mapping[str, Any]) -> list[str]:
    return [f"{k}({', '.join(_written(v))})" if isinstance(v, dict) else f"{k}={v}" for k, v in tree.items()]


def with_terms(equation: str, terms: list[tuple[float, str]], file: str) -> str:
    """Add terms to an equation.

    Args:
        equation: its text, `left = right`.
        terms: the sign of the derivative in left minus right, and the expression to add, for each term.
        file: for messages.
    """
    left, between, right = _sides(equation, file)
    for sign, expression in terms:
        if sign > 0:
            right = summed(right, expression)
        else:
            left = summed(left, expression)
    return left + between + right


def _sides(equation: str, file: str) -> tuple[str, str, str]:
    depth = 0
    for token in tokens_of(equation, file):
        depth += (token.text in ("(", "{", "[")) - (token.text in (")", "}", "]"))
        if token.text == "=" and depth == 0:
            left, right = equation[: token.start], equation[token.end :]
            first, last = len(left.rstrip()), len(right) - len(right.lstrip())
            return left[:first], left[first:] + "=" + right[:last], right[last:]
    raise ModelicaError(f"{file}: '{equation}' is no equation with two sides")


def summed(side: str, expression: str) -> str:
    """An expression added to another one, in Modelica."""
    expression = expression.strip()
    if tokens_of(side, "")[0].text == "if":
        side = f"({side})"
    elif side.strip() in ("0", "0.0"):
        return expression
    if tokens_of(expression, "")[0].text == "if":
        expression = f"({expression})"
    if expression.startswith("-"):
        return f"{side} - {expression[1:].lstrip()}"
    return f"{side} + {expression}"


def in_row(expression: str, row: int, rows: int, iterators: tuple[str, ...]) -> str:
    """A term of one row of an equation of arrays, or of one round of a loop.

    Args:
        expression: the term.
        row: the row or round, from 0.
        rows: number of rows.
        iterators: names of the loops around the equation.

    Raises:
        ModelicaError: for an equation inside of two loops.
    """
    if iterators:
        if len(iterators) > 1:
            raise ModelicaError("an equation inside of two loops cannot be changed; write the loops as one")
        return f"(if {iterators[0]} == {row + 1} then {expression} else 0)"
    if rows == 1:
        return expression
    return "{" + ", ".join(expression if k == row else "0" for k in range(rows)) + "}"


def file_text(base: ModelicaModel, root: View, copies: Copies, name: str, wrapper: str | None) -> tuple[str, str]:
    """Put copies, and a class that extends the model's, beside the originals.

    Args:
        base: the model.
        root: its class.
        copies: what was copied.
        name: short name of the new class.
        wrapper: a class that extends the copy, or the model's class; None without one.

    Returns:
        The text, and the full name of the new class.
    """
    definition = root.definition
    whole = outermost(definition)
    made = list(copies.made.values())
    if base.file is None or is_stored(whole):
        if base.file is not None:
            raise ModelicaError(
                f"{definition.file} is part of a package; put {base.class_name} into a file of its own to extend it"
            )
        if wrapper is not None and not made:
            wrapper = wrapper.replace(f"extends {definition.name}(", f"extends {base.class_name}(", 1)
        parts = [standalone(copy) for copy in made] + ([f"{wrapper};\n"] if wrapper else [])
        return "\n".join(parts), name
    text = modelica_text(base.file)
    foreign = [copy for copy in made if copies.is_foreign(copy.definition)]
    nested = [copy for copy in made if copy not in foreign and _inside(copy.definition, definition)]
    beside = [copy for copy in made if copy not in foreign and copy not in nested]
    main = next((copy for copy in beside if copy.definition is definition), None)
    for copy in nested:
        assert main is not None
        main.inner.append(copy)
    edits = []
    for copy in beside:
        place = copy.definition.span[1]
        edits.append((place, place, f";\n\n{copy.indent}{_head(copy)}{copy.indent}{copy.rendered()}"))
    if wrapper is not None:
        place, indent = definition.span[1], Copy(copies.first_home(()), "", text).indent
        indented = "\n".join(indent + line if line else line for line in wrapper.split("\n"))
        edits.append((place, place, f";\n\n{indented}"))
    front = "".join(f"{standalone(copy)}\n" for copy in foreign)
    changed = applied(text, edits)
    return (front + without_within(changed) if front else changed), ".".join([*base.class_name.split(".")[:-1], name])


def _inside(inner: ClassDef, outer: ClassDef) -> bool:
    """Whether a class is declared inside another one."""
    enclosing = inner.outer
    while enclosing is not None and enclosing is not outer:
        enclosing = enclosing.outer
    return enclosing is not None


def _head(copy: Copy) -> str:
    return f"// copied from {copy.definition.name} by misfit\n"


def standalone(copy: Copy) -> str:
    """A copied class outside of its package, with imports for the names that it finds there."""
    lines: list[str] = []
    outer = copy.definition.outer
    while outer is not None:
        lines += [_import_text(entry) for entry in outer.imports]
        lines += _imports_from(outer, copy)
        outer = outer.outer
    known = {entry.alias for entry in copy.definition.imports}
    lines = [line for line in dict.fromkeys(lines) if not any(f"import {alias} " in line for alias in known)]
    home = ".".join(full_name(copy.definition))
    copy.edits.append((copy.definition.header, copy.definition.header, "".join(f"\n  {line}" for line in lines)))
    return f"// copied from {home} by misfit\n{copy.rendered()};\n"


def _imports_from(package: ClassDef, copy: Copy) -> list[str]:
    """Imports of what a copied class uses of a package around it, each by its name: the front end reads no others.

    Of a package that extends another, everything is imported.
    """
    name = ".".join(full_name(package))
    if package.all_bases:
        return [f"import {name}.*;"]
    own = copy.definition
    taken = {*own.components, *own.classes, *(entry.alias for entry in own.imports), own.name}
    tokens = tokens_of(copy.text[slice(*own.span)], "")
    words = {token.text for token in tokens if token.text.isidentifier()} - taken
    return [f"import {name}.{word};" for word in sorted(words) if _holds(package, word)]


def _holds(package: ClassDef, word: str) -> bool:
    if word in package.classes or word in package.components:
        return True
    folder = package.folder
    return folder is not None and ((folder / f"{word}.mo").is_file() or (folder / word / "package.mo").is_file())


def full_name(definition: ClassDef) -> tuple[str, ...]:
    """The full name of a class."""
    outer = full_name(definition.outer) if definition.outer is not None else definition.within
    return (*outer, definition.name)


def _import_text(entry: Import) -> str:
    name = ".".join(entry.name)
    if entry.alias == "*":
        return f"import {name}.*;"
    return f"import {name};" if entry.alias == entry.name[-1] else f"import {entry.alias} = {name};"

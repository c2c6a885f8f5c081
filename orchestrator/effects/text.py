"""The file of a changed class: the user's own text, and the new classes beside the originals."""

from fmus.catalogue import ModelicaModel
from fmus.errors import ModelicaError
from fmus.frontend.lint.scope import View
from fmus.frontend.lint.sources import modelica_text, without_within
from fmus.frontend.lint.tokens import tokens_of
from fmus.frontend.lint.tree import ClassDef, Import
from orchestrator.effects.copies import Copies, Copy, applied, is_stored, outermost


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

"""What a name in a function means: another function, a constant of a package, a literal of an enumeration."""

import re
from collections.abc import Iterator, Sequence
from contextlib import suppress
from itertools import pairwise

from fmus.errors import ModelicaError
from fmus.flat.evaluate import Unknown
from fmus.frontend.lint.parser import parse
from fmus.frontend.lint.scope import Found, View, element_of, type_of
from fmus.frontend.lint.sources import Sources
from fmus.frontend.lint.tokens import tokens_of
from fmus.frontend.lint.tree import ClassDef, Name

_WITHIN = re.compile(r"^\s*within\s+(\w+(?:\.\w+)*)\s*;", re.MULTILINE)
_FIRST = re.compile(
    r"^\s*(?:(?:final|encapsulated|partial|expandable|pure|impure|operator)\s+)*"
    r"(?:package|model|block|class|record|connector|type|function|operator)\s+(\w+)",
    re.MULTILINE,
)
_FUNCTION = re.compile(r"\bfunction\s+(\w+)")


class Names(Sources):
    """The classes of some Modelica texts; a text of a library is read when a class in it is asked for."""

    def __init__(self, texts: Sequence[str]) -> None:
        super().__init__(None, [])
        self._texts: dict[ClassDef, str] = {}
        self._waiting: dict[Name, str] = {}
        self._classes: dict[Name, ClassDef] = {}
        for text in texts:
            within, first = _WITHIN.search(text), _FIRST.search(text)
            if within is None or first is None:
                self._read_text(text)
            else:
                self._waiting.setdefault((*within[1].split("."), first[1]), text)

    def top(self, name: str) -> ClassDef | None:
        """Return the top-level class of a name."""
        return self._class((name,))

    def stored_member(self, package: ClassDef, name: str) -> ClassDef | None:
        """Return the class that has a text of its own within a package."""
        return self._class((*_full_name(package), name))

    def function(self, name: str, scope: View | None) -> View:
        """The function that a name means inside of a class, or that it is in full without one.

        Raises:
            Unknown: if it is not found, or found twice.
        """
        parts = tuple(name.split("."))
        view = self._top_down(parts) if scope is None else type_of(scope, parts)
        if view is None and scope is None:  # the front end leaves out where a model's own functions stand
            found = list(self._anywhere(parts[-1]))
            if len(found) > 1:
                raise Unknown(f"the function {parts[-1]} ({len(found)} of that name)")
            view = View(found[0], self) if found else None
        if view is None:
            raise Unknown(f"the function {parts[-1]}")
        made = view.definition.classes.get("constructor")
        return view if made is None else View(made, self, view)

    def constant(self, name: str, scope: View | None) -> Found | float:
        """The declaration of a constant, or the number of an enumeration's literal.

        Raises:
            Unknown: if there is neither.
        """
        *path, last = name.split(".")
        for home in self._homes(tuple(path), scope):
            while home.definition.short is not None and (base := type_of(home, home.definition.short.type_name)):
                home = base
            if home.definition.is_enumeration and last in (literals := self._literals(home.definition)):
                return float(literals.index(last) + 1)
            found = element_of(home, last)
            if found is not None and "constant" in getattr(found.element, "prefixes", ()):
                return found
            imported = [entry.name for entry in home.definition.imports if not path and entry.alias == last]
            if imported:
                return self.constant(".".join(imported[0]), None)
        raise Unknown(f"the name {name}" + (" in a function" if scope is not None else ""))

    def text_of(self, definition: ClassDef) -> str:
        """The text of a class from its name on."""
        outermost = definition
        while outermost.outer is not None:
            outermost = outermost.outer
        return self._texts[outermost][definition.name_at : definition.span[1]]

    def _homes(self, path: Name, scope: View | None) -> Iterator[View]:
        """Classes that may hold a constant: the one that is named, else all around."""
        if path:
            home = self._top_down(path) if scope is None else type_of(scope, path)
            if home is not None:
                yield home
            return
        while scope is not None:
            yield scope
            definition = scope.definition
            outer = definition.outer or (self.named(definition.within) if definition.within else None)
            scope = scope.outer or (None if outer is None else View(outer, self))

    def _top_down(self, parts: Name) -> View | None:
        top = self.top(parts[0])
        if top is None or len(parts) == 1:
            return None if top is None else View(top, self)
        return type_of(View(top, self), parts[1:])

    def _literals(self, definition: ClassDef) -> list[str]:
        depth, found = 0, []
        for before, token in pairwise(tokens_of(self.text_of(definition), "")):
            depth += (token.text == "(") - (token.text == ")")
            if token.kind == "name" and before.text in ("(", ",") and depth == 1:
                found.append(token.text)
        return found

    def _anywhere(self, name: str) -> Iterator[ClassDef]:
        for place, text in list(self._waiting.items()):
            if any(found[1] == name for found in _FUNCTION.finditer(text)):
                self._class(place)
        for definition in self._texts:
            yield from _functions_in(definition, name)

    def _class(self, name: Name) -> ClassDef | None:
        if name in self._waiting:
            self._read_text(self._waiting.pop(name))
        return self._classes.get(name)

    def _read_text(self, text: str) -> None:
        with suppress(ModelicaError):
            for definition in parse(text, "source"):
                self._classes.setdefault((*definition.within, definition.name), definition)
                self._texts[definition] = text


def _full_name(definition: ClassDef) -> Name:
    outer = definition.within if definition.outer is None else _full_name(definition.outer)
    return (*outer, definition.name)


def _functions_in(definition: ClassDef, name: str) -> Iterator[ClassDef]:
    if definition.kind == "function" and definition.name == name:
        yield definition
    for inner in definition.classes.values():
        yield from _functions_in(inner, name)

"""What a name means inside a class: nested, inherited, imported or enclosing declarations, and redeclared ones."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Optional

from fmus.frontend.lint.sources import Sources
from fmus.frontend.lint.tree import ClassDef, Component, Extends, Modifier, Name

# Deeper chains of classes are circular; the front end has the words for that.
DEPTH_LIMIT = 40

BUILT_IN = {name: ClassDef(name, "type", 0, "") for name in ("Real", "Integer", "Boolean", "String")}


@dataclass(frozen=True)
class Redeclared:
    """A redeclared element and the class in which its new type is to be looked up."""

    element: ClassDef | Component
    scope: "View"


@dataclass(frozen=True, eq=False)
class View:
    """A class as seen through the redeclarations that apply to it."""

    definition: ClassDef
    sources: Sources
    outer: Optional["View"] = None
    redeclared: Mapping[str, Redeclared] = field(default_factory=dict)

    def with_redeclared(self, more: Mapping[str, Redeclared]) -> "View":
        """Return this class with further redeclarations, which win over its own."""
        return View(self.definition, self.sources, self.outer, {**self.redeclared, **more}) if more else self


@dataclass(frozen=True)
class Found:
    """An element with the class that declares it; `inherited` if that is not the class that was asked."""

    element: ClassDef | Component
    home: View
    inherited: bool


def element_of(view: View, name: str, depth: int = 0) -> Found | None:
    """Return the element of a class or of its bases."""
    own = view.definition.components.get(name) or view.definition.classes.get(name)
    if own is not None:
        return Found(own, view, False)
    for base in bases_of(view, depth + 1):
        found = element_of(base, name, depth + 1)
        if found is not None:
            return Found(found.element, found.home, True)
    return None


def element_names(view: View, depth: int = 0) -> list[str]:
    """List the names of all elements, inherited ones included."""
    names = [*view.definition.components, *view.definition.classes]
    for base in bases_of(view, depth + 1):
        names += element_names(base, depth + 1)
    return names


def is_complete(view: View, depth: int = 0) -> bool:
    """Tell whether all base classes can be found, so that a name that is not found does not exist."""
    bases = bases_of(view, depth)
    return len(bases) == len(view.definition.all_bases) and all(is_complete(base, depth + 1) for base in bases)


def bases_of(view: View, depth: int = 0) -> list[View]:
    """Return the base classes that can be found, with the redeclarations that reach them."""
    if depth > DEPTH_LIMIT:
        return []
    found = []
    for extends in view.definition.all_bases:
        base = base_of(view, extends, depth)
        if base is not None:
            found.append(base)
    return found


def base_of(view: View, extends: Extends, depth: int = 0) -> View | None:
    """Return one base class, with the redeclarations of this class and of its extends clause."""
    base = type_of(view, extends.type_name, depth, inherited=False)
    if base is None:
        return None
    own = {name: Redeclared(c, view) for name, c in view.definition.classes.items() if "redeclare" in c.prefixes}
    return base.with_redeclared({**redeclarations(extends.modifiers, view), **own, **view.redeclared})


def redeclarations(modifiers: list[Modifier], scope: View) -> dict[str, Redeclared]:
    """Return the redeclared elements of a list of modifiers."""
    return {m.name[0]: Redeclared(m.redeclared, scope) for m in modifiers if m.redeclared is not None}


def component_type(found: Found) -> View | None:
    """Return the class of a component, the redeclared one where there is one."""
    component = found.element
    assert isinstance(component, Component)
    new = found.home.redeclared.get(component.name)
    if new is not None and isinstance(new.element, Component):
        return type_of(new.scope, new.element.type_name)
    return type_of(found.home, component.type_name)


def type_of(view: View, name: Name, depth: int = 0, inherited: bool = True) -> View | None:
    """Return the class that a dotted name means inside a class; None if it cannot be found."""
    if depth > DEPTH_LIMIT:
        return None
    found = _first(view, name[0], depth, inherited)
    for part in name[1:]:
        if found is None:
            return None
        found = _member(found, part, depth + 1, True)
    return found


def _first(view: View, name: str, depth: int, inherited: bool) -> View | None:
    if name in BUILT_IN:
        return View(BUILT_IN[name], view.sources)
    scope: View | None = view
    while scope is not None:
        found = _member(scope, name, depth + 1, inherited) or _imported(scope, name, depth + 1)
        if found is not None:
            return found
        scope, inherited = _enclosing(scope), True
    top = view.sources.top(name)
    return None if top is None else View(top, view.sources)


def _enclosing(view: View) -> View | None:
    if view.outer is not None:
        return view.outer
    definition = view.definition
    outer = definition.outer or (view.sources.named(definition.within) if definition.within else None)
    return None if outer is None else View(outer, view.sources)


def _member(view: View, name: str, depth: int, inherited: bool) -> View | None:
    """Return a class declared in a class: redeclared, its own, stored beside it or inherited."""
    new = view.redeclared.get(name)
    if new is not None and isinstance(new.element, ClassDef):
        short = new.element.short
        return None if short is None else type_of(new.scope, short.type_name, depth + 1)
    nested = view.definition.classes.get(name) or view.sources.stored_member(view.definition, name)
    if nested is not None:
        return View(nested, view.sources, view)
    if not inherited:
        return None
    for base in bases_of(view, depth + 1):
        found = _member(base, name, depth + 1, True)
        if found is not None:
            return found
    return None


def _imported(view: View, name: str, depth: int) -> View | None:
    for entry in view.definition.imports:
        target = (*entry.name, name) if entry.alias == "*" else entry.name
        if entry.alias in ("*", name):
            top = view.sources.top(target[0])
            found = None if top is None else View(top, view.sources)
            for part in target[1:]:
                found = None if found is None else _member(found, part, depth + 1, True)
            if found is not None:
                return found
    return None

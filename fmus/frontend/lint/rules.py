"""The rules: what rumoca 0.10.2 drops or misreads without a word, found by probes (see tests/fmus/test_lint.py)."""

import difflib
from typing import NoReturn

from fmus.errors import ModelicaError
from fmus.frontend.lint.scope import (
    BUILT_IN,
    Found,
    View,
    base_of,
    bases_of,
    component_type,
    element_names,
    element_of,
    is_complete,
    redeclarations,
    type_of,
)
from fmus.frontend.lint.tree import ClassDef, Component, Extends, Modifier

_ATTRIBUTES = "quantity unit displayUnit min max start fixed nominal unbounded stateSelect uncertain"
ATTRIBUTES = frozenset(_ATTRIBUTES.split())


def refuse(file: str, line: int, what: str) -> NoReturn:
    """Raise the linter's message."""
    raise ModelicaError(f"{file}:{line}: {what}")


class ModifierRules:
    """Checks the modifiers of one class; `scope` is that class."""

    def __init__(self, scope: View) -> None:
        self.scope, self.file = scope, scope.definition.file

    def refuse(self, line: int, what: str) -> NoReturn:
        """Raise the linter's message for a line of the class's file."""
        refuse(self.file, line, what)

    def check_base(self, extends: Extends) -> None:
        """Check the modifiers of an extends clause or of a short class."""
        base = base_of(self.scope, extends)
        if base is not None:
            self._check(extends.modifiers, base, is_base=True, depth=0)

    def check_component(self, component: Component) -> None:
        """Check the modifiers of a declared component."""
        target = type_of(self.scope, component.type_name)
        if target is not None:
            self._check(component.modifiers, target, is_base=False, depth=0)

    def check_constraint(self, element: ClassDef | Component) -> None:
        """Refuse modifiers in a constraining clause."""
        constraint = element.constraint
        if constraint is not None and constraint.modifiers:
            base = ".".join(constraint.type_name)
            self.refuse(
                constraint.modifiers[0].line,
                f"the modifiers of 'constrainedby {base}(...)' would be ignored; "
                f"give the values in a class that extends {base} and constrain by that class",
            )

    def check_redeclared_in_body(self, new: ClassDef | Component) -> None:
        """Check `redeclare model X = Y(...)` among the declarations of a class, where its modifiers do arrive."""
        found = [f for base in bases_of(self.scope) if (f := element_of(base, new.name)) is not None]
        if not found:
            names = [name for base in bases_of(self.scope) for name in element_names(base)]
            return self._unknown(Modifier((new.name,), new.line), self.scope, names)
        self._loses_first_modifiers(new, found[0])

    def _check(self, modifiers: list[Modifier], target: View, is_base: bool, depth: int) -> None:
        target = target.with_redeclared(redeclarations(modifiers, self.scope))
        for modifier in modifiers:
            if modifier.redeclared is not None:
                self._redeclaration(modifier, modifier.redeclared, target, is_base, depth)
            else:
                self._modification(modifier, target, depth)

    def _modification(self, modifier: Modifier, target: View, depth: int) -> None:
        name = modifier.name[0]
        if len(modifier.name) > 1:
            first, last = ".".join(modifier.name[:-1]), modifier.name[-1]
            self.refuse(modifier.line, f"write '{first}({last} = ...)' instead of '{first}.{last} = ...'")
        if _is_simple(target):
            if name not in ATTRIBUTES:
                self._unknown(modifier, target, sorted(ATTRIBUTES))
            return
        found = element_of(target, name)
        if found is None:
            self._unknown(modifier, target, element_names(target))
        elif isinstance(found.element, Component):
            inner = component_type(found)
            if inner is not None:
                self._check(modifier.sub, inner, is_base=False, depth=depth + 1)
        else:
            self.refuse(
                modifier.line,
                f"the modifiers of the class '{name}' would be dropped; modify the component of this class instead",
            )

    def _unknown(self, modifier: Modifier, target: View, known: list[str]) -> None:
        """Refuse a name; if a base class is not found either, the front end tells so."""
        if not is_complete(target):
            return
        name, owner = modifier.name[0], target.definition.name
        if name in (found := [k for k in known if k.lower() == name.lower()]) or not found:
            found = difflib.get_close_matches(name, known, 1)
        hint = f"; did you mean '{found[0]}'?" if found else "; remove it"
        self.refuse(modifier.line, f"'{name}' is not an element of {owner}{hint}")

    def _redeclaration(
        self, modifier: Modifier, new: ClassDef | Component, target: View, is_base: bool, depth: int
    ) -> None:
        self._refuse_nested(modifier, new, depth)
        found = element_of(target, modifier.name[0])
        if found is None:
            return self._unknown(modifier, target, element_names(target))
        if "replaceable" not in found.element.prefixes:
            self.refuse(modifier.line, f"'{new.name}' cannot be redeclared; it is not declared as replaceable")
        if isinstance(new, ClassDef):
            self._redeclared_class(modifier, new, found)
        else:
            self._redeclared_component(modifier, new, found, is_base)

    def _refuse_nested(self, modifier: Modifier, new: ClassDef | Component, depth: int) -> None:
        if depth:
            self.refuse(
                modifier.line,
                f"the redeclaration of '{new.name}' inside the modifiers of a part would be dropped; declare a class "
                f"that extends the part's class with this redeclaration, and use that class for the part",
            )

    def _redeclared_class(self, modifier: Modifier, new: ClassDef, found: Found) -> None:
        if new.short is not None and new.short.modifiers:
            base = ".".join(new.short.type_name)
            self.refuse(
                modifier.line,
                f"the modifiers of 'redeclare {new.kind} {new.name} = {base}(...)' would be dropped; write "
                f"'redeclare {new.kind} {new.name} = {base}' and modify the component of this class beside it",
            )

        self._loses_first_modifiers(new, found)

    def _loses_first_modifiers(self, new: ClassDef | Component, found: Found) -> None:
        """Without a constraining clause the modifiers of the first declaration should stay, but they are dropped."""
        old = found.element
        if isinstance(old, ClassDef) and old.short is not None and old.short.modifiers and old.constraint is None:
            base, first = ".".join(old.short.type_name), ".".join(old.short.modifiers[0].name)
            self.refuse(
                new.line,
                f"redeclaring '{new.name}' would lose the value of '{first}' that its first declaration gives it; "
                f"give the value to a component, or add 'constrainedby {base}' there to say that it may be lost",
            )

    def _redeclared_component(self, modifier: Modifier, new: Component, found: Found, is_base: bool) -> None:
        if is_base and found.inherited:
            owner = found.home.definition.name
            self.refuse(
                modifier.line,
                f"the redeclaration of '{new.name}' would be dropped, because {owner}, and not the extended class, "
                f"declares it; extend {owner} itself, or make it a replaceable model in {owner}",
            )
        if new.value is not None:
            self.refuse(
                modifier.line, f"the value of the redeclared '{new.name}' would be dropped; write '{new.name} = ...'"
            )
        self._keep_all_modifiers(modifier, new, found)
        target = type_of(self.scope, new.type_name)
        if target is not None:
            self._check(new.modifiers, target, is_base=False, depth=1)

    def _keep_all_modifiers(self, modifier: Modifier, new: Component, found: Found) -> None:
        """With a constraining clause the original's modifiers should go, but the front end keeps them."""
        old = found.element
        if not isinstance(old, Component) or old.constraint is None:
            return
        given = {m.name[0] for m in new.modifiers}
        kept = [m.name[0] for m in old.modifiers if m.name[0] not in given]
        if kept:
            self.refuse(
                modifier.line,
                f"the redeclared '{new.name}' would keep the value of '{kept[0]}' from its first declaration; "
                f"give '{kept[0]}' a value here",
            )


def _is_simple(view: View) -> bool:
    """Tell whether a class is Real, Integer, Boolean, String, an enumeration, or is short for one of them or extends it."""
    seen = 0
    while not view.definition.components and len(view.definition.all_bases) == 1 and seen < 20:
        base = base_of(view, view.definition.all_bases[0])
        if base is None:
            return False
        view, seen = base, seen + 1
    return view.definition.name in BUILT_IN and not view.definition.line or view.definition.is_enumeration

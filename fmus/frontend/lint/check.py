"""Walk over the classes that a model reaches and apply the rules to each."""

from collections.abc import Mapping
from pathlib import Path

from fmus.errors import ModelicaError
from fmus.frontend.lint.parser import parse
from fmus.frontend.lint.rules import ModifierRules
from fmus.frontend.lint.scope import View, base_of, component_type, element_of, type_of
from fmus.frontend.lint.sources import NO_PACKAGES, Sources, modelica_text
from fmus.frontend.lint.tree import ClassDef, Component, Modifier, Name


def lint_class(model: str, file: Path | None, roots: list[Path], packages: Mapping[str, Path] = NO_PACKAGES) -> None:
    """Refuse what the front end would drop or misread without a word.

    Args:
        model: full name of the class.
        file: the file that declares it; None for a class below `roots`.
        roots: folders that contain the libraries' top-level packages.
        packages: folders or files of further top-level classes, by name.

    Raises:
        ModelicaError: `file:line: what is wrong, and what to write instead`, also for syntax errors.
    """
    sources = Sources(file, roots, packages)
    name = tuple(model.split("."))
    definition = sources.named(name)
    if definition is not None:
        _Walk(sources).visit(View(definition, sources))
    elif file is not None:
        known = [d.name for d in parse(modelica_text(file), file.name)]
        raise ModelicaError(
            f"{file.name}:1: there is no class '{model}'; the file declares {', '.join(known) or 'none'}"
        )


class _Walk:
    """Visits each class once; classes that cannot be found are left to the front end's own message."""

    def __init__(self, sources: Sources) -> None:
        self.sources = sources
        self.seen: set[ClassDef] = set()

    def visit(self, view: View | None) -> None:
        if view is None or view.definition in self.seen:
            return
        self.seen.add(view.definition)
        rules = ModifierRules(view)
        for extends in view.definition.all_bases:
            rules.check_base(extends)
            self.visit(base_of(view, extends))
            self._visit_redeclared(view, extends.modifiers)
        for component in view.definition.components.values():
            rules.check_constraint(component)
            rules.check_component(component)
            if "redeclare" in component.prefixes:
                rules.check_redeclared_in_body(component)
            self._visit_component(view, component)
        for nested in view.definition.classes.values():
            rules.check_constraint(nested)
            if "redeclare" in nested.prefixes:
                rules.check_redeclared_in_body(nested)
            if view.definition.kind != "package":
                self.visit(View(nested, self.sources, view))

    def _visit_component(self, view: View, component: Component) -> None:
        found = element_of(view, component.name)
        self.visit(None if found is None else component_type(found))
        self._visit_redeclared(view, component.modifiers)

    def _visit_redeclared(self, view: View, modifiers: list[Modifier]) -> None:
        for modifier in modifiers:
            name = _new_type(modifier.redeclared)
            if name is not None:
                self.visit(type_of(view, name))


def _new_type(redeclared: ClassDef | Component | None) -> Name | None:
    if isinstance(redeclared, Component):
        return redeclared.type_name
    return None if redeclared is None or redeclared.short is None else redeclared.short.type_name

"""Array constructors whose length is not the declared one: why a model did not compile."""

from collections.abc import Iterator

from fmus.frontend.lint.scope import View, bases_of, component_type, element_of
from fmus.frontend.lint.sources import Sources
from fmus.frontend.lint.tree import Component, Modifier, Value


def wrong_sizes(model: str, sources: Sources) -> Iterator[str]:
    """Yield `file:line: message` for each array of the wrong length in a class and its bases.

    Sizes are taken from the declarations and from the same list of modifiers, so this explains a failure; a model
    that compiles may set a size elsewhere.
    """
    definition = sources.named(tuple(model.split(".")))
    if definition is not None:
        yield from _in_class(View(definition, sources), 0)


def _in_class(view: View, depth: int) -> Iterator[str]:
    file = view.definition.file
    for component in view.definition.components.values():
        if component.value is not None:
            yield from _mismatch(component, component.value, view, {}, file)
        found = element_of(view, component.name)
        target = None if found is None else component_type(found)
        if target is not None and not component.sizes:  # parts in an array take one value each
            yield from _in_modifiers(component.modifiers, target, file)
    if depth < 10:
        for extends, base in zip(view.definition.all_bases, bases_of(view), strict=False):
            yield from _in_modifiers(extends.modifiers, base, file)
            yield from _in_class(base, depth + 1)


def _in_modifiers(modifiers: list[Modifier], target: View, file: str) -> Iterator[str]:
    given = {m.name[0]: m.value.text for m in modifiers if m.value is not None}
    for modifier in modifiers:
        found = element_of(target, modifier.name[0])
        if found is None or not isinstance(found.element, Component):
            continue
        if modifier.value is not None:
            yield from _mismatch(found.element, modifier.value, found.home, given, file)
        inner = component_type(found)
        if inner is not None and not found.element.sizes:
            yield from _in_modifiers(modifier.sub, inner, file)


def _mismatch(component: Component, value: Value, home: View, given: dict[str, str], file: str) -> Iterator[str]:
    if value.length is None:
        return
    if not component.sizes:
        target = home.definition.name
        if not component.prefixes & {"replaceable"}:
            yield f"{file}:{value.line}: '{component.name}' of {target} is a scalar, but {value.length} values are given"
        return
    declared = _size(component.sizes[0], home, given)
    if declared is not None and declared != value.length:
        yield (
            f"{file}:{value.line}: '{component.name}' has {declared} elements, but {value.length} values are given; "
            "make both the same"
        )


def _size(text: str, home: View, given: dict[str, str]) -> int | None:
    if text.isdigit():
        return int(text)
    if text in given:
        return int(given[text]) if given[text].isdigit() else None
    found = element_of(home, text)
    if found is None or not isinstance(found.element, Component) or found.element.value is None:
        return None
    default = found.element.value.text
    return int(default) if default.isdigit() else None

"""Something between an input or an output of a model and its plant: the class in between has the plant's own variable."""

import re

from fmus.errors import ModelicaError
from fmus.frontend.lint.scope import View
from fmus.frontend.lint.tokens import tokens_of
from fmus.frontend.lint.tree import Component
from fmus.symbolic.system import SymbolicSystem
from orchestrator.effects.changes import InputChange, OutputChange
from orchestrator.effects.copies import MARK, Copies, Copy
from orchestrator.effects.homes import Home, homes_at
from orchestrator.effects.names import plain, uses


def change_input(copies: Copies, root: View, change: InputChange, system: SymbolicSystem) -> tuple[Copy, str]:
    """Let the plant use what acts on it instead of an input.

    Returns:
        The copy that declares it, and its flat name.

    Raises:
        ModelicaError: if the model does not use the input, or does so where it cannot be changed.
    """
    name = plain(change.input)
    home, component = _declaration(root, name, change.input)
    inner = _free(f"{name}Actual", root)
    users = _users(root, name, home, component)
    if not users:
        raise ModelicaError(f"no equation of {root.definition.name} uses '{change.input}'")
    for user in users:
        _rename(copies.of(user), user, name, inner, component if user.definition is home.definition else None)
    copy = copies.of(users[-1])  # the most basic class that uses it; what extends it inherits the variable
    sizes, value = _sizes(component), change.expression
    if sizes:
        value = _with_element(change.input, change.expression, [v.name for v in system.inputs])
    variables = (*system.inputs, *system.parameters)
    unit = next((v.unit for v in variables if v.name == change.input), "")
    attributes = f'({"each " if sizes else ""}unit="{unit}")' if unit else ""
    text = f"Real {inner}{sizes}{attributes} = {value}"
    copy.declarations.append(f'{text} "acts instead of {name}: {change.title}";  // {MARK}')
    return copy, change.input.replace(name, inner, 1)


def change_output(copies: Copies, root: View, change: OutputChange, system: SymbolicSystem) -> tuple[Copy, str]:
    """Give the plant's own variable another name, and let the output show the changed one.

    Args:
        copies: the copies of classes that are changed.
        root: the model.
        change: the output, and the expression that it shows from now on.
        system: the model's equations.

    Returns:
        The copy that declares the output, and the flat name of the plant's own variable.

    Raises:
        ModelicaError: if the output's declaration or a use of it cannot be changed.
    """
    name = plain(change.output)
    home, component = _declaration(root, name, change.output)
    inner = _free(f"{name}Actual", root)
    copy = copies.of(home)
    own = copy.text[slice(*component.span)]
    prefixes = copy.text[component.clause[0] : component.type_span[0]]
    kind = copy.text[component.type_span[0] : component.type_span[1]]
    plant = f"{re.sub(r'output *', '', prefixes)}{_plain_type(kind)} {inner}{own[len(name) :].strip()};"
    copy.replaced.append((component, plant))
    for user in _users(root, name, home, component):
        _rename(copies.of(user), user, name, inner, component if user.definition is home.definition else None)
    expression = re.sub(rf"(?<![\w.]){re.escape(name)}\b", inner, change.expression)
    sizes = _sizes(component)
    if sizes:
        expression = _with_element(
            change.output.replace(name, inner, 1),
            expression,
            [v.replace(name, inner, 1) for v in system.outputs if plain(v) == name],
        )
    variable = next((v for v in (*system.states, *system.algebraics) if v.name == change.output), None)
    unit = variable.unit if variable is not None else ""
    attributes = f'({"each " if sizes else ""}unit="{unit}")' if unit else ""
    copy.declarations.append(f'output Real {name}{sizes}{attributes} = {expression} "{change.title}";  // {MARK}')
    return copy, change.output.replace(name, inner, 1)


def _declaration(root: View, name: str, full: str) -> tuple[Home, Component]:
    if "." in name:
        raise ModelicaError(
            f"'{full}' belongs to a part of the model; only an input, an output or a parameter of the model itself can be made to change"
        )
    for home in homes_at(root, ()):
        if name in home.definition.components:
            return home, home.definition.components[name]
    raise ModelicaError(f"{root.definition.name} has no input, output or parameter '{full}'")


def _users(root: View, name: str, home: Home, component: Component) -> list[Home]:
    """The classes of the model itself that use a variable, most derived first."""
    found = []
    for other in homes_at(root, ()):
        text = _text(other)
        if uses(
            text,
            other.definition,
            name,
            component.span if other is home or other.definition is home.definition else None,
        ):
            found.append(other)
    return found


def _text(home: Home) -> str:
    from fmus.frontend.lint.sources import modelica_text
    from orchestrator.effects.copies import file_of

    return modelica_text(file_of(home.definition))


def _rename(copy: Copy, home: Home, name: str, inner: str, own: Component | None) -> None:
    """Let a class use another variable; connections become equations, as the other variable is no connector."""
    for span, around in uses(copy.text, home.definition, name, own.span if own is not None else None):
        if around == "connect":
            copy.edits.append(_equation_of(copy.text, span[0], name, inner))
        else:
            copy.edits.append((*span, inner))


def _equation_of(text: str, place: int, name: str, inner: str) -> tuple[int, int, str]:
    """`connect(u, gain.u)` as `gain.u = uActual`."""
    first = text.rfind("connect", 0, place)
    tokens = tokens_of(text[first:], "")
    depth, k = 0, 1
    while True:
        depth += (tokens[k].text == "(") - (tokens[k].text == ")")
        if depth == 0:
            break
        k += 1
    inside = text[first + tokens[1].end : first + tokens[k].start]
    left, _, right = inside.partition(",")
    ends = [part.strip() for part in (left, right)]
    ends = [inner + end[len(name) :] if re.match(rf"{re.escape(name)}\b(?!\.)", end) else end for end in ends]
    return first, first + tokens[k].end, f"{ends[0]} = {ends[1]}"


def _free(name: str, root: View) -> str:
    taken = {component for home in homes_at(root, ()) for component in home.definition.components}
    return next(n for n in (name, *(f"{name}{k}" for k in range(2, 99))) if n not in taken)


def _sizes(component: Component) -> str:
    return f"[{', '.join(component.sizes)}]" if component.sizes else ""


def _plain_type(kind: str) -> str:
    """The type of a variable that is no connector any more."""
    return "Real" if kind.split(".")[-1] in ("RealOutput", "RealInput") else kind


def _with_element(full: str, expression: str, elements: list[str]) -> str:
    """An array of which one element is an expression."""
    array = [name for name in elements if plain(name) == plain(full)]
    return "{" + ", ".join(expression if name == full else name for name in array) + "}"

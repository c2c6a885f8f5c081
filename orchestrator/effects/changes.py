"""What is added to a model: a term of a balance equation, or something between an input or output and the plant."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

from orchestrator.effects.names import replaced


@dataclass(frozen=True)
class Parameter:
    """A parameter that a change brings with it."""

    value: float
    unit: str
    description: str


@dataclass(frozen=True)
class AddedState:
    """A state that a change brings with it. It starts with a value, or with `begins`, an expression."""

    name: str
    unit: str
    start: float
    derivative_expression: str
    begins: str = ""


@dataclass(frozen=True)
class Term:
    """A law added to the balance equation of a state.

    `state` is its name in the flat model, such as `body.v`. `place` is `file.mo:12` as the front end reports the
    equation; empty if it is not known. `expression` is Modelica in names of the flat model and of the own parameters
    and states; a positive value adds to der(state), in the unit of the equation as it is written, or, if that is the equation
    of a `force`, to the force.
    """

    state: str
    place: str
    expression: str
    parameters: Mapping[str, Parameter]
    title: str
    states: Sequence[AddedState] = field(default=())
    force: str = ""


@dataclass(frozen=True)
class InputChange:
    """What acts on the plant instead of an input or a parameter: an expression of its name."""

    input: str
    expression: str
    parameters: Mapping[str, Parameter]
    title: str
    states: Sequence[AddedState] = field(default=())


@dataclass(frozen=True)
class OutputChange:
    """What a sensor shows instead of an output: an expression of the output's name."""

    output: str
    expression: str
    parameters: Mapping[str, Parameter]
    title: str
    states: Sequence[AddedState] = field(default=())


Change = Term | InputChange | OutputChange


def merged(changes: Sequence[Change]) -> list[Change]:
    """The changes in their order, those of one signal as one, where the first of them stands.

    A sensor that is late and has a wrong zero shows f2(f1(y)): the text of the second change speaks of the first one's value.
    """
    found: dict[tuple[type, str | int], Change] = {}
    for number, change in enumerate(changes):
        key = (type(change), number if isinstance(change, Term) else _signal(change))
        before = found.get(key)
        found[key] = change if before is None or isinstance(change, Term) else _behind(before, change)
    return list(found.values())


def _signal(change: InputChange | OutputChange) -> str:
    return change.input if isinstance(change, InputChange) else change.output


def _behind(first: Change, second: InputChange | OutputChange) -> Change:
    """One change that does what two do, one after the other."""
    name, expression = _signal(second), f"({first.expression})"

    def of_first(text: str) -> str:
        return replaced(text, lambda each: expression if each.replace(" ", "") == name else each)

    states = [
        replace(s, derivative_expression=of_first(s.derivative_expression), begins=of_first(s.begins))
        for s in second.states
    ]
    return replace(
        second,
        expression=of_first(second.expression),
        parameters={**first.parameters, **second.parameters},
        title=f"{first.title}, and {second.title}",
        states=[*first.states, *states],
    )

"""What is added to a model: a term of a balance equation, or something between an input or output and the plant."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field


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
    and states; a positive value adds to der(state), in the unit of the equation as it is written.
    """

    state: str
    place: str
    expression: str
    parameters: Mapping[str, Parameter]
    title: str
    states: Sequence[AddedState] = field(default=())


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

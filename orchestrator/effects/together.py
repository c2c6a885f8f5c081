"""Several changes of one input, output or parameter as one: each acts on what the one before it makes of the signal."""

from collections.abc import Sequence
from dataclasses import replace

from orchestrator.effects.changes import Change, InputChange, OutputChange, Term
from orchestrator.effects.names import replaced


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

"""Constructs of the front end's representation that the translator cannot express, each refused with its place."""

from collections.abc import Iterator, Mapping
from typing import Any

from fmus.errors import ModelicaError
from fmus.symbolic.arena import Arena
from fmus.symbolic.reduction import Reduced

# What to write instead, by the beginning of the words.
REWRITES = {
    "a clock": "write 'when sample(start, period)' with numbers for its times, or make it a component of `misfit run`",
    "a when": "write it as a when equation",
    "terminate": "remove it; a run ends where its recording ends",
    "the discrete": "write the equations of its elements one by one",
    "previous": "put what is sampled beside the model, as a component of `misfit run`",
}

ACTIONS = {"terminate": "terminate"}


def refuse_unsupported(arena: Arena) -> None:
    """Raise ModelicaError for the first construct that would be lost, with file and line of each one's first use."""
    found = list(dict.fromkeys(_unsupported(arena)))
    if found:
        place, words = found[0]
        others = [f"{other} ({where})" if where else other for where, other in found[1:4]]
        also = f"; so are {', '.join(others)}" if others else ""
        advice = next((f"; {text}" for begin, text in REWRITES.items() if words.startswith(begin)), "")
        text = f"{words} is not supported{also}{advice}"
        raise ModelicaError(f"{place}: {text}" if place else text)


def _unsupported(arena: Arena) -> Iterator[tuple[str, str]]:
    """Place and words, most telling constructs first."""
    storage = arena.storage
    for entry in storage["clocks"]:
        if not _is_periodic(entry):
            yield arena.where(entry["provenance"]), "a clock"
    for entry in storage["event_actions"]:
        kind = next(iter(entry["kind"])) if isinstance(entry["kind"], dict) else entry["kind"]
        if kind in ("assert", "warning", "reinitialize"):
            continue  # a check, no equation; or handled as an event
        yield arena.where(entry["provenance"]), f"{ACTIONS.get(kind, kind)}()"
    for entry in storage["discrete_value_owners"]:
        if entry["structure"] is not None:
            names = ", ".join(arena.variables[target]["name"] for target in entry["targets"])
            yield arena.where(entry["provenance"]), f"the discrete variable {names}"
    for key, words in (
        ("model_event_transactions", "a when clause in an algorithm"),
        ("previous_values", "previous()"),
        ("terminals", "terminal()"),
    ):
        for entry in storage.get(key) or ():
            yield _place(arena, entry), words


def _is_periodic(clock: Mapping[str, Any]) -> bool:
    """Whether a clock is a sample() with numbers for its times."""
    kind = clock["kind"]
    if not isinstance(kind, Mapping) or "periodic" not in kind:
        return False
    return kind["periodic"].get("anchor") == "absolute" and "lattice" in kind["periodic"]


def _place(arena: Arena, entry: Any) -> str:
    return arena.where(entry.get("provenance")) if isinstance(entry, Mapping) else ""


def refuse_lost_states(reduced: Reduced) -> None:
    """Raise ModelicaError for a variable that has to be a state and is none, as no equation has its derivative."""
    for quantity in reduced.algebraics:
        if quantity.select == "always":
            place = f"{quantity.place}: " if quantity.place else ""
            raise ModelicaError(
                f"{place}{quantity.name} has StateSelect.always, but the states are "
                f"{', '.join(q.name for q in reduced.states)}; write its equation with der({quantity.name})"
            )

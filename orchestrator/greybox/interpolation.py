"""Whether inputs are held from sample to sample or run in straight lines, asked again with what was found in the model."""

from collections.abc import Sequence

import numpy as np

from fmus.errors import ComponentError
from orchestrator.greybox.decide import beyond_doubt
from orchestrator.greybox.search import FittedSet, Setting, refitted


class RunsOtherwise(Exception):
    """Stops a search: some inputs run otherwise between samples than it assumes; `gains` are the nats that the record gains by input."""

    def __init__(self, gains: dict[str, float]) -> None:
        super().__init__(f"other inputs are held: {', '.join(gains)}")
        self.gains = gains


def held_otherwise(setting: Setting, chosen: FittedSet, asked: Sequence[str]) -> dict[str, float]:
    """Inputs that run otherwise between samples than was assumed, by the likelihood of a fitted set.

    A model that lacks much predicts so badly that half a sample of an input makes no difference; with what it lacked, it does.

    Args:
        setting: the model and the trials, with the inputs that are held.
        chosen: the set.
        asked: names of inputs that were measured and whose course between samples nobody has said.

    Returns:
        By input the nats that the record gains beyond doubt, each with those before it turned.
    """
    held, best, found = list(setting.held), chosen, dict[str, float]()
    for name in asked:
        other = _turned(held, name)
        again = _fitted(setting, chosen, other)
        if again is not None and beyond_doubt(again, best, setting.thresholds):
            found[name] = best.loss - again.loss
            held, best = other, again
    return found


def held_for_nothing(setting: Setting, chosen: FittedSet, turned: Sequence[str]) -> dict[str, float]:
    """Inputs of those that a search turned whose course the set that it came to does not need: half a sample less of a delay
    was as good. By input the nats that turning it back costs."""
    found = {}
    for name in turned:
        again = _fitted(setting, chosen, _turned(setting.held, name))
        if again is not None and not beyond_doubt(chosen, again, setting.thresholds):
            found[name] = chosen.loss - again.loss
    return found


def _turned(held: Sequence[str], name: str) -> list[str]:
    return [each for each in held if each != name] if name in held else [*held, name]


def _fitted(setting: Setting, chosen: FittedSet, held: Sequence[str]) -> FittedSet | None:
    """The set with these inputs held; None if the model does not run so, and the answer stands."""
    try:
        with np.errstate(all="ignore"):  # what leaves the finite numbers counts as impossible
            return refitted(setting, chosen, held)
    except (RuntimeError, ArithmeticError, LookupError, ValueError, ComponentError):
        return None

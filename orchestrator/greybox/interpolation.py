"""Whether inputs are held from sample to sample or run in straight lines, asked again with what was found in the model."""

from collections.abc import Sequence

import numpy as np

from fmus.errors import ComponentError
from orchestrator.greybox.diagnose import Outcome
from orchestrator.greybox.search import refitted


def held_otherwise(outcome: Outcome, asked: Sequence[str]) -> dict[str, float]:
    """Inputs that run otherwise between samples than was assumed, by the likelihood of the chosen set.

    A model that lacks much predicts so badly that half a sample of an input makes no difference; with what it lacked, it does.

    Args:
        outcome: a search that is over.
        asked: names of inputs that were measured and whose course between samples nobody has said.

    Returns:
        By input the nats that the record gains, each with those before it turned.
    """
    setting, chosen = outcome.setting, outcome.decision.chosen
    held, loss, found = list(setting.held), chosen.loss, dict[str, float]()
    for name in asked:
        other = [each for each in held if each != name] if name in held else [*held, name]
        try:
            with np.errstate(all="ignore"):  # what leaves the finite numbers counts as impossible
                again = refitted(setting, chosen, other).loss
        except (RuntimeError, ArithmeticError, LookupError, ValueError, ComponentError):
            continue  # the model does not run so, and the answer stands
        if loss - again > setting.thresholds.nats:
            found[name] = loss - again
            held, loss = other, again
    return found

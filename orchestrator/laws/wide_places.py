"""Places of a model with all that a missing force there may depend on: further states and inputs as coordinates of their own."""

import re

import numpy as np

from orchestrator.greybox.evidence import Case
from orchestrator.greybox.fit import Fit
from orchestrator.greybox.places import Place, balance_places, with_others
from orchestrator.greybox.prepare import seen_by

# Models with more balances than this are searched at single balances only.
MOST_FOR_PAIRS = 4
MOST_FURTHER = 6


def wide_places(case: Case, fit: Fit) -> list[Place]:
    """The balances of a model, and what lies between them, with further variables that move as coordinates."""
    seen = seen_by(fit.box, fit.runs, fit.trials, case.balances, case.signals)
    found = balance_places(case.base, case.balances, seen)
    if len(case.balances) > MOST_FOR_PAIRS:
        found = [place for place in found if place.balance is not None]
    moving = [v for v in (*case.inputs, *case.base.states) if np.ptp(seen.values[v.name]) > 0]
    return [_wide(place) for place in with_others(found, moving, seen)]


def _wide(place: Place) -> Place:
    own = re.split(r"[()]| - ", " ".join(f"({text})" for text in place.coordinates.values()))
    names = [name for name in place.others if name not in own][:MOST_FURTHER]
    return place.widened({coordinate_of(name): name for name in names})


def coordinate_of(variable: str) -> str:
    """The name of a further variable in laws.

    >>> coordinate_of("motor.i")
    'of_motor_i'
    """
    return "of_" + re.sub(r"\W+", "_", variable).strip("_")


def further_of(place: Place) -> list[str]:
    """Coordinates of further variables."""
    return [name for name in place.coordinates if name.startswith("of_")]

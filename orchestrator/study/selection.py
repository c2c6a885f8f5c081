"""Which corrections to believe by what encoders saw: those clear of the stops, settled ones."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from orchestrator.study.corrections import Corrections

Array = NDArray[Any]
# A deviation that says nothing: beside it, no correction moves a prediction by more than 1e-8 of the force.
EXCLUDED_N = 1e6
SETTLED_RAD = 0.15


def clear_of_stops(corrections: Corrections) -> Array:
    """Mask of corrections during which no joint touched an end: there only the hand holds the arm, (n,)."""
    return ~corrections.at_stop


def settled(corrections: Corrections) -> Array:
    """Mask of those that in addition hardly moved, (n,)."""
    return clear_of_stops(corrections) & (corrections.moved < SETTLED_RAD)


def only(deviation: Array, kept: Array) -> Array:
    """Deviations of kept corrections in the places of `kept`, (n,) mask; others are excluded."""
    whole = np.full(len(kept), EXCLUDED_N)
    whole[kept] = deviation
    return whole

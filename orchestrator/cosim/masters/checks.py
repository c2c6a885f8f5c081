"""The check of every value that is read or written: finite, and within its declared range."""

import math
from typing import Any

from fmus.errors import ComponentError
from fmus.units import after_number
from orchestrator.cosim.component import FLOATS, INTEGERS
from orchestrator.cosim.wiring import Slot


def limits(slot: Slot) -> tuple[float, float] | None:
    """The declared range, or None for a type that has none."""
    port = slot.port
    if port.type not in FLOATS and port.type not in INTEGERS:
        return None
    low = -math.inf if port.minimum is None else port.minimum
    return low, math.inf if port.maximum is None else port.maximum


def fits(value: Any, low: float, high: float) -> bool:
    """Whether a number is finite and in [low, high]."""
    return low <= value <= high and -math.inf < value < math.inf


def outside(slot: Slot, element: int, value: Any, time: float, last_good: float) -> ComponentError:
    """The error for a value that does not fit."""
    port = slot.port
    name = f"{slot.component}.{port.elements[element]}"
    unit = after_number(port.unit)
    if not math.isfinite(value):
        wrong = f"{name} = {value}{unit} at t = {time:.9g} s is not a finite number"
    else:
        low, high = limits(slot) or (-math.inf, math.inf)
        wrong = f"{name} = {value:.9g}{unit} at t = {time:.9g} s is outside [{low:.9g}, {high:.9g}]{unit}"
    return ComponentError(f"{wrong}; last good state is t = {last_good:.9g} s")

"""Figures that a case gives to a check."""

import math

from fmus.errors import MisfitError


def at_least(smallest: float, **figures: float | None) -> None:
    """Refuse figures that are no finite numbers or lie below a smallest one; None is left out.

    Raises:
        MisfitError: for example for window_s = -1.
    """
    for name, value in figures.items():
        if value is not None and not (_number(value) and value >= smallest):
            raise MisfitError(f"{name} = {value!r}, expected a number from {smallest:g} up")


def numbers(**figures: float | None) -> None:
    """Refuse figures that are no finite numbers; None is left out.

    Raises:
        MisfitError: for example for value = "high".
    """
    for name, value in figures.items():
        if value is not None and not _number(value):
            raise MisfitError(f"{name} = {value!r}, expected a finite number")


def _number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)

"""Ports that a system file names: a list of names, or a table with their units."""

from typing import Any

from fmus.errors import MisfitError
from orchestrator.cosim.component import Port
from orchestrator.measurements.wording import shown


def named_ports(given: Any, causality: str, key: str) -> tuple[Port, ...]:
    """Make ports of `["u1", "u2"]` or `{ u1 = "m", u2 = "" }`; inputs start at 0.

    Raises:
        MisfitError: if `given` is neither.
    """
    names = isinstance(given, list | tuple) and all(isinstance(name, str) for name in given)
    units = dict.fromkeys(given, "") if names else given
    if not isinstance(units, dict) or not all(isinstance(text, str) for pair in units.items() for text in pair):
        raise MisfitError(
            f'{key} = {shown(given)}; expected names, such as ["u"], or names with units, such as {{ u = "m" }}'
        )
    start = 0.0 if causality == "input" else None
    return tuple(Port(name, causality, unit=unit, start=start) for name, unit in units.items())

"""Going back to a communication point: states of all components and all values."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from orchestrator.cosim.masters.coupling import Coupling


@dataclass(frozen=True)
class Point:
    """Everything at one communication point."""

    states: Mapping[str, object]
    values: tuple[Any, ...]
    time: float


def save(coupling: Coupling) -> Point:
    """Save all components.

    Raises:
        ComponentError: if one of them cannot.
    """
    states = {}
    for name, component in coupling.components.items():
        coupling.progress.enter(coupling.number[name], "save", coupling.time)
        states[name] = component.save()
    return Point(states, tuple(coupling.values), coupling.time)


def restore(coupling: Coupling, point: Point) -> None:
    """Go back; a point can be gone back to more than once."""
    for name, component in coupling.components.items():
        coupling.progress.enter(coupling.number[name], "restore", point.time)
        component.restore(point.states[name])
    coupling.values[:] = point.values
    coupling.time = coupling.last_good = point.time
    coupling.ended = None

"""Waves as a component, so that they drive a system like any other output."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from orchestrator.cosim.component import FLOATS, Component, Port, StepEnd
from orchestrator.regress.wave import Wave

SOURCE = f"{__name__}:Drive"


class Drive(Component):
    """Outputs follow waves; after a jump at a communication point they have the value that comes after it.

    Args:
        ports: outputs, each of the type and unit of what it drives.
        waves: by output.
    """

    can_save = True

    def __init__(self, ports: Sequence[Port], waves: Mapping[str, Wave]) -> None:
        self.ports = tuple(ports)
        self.feedthrough: Mapping[str, Sequence[str]] = {port.name: () for port in ports}
        self._waves = dict(waves)
        self._kinds = {port.name: _kind(port) for port in ports}
        self._time = 0.0

    def initialise(self, time: float, stop: float | None, tolerance: float | None) -> None:
        """Begin at a time."""
        self._time = time

    def start(self) -> None:
        """Nothing to do."""

    def set(self, names: Sequence[str], values: Sequence[Any]) -> None:
        """There are no inputs."""

    def get(self, names: Sequence[str]) -> list[Any]:
        """Values at the time reached."""
        return [self._kinds[name](self._waves[name].at(self._time)) for name in names]

    def step(self, time: float, size: float) -> StepEnd:
        """Only time passes."""
        self._time = time + size
        return StepEnd(self._time)

    def terminate(self) -> None:
        """Nothing to do."""

    def save(self) -> object:
        """The time."""
        return self._time

    def restore(self, state: object) -> None:
        """Go back to a time."""
        assert isinstance(state, float)
        self._time = state


def _kind(port: Port) -> Callable[[float], Any]:
    if port.type in FLOATS:
        return float
    return (lambda value: value != 0.0) if port.type == "Boolean" else round

"""What a component offers whose clocks tick: a mode of its own for events, between its steps (FMI 3.0, section 4.2.1)."""

from abc import abstractmethod
from collections.abc import Sequence

from orchestrator.cosim.component import Component


class Clocked(Component):
    """A component with an event mode.

    In event mode clocks tick, inputs are set and outputs read until an `update` changes nothing any more; then it goes back
    to stepping. Discrete inputs that are set between two steps begin an event by themselves.
    """

    output_clocks: Sequence[str] = ()

    @property
    @abstractmethod
    def wants_event(self) -> bool:
        """Whether something has happened that event mode has to deal with."""

    @abstractmethod
    def next_event(self) -> float:
        """When the next event is due, in s; infinity if none is planned."""

    @abstractmethod
    def enter_event(self) -> None:
        """Go into event mode, if it is not there yet."""

    @abstractmethod
    def due(self, time: float) -> list[str]:
        """The input clocks whose time has come at `time` s; each is told once."""

    @abstractmethod
    def tick(self, clocks: Sequence[str]) -> None:
        """Let input clocks tick."""

    @abstractmethod
    def ticking(self) -> list[str]:
        """The output clocks that tick now; each tick is told once."""

    @abstractmethod
    def update(self) -> bool:
        """End a turn of the event; whether another one has to follow."""

    @abstractmethod
    def leave_event(self, time: float) -> None:
        """Go back to stepping at `time` s, if it is in event mode."""

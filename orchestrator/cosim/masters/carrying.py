"""What an operation needs of the coupling that carries it out."""

from collections.abc import Iterable, Mapping
from typing import Any, Protocol

from orchestrator.cosim.component import Component
from orchestrator.cosim.masters.operations import Get, Set, Shape
from orchestrator.cosim.wiring import Link, Wiring


class Carrying(Protocol):
    """The values of a system, its components, and how values go between them; see `Coupling`."""

    wiring: Wiring
    components: Mapping[str, Component]
    values: list[Any]
    last_good: float

    def get(self, operation: Get, time: float) -> None:
        """Read outputs and check them."""
        ...

    def set(self, operation: Set, time: float) -> None:
        """Copy values along links, check them and write them."""
        ...

    def copy(self, links: Iterable[Link]) -> None:
        """Copy values along links, converted."""
        ...

    def write(self, operation: Set | Shape, time: float) -> None:
        """Give a component the kept values of its inputs."""
        ...

    def check(self, operation: Get | Set, time: float) -> None:
        """Raise ComponentError for the first value that is not finite or outside its range."""
        ...

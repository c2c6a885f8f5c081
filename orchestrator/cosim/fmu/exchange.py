"""An FMU for model exchange as a component; several of them can share one system of equations."""

from collections.abc import Mapping, Sequence
from typing import Any

from orchestrator.cosim.component import StepEnd
from orchestrator.cosim.fmu.base import FmuComponent, SavedState, instantiate
from orchestrator.cosim.fmu.description import FmuDescription, Interface
from orchestrator.cosim.fmu.equations import Equations
from orchestrator.cosim.masters.operations import Operation
from orchestrator.cosim.progress import Progress


class ExchangeFmu(FmuComponent):
    """A model exchange FMU of either version, integrated here."""

    def __init__(self, name: str, description: FmuDescription, interface: Interface) -> None:
        super().__init__(instantiate(name, description, interface), interface)
        self.name = name
        self._continuous = {port.name for port in description.ports if port.variability == "continuous"}
        self._running = False
        self._equations: Equations | None = None

    @property
    def equations(self) -> Equations:
        """The equations that this FMU belongs to."""
        if self._equations is None:
            self._equations = Equations({self.name: self.instance})
        return self._equations

    def initialise(self, time: float, stop: float | None, tolerance: float | None) -> None:
        """Set what was set before, and enter initialisation."""
        self.equations.begin(time, tolerance)
        super().initialise(time, stop, tolerance)

    def start(self) -> None:
        """Leave initialisation and settle the first events."""
        super().start()
        self.equations.start(self.name)
        self._running = True

    def set(self, names: Sequence[str], values: Sequence[Any]) -> None:
        """Set variables; what is not continuous makes an event."""
        if not self._running or self._continuous.issuperset(names):
            super().set(names, values)
        else:
            self.equations.change(lambda: self._values.set(names, values))

    def step(self, time: float, size: float) -> StepEnd:
        """Integrate, together with the others that share the equations."""
        return self.equations.advance(time, size)

    def save(self) -> tuple[SavedState, Any]:
        """The FMU's own copy of its state, and that of the integrator."""
        return SavedState(self.instance), self.equations.snapshot()

    def restore(self, state: object) -> None:
        """Go back to a saved state."""
        assert isinstance(state, tuple)
        state[0].restore()
        self.equations.come_back(state[1])


def couple(
    members: Sequence[ExchangeFmu],
    operations: Sequence[Operation],
    size: int,
    numbers: Mapping[str, int],
    progress: Progress,
) -> None:
    """Join FMUs to one system of equations, before initialisation.

    Args:
        members: the FMUs.
        operations: what they take from each other at one instant, in its order.
        size: number of values that the wiring numbers.
        numbers: of the components in their system.
        progress: where calls are noted.
    """
    instances = {member.name: member.instance for member in members}
    equations = Equations(instances, operations, size, numbers, progress)
    for member in members:
        member._equations = equations

"""An FMU for co-simulation as a component."""

from collections.abc import Sequence
from typing import Any

from orchestrator.cosim.component import Component, StepEnd
from orchestrator.cosim.fmu.base import Values, instantiate
from orchestrator.cosim.fmu.description import FmuDescription, Interface
from orchestrator.cosim.fmu.instance import Instance
from orchestrator.cosim.fmu.instance2 import Instance2
from orchestrator.cosim.fmu.states import SavedState


class SteppingFmu(Component):
    """A co-simulation FMU of either version."""

    kind = "fmu"

    def __init__(
        self,
        name: str,
        description: FmuDescription,
        interface: Interface,
        early_return: bool = False,
        kind: type[Instance] | None = None,
    ) -> None:
        self.instance = instantiate(name, description, interface, early_return, kind)
        self.ports, self.feedthrough = description.ports, description.feedthrough
        # Before FMI 2.0, outputs are said to be those of the last step.
        self.follows_inputs = description.version > 1
        self.variable_step = interface.variable_step
        self.can_save, self.can_differentiate = interface.can_save, interface.can_differentiate
        self.interpolates_inputs = interface.interpolates_inputs
        self._values = Values(self.instance)
        self._prepared: dict[str, Any] | None = {}

    def initialise(self, time: float, stop: float | None, tolerance: float | None) -> None:
        """Set what was set before, and enter initialisation; without a tolerance, with that of the FMU's default experiment."""
        prepared, self._prepared = self._prepared, None
        if prepared:
            self._values.prepare(prepared)
        own = self.instance.description.tolerance
        self.instance.begin(time, stop, own if tolerance is None else tolerance)

    def start(self) -> None:
        """Leave initialisation."""
        self.instance.finish_initialisation()

    def set(self, names: Sequence[str], values: Sequence[Any]) -> None:
        """Set variables; before initialisation they are kept for it."""
        if self._prepared is not None:
            self._prepared.update(zip(names, values, strict=True))
        else:
            self._values.set(names, values)

    def get(self, names: Sequence[str]) -> list[Any]:
        """Values of variables."""
        return self._values.get(names)

    def step(self, time: float, size: float) -> StepEnd:
        """Let the FMU step."""
        return self.instance.step(time, size)

    def slopes(self, names: Sequence[str], values: Sequence[float]) -> None:
        """Slopes of inputs over the next step, in unit/s, if `interpolates_inputs`."""
        assert isinstance(self.instance, Instance2)
        for access, positions in self.instance.access(names):
            self.instance.slopes(access.references, [values[k] for k in positions])

    def save(self) -> SavedState:
        """The FMU's own copy of its state."""
        return SavedState(self.instance)

    def restore(self, state: object) -> None:
        """Go back to a saved state."""
        assert isinstance(state, SavedState)
        state.restore()

    def derivative(self, outputs: Sequence[str], inputs: Sequence[str], seed: Sequence[float]) -> list[float]:
        """Directional derivative by the FMU itself."""
        return self.instance.directional(outputs, inputs, seed)

    def terminate(self) -> None:
        """End the run and free the instance."""
        self.instance.terminate()

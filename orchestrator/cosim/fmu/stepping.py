"""An FMU for co-simulation as a component, also one that asks for its inputs within a step (intermediate update)."""

import ctypes
from collections.abc import Sequence
from typing import Any

from orchestrator.cosim.component import FLOATS, StepEnd
from orchestrator.cosim.fmu.base import FmuComponent, instantiate
from orchestrator.cosim.fmu.description import FmuDescription, Interface
from orchestrator.cosim.fmu.instance import Instance
from orchestrator.cosim.fmu.instance2 import Instance2
from orchestrator.cosim.fmu.instance3 import Instance3, Size


class SteppingFmu(FmuComponent):
    """A co-simulation FMU of either version."""

    def __init__(
        self,
        name: str,
        description: FmuDescription,
        interface: Interface,
        early_return: bool = False,
        kind: type[Instance] | None = None,
    ) -> None:
        super().__init__(instantiate(name, description, interface, early_return, kind), interface)
        # Before FMI 2.0, outputs are said to be those of the last step.
        self.follows_inputs = description.version > 1
        self.variable_step = interface.variable_step
        self.interpolates_inputs = interface.interpolates_inputs

    def initialise(self, time: float, stop: float | None, tolerance: float | None) -> None:
        """Enter initialisation; without a tolerance, with that of the FMU's default experiment."""
        super().initialise(time, stop, self.instance.description.tolerance if tolerance is None else tolerance)

    def step(self, time: float, size: float) -> StepEnd:
        """Let the FMU step."""
        return self.instance.step(time, size)

    def slopes(self, names: Sequence[str], values: Sequence[float]) -> None:
        """Slopes of inputs over the next step, in unit/s, if `interpolates_inputs`."""
        assert isinstance(self.instance, Instance2)
        for access, positions in self.instance.access(names):
            self.instance.slopes(access.references, [values[k] for k in positions])


_Flag, _Time = ctypes.c_bool, ctypes.c_double
# fmi3IntermediateUpdateCallback: environment, time, set requested, get allowed, step finished, may return early, and two answers.
_Callback = ctypes.CFUNCTYPE(None, ctypes.c_void_p, _Time, _Flag, _Flag, _Flag, _Flag, ctypes.c_void_p, ctypes.c_void_p)


class AskingInstance(Instance3):
    """An instance that gets its inputs as lines: values at the begin of a step, and slopes."""

    asks_within_steps = True

    def _intermediate(self) -> tuple[Any, Any, Any]:
        ports = self.description.ports
        self.names = [
            p.name for p in ports if p.causality == "input" and p.type in FLOATS and p.variability == "continuous"
        ]
        self.lines: dict[str, tuple[Any, float]] = {}
        self.failure: Exception | None = None
        self._callback = _Callback(self._asked)
        references = [self.description.by_name[name][1] for name in self.names]
        return (ctypes.c_uint32 * len(references))(*references), Size(len(references)), self._callback

    def _asked(self, _: int | None, time: float, wants_inputs: bool, *others: object) -> None:
        if not wants_inputs or not self.lines or self.failure is not None:
            return
        try:
            for access, positions in self.access(list(self.lines)):
                lines = list(self.lines.values())
                self.write(access, [lines[k][0] + lines[k][1] * (time - self.time) for k in positions])
        except Exception as error:  # none may go through the FMU's own code
            self.failure = error


class AskingFmu(SteppingFmu):
    """A component that interpolates its inputs by intermediate updates."""

    instance: AskingInstance

    def __init__(self, name: str, description: FmuDescription, interface: Interface) -> None:
        super().__init__(name, description, interface, kind=AskingInstance)
        self.interpolates_inputs = True
        self._held: dict[str, Any] = {}

    def set(self, names: Sequence[str], values: Sequence[Any]) -> None:
        """Set variables; inputs are held until slopes say otherwise."""
        self._held.update(zip(names, values, strict=True))
        super().set(names, values)

    def slopes(self, names: Sequence[str], values: Sequence[float]) -> None:
        """Slopes of inputs over the next step, in unit/s, one for each element."""
        left = list(values)
        for name in names:
            port = self.instance.description.by_name[name][0]
            own, left = left[: port.size], left[port.size :]
            if name in self.instance.names and not port.shape:
                self.instance.lines[name] = (self._held[name], own[0])

    def step(self, time: float, size: float) -> StepEnd:
        """Let the FMU step."""
        try:
            end = super().step(time, size)
            if self.instance.failure is not None:
                raise self.instance.failure
            return end
        finally:
            self.instance.lines.clear()
            self.instance.failure = None

"""An FMU for scheduled execution as a component: its clocks tick when they are due, and each tick activates a model
partition."""

import ctypes
from collections.abc import Mapping
from typing import Any

from orchestrator.cosim.component import StepEnd
from orchestrator.cosim.fmu.base import FmuComponent
from orchestrator.cosim.fmu.clocks import Agenda, Clock, read_clocks
from orchestrator.cosim.fmu.description import FmuDescription, Interface
from orchestrator.cosim.fmu.instance import Double
from orchestrator.cosim.fmu.instance3 import Instance3
from orchestrator.cosim.fmu.messages import logger3
from orchestrator.cosim.fmu.unpacked import unpacked

# Share of a step that is taken for rounding.
_ROUNDING = 1e-9
_Update = ctypes.CFUNCTYPE(None, ctypes.c_void_p)
_Lock = ctypes.CFUNCTYPE(None)


class ScheduledInstance(Instance3):
    """An instance whose model partitions are activated by their clocks."""

    def _instantiate(self) -> int | None:
        self.wants_update = False
        # Partitions run one after the other in one thread, so there is nothing to lock.
        self._callbacks = (_Update(self._update), _Lock(lambda: None), _Lock(lambda: None))
        resources = unpacked(self.description) / "resources"
        folder = f"{resources}/".encode() if resources.is_dir() else None
        address = self.function("InstantiateScheduledExecution", ctypes.c_void_p)(
            self.name.encode(),
            self.description.token.encode(),
            folder,
            *(ctypes.c_bool(False), ctypes.c_bool(False)),
            self.messages.environment,
            logger3(),
            *self._callbacks,
        )
        return address if address is None else int(address)

    def _update(self, _: int | None) -> None:
        self.wants_update = True

    def activate(self, clock: Clock, time: float) -> None:
        """Let the partition of a clock run."""
        self.time = time
        self.call(
            "ActivateModelPartition", ctypes.c_uint32(clock.reference), Double(time), what=lambda: f"'{clock.name}'"
        )


class ScheduledFmu(FmuComponent):
    """Ticks are served in the order of time, then of priority; a step serves those after its begin until its end.

    Inputs are those of the begin of the step. `ticks` are the times in s of input clocks that somebody has to trigger, by name.
    """

    follows_inputs = False

    def __init__(
        self, name: str, description: FmuDescription, interface: Interface, ticks: Mapping[str, Any] | None = None
    ) -> None:
        super().__init__(ScheduledInstance(name, description, interface), interface)
        self.can_save = self.can_differentiate = False
        self.instance: ScheduledInstance
        inputs = [clock for clock in read_clocks(description.path) if clock.causality == "input"]
        self._agenda = Agenda(inputs, ticks, self.instance.interval)
        self._first = 0.0

    def initialise(self, time: float, stop: float | None, tolerance: float | None) -> None:
        """Set what was set before, and enter initialisation."""
        super().initialise(time, stop, tolerance)
        self._first = time

    def start(self) -> None:
        """Leave initialisation, and serve what ticks at once."""
        super().start()
        self._agenda.begin(self._first)
        self._serve(self._first)

    def step(self, time: float, size: float) -> StepEnd:
        """Serve all ticks until the end of the step."""
        self._serve(time + size * (1.0 + _ROUNDING))
        return StepEnd(time + size)

    def _serve(self, until: float) -> None:
        while (tick := self._agenda.take(until)) is not None:
            self.instance.wants_update = False
            self.instance.activate(self._agenda.inputs[tick.place], tick.time)
            self._agenda.served(tick)
            if self.instance.wants_update:
                self._agenda.count_down(tick.time)

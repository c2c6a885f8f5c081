"""An FMU for scheduled execution as a component: its clocks tick when they are due, and each tick activates a model
partition."""

import ctypes
from collections.abc import Mapping, Sequence
from typing import Any

from orchestrator.cosim.component import Component, StepEnd
from orchestrator.cosim.fmu.agenda import Agenda
from orchestrator.cosim.fmu.base import Values
from orchestrator.cosim.fmu.clocks import Clock, read_clocks
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


class ScheduledFmu(Component):
    """Ticks are served in the order of time, then of priority; a step serves those after its begin until its end.

    Inputs are those of the begin of the step. `ticks` are the times in s of input clocks that somebody has to trigger, by name.
    """

    kind = "fmu"
    follows_inputs = False

    def __init__(
        self, name: str, description: FmuDescription, interface: Interface, ticks: Mapping[str, Any] | None = None
    ) -> None:
        self.ports, self.feedthrough = description.ports, description.feedthrough
        self.instance = ScheduledInstance(name, description, interface)
        inputs = [clock for clock in read_clocks(description.path) if clock.causality == "input"]
        self._agenda = Agenda(inputs, ticks, self.instance.interval)
        self._values = Values(self.instance)
        self._prepared: dict[str, Any] | None = {}
        self._first = 0.0

    def initialise(self, time: float, stop: float | None, tolerance: float | None) -> None:
        """Set what was set before, and enter initialisation."""
        prepared, self._prepared = self._prepared, None
        if prepared:
            self._values.prepare(prepared)
        self.instance.begin(time, stop, tolerance)
        self._first = time

    def start(self) -> None:
        """Leave initialisation, and serve what ticks at once."""
        self.instance.finish_initialisation()
        self._agenda.begin(self._first)
        self._serve(self._first)

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
        """Serve all ticks until the end of the step."""
        self._serve(time + size * (1.0 + _ROUNDING))
        return StepEnd(time + size)

    def terminate(self) -> None:
        """End the run and free the instance."""
        self.instance.terminate()

    def _serve(self, until: float) -> None:
        while (tick := self._agenda.take(until)) is not None:
            self.instance.wants_update = False
            self.instance.activate(self._agenda.inputs[tick.place], tick.time)
            self._agenda.served(tick)
            if self.instance.wants_update:
                self._agenda.count_down(tick.time)

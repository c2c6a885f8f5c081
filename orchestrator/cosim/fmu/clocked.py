"""An FMU for co-simulation whose clocks tick: it is run with event mode."""

import ctypes
import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from orchestrator.cosim.component import Clocked, StepEnd
from orchestrator.cosim.fmu.clocks import Agenda, Tick, read_clocks
from orchestrator.cosim.fmu.description import FmuDescription, Interface
from orchestrator.cosim.fmu.instance3 import Instance3, Size
from orchestrator.cosim.fmu.stepping import SteppingFmu

# Share of a time that is taken for rounding.
_ROUNDING = 1e-12


class ClockedInstance(Instance3):
    """An instance with event mode, and the calls for clocks."""

    uses_event_mode = True

    def tick(self, references: Sequence[int]) -> None:
        """Let clocks tick."""
        n = len(references)
        self.call("SetClock", (ctypes.c_uint32 * n)(*references), Size(n), (ctypes.c_bool * n)(*[True] * n))

    def ticking(self, references: Sequence[int]) -> list[bool]:
        """Which clocks tick."""
        n = len(references)
        found = (ctypes.c_bool * n)()
        self.call("GetClock", (ctypes.c_uint32 * n)(*references), Size(n), found)
        return list(found)


class ClockedFmu(SteppingFmu, Clocked):
    """The instance is in event mode from the end of its initialisation until `leave_event`."""

    instance: ClockedInstance

    def __init__(
        self, name: str, description: FmuDescription, interface: Interface, ticks: Mapping[str, Any] | None = None
    ) -> None:
        super().__init__(name, description, interface, kind=ClockedInstance)
        clocks = read_clocks(description.path)
        self._reference = {clock.name: clock.reference for clock in clocks}
        self.output_clocks = tuple(clock.name for clock in clocks if clock.causality == "output")
        inputs = [clock for clock in clocks if clock.causality == "input"]
        self._agenda = Agenda(inputs, ticks, self.instance.interval)
        self._discrete = {port.name for port in self.ports if port.variability != "continuous"}
        self._known: dict[str, Any] = {}
        self._served: list[Tick] = []
        self._in_event, self._told, self._time_event = False, False, math.inf

    @property
    def wants_event(self) -> bool:
        """After the start, after a step that says so, and after a discrete input has changed."""
        return self._told or self.instance.wants_event

    def start(self) -> None:
        """Leave initialisation for event mode."""
        super().start()
        self._agenda.begin(self.instance.time)
        self._in_event = self._told = True

    def set(self, names: Sequence[str], values: Sequence[Any]) -> None:
        """Set variables; a discrete one that changes begins an event."""
        if self._prepared is None and not self._in_event:
            given = dict(zip(names, values, strict=True))
            same = {name for name in given if name in self._discrete and not self._is_new(name, given[name])}
            if any(name in self._discrete and name not in same for name in given):
                self.enter_event()
                self._told = True
            names = [name for name in given if name not in same]
            values = [given[name] for name in names]
        self._known.update(zip(names, values, strict=True))
        super().set(names, values)

    def step(self, time: float, size: float) -> StepEnd:
        """Let the FMU step."""
        self.leave_event(time)
        return super().step(time, size)

    def next_event(self) -> float:
        """When a clock ticks by itself, or the FMU has a time event."""
        return min(self._agenda.next, self._time_event)

    def enter_event(self) -> None:
        """Go into event mode, if it is not there yet."""
        if not self._in_event:
            self.instance.call("EnterEventMode")
            self._in_event = True

    def due(self, time: float) -> list[str]:
        """The input clocks whose time has come."""
        until = time + _ROUNDING * max(1.0, abs(time))
        found: list[str] = []
        while (tick := self._agenda.take(until)) is not None:
            self._served.append(tick)
            found.append(self._agenda.inputs[tick.place].name)
        if self._time_event <= until:
            self._told, self._time_event = True, math.inf
        return found

    def tick(self, clocks: Sequence[str]) -> None:
        """Let input clocks tick."""
        self.instance.tick([self._reference[name] for name in clocks])

    def ticking(self) -> list[str]:
        """The output clocks that tick now."""
        if not self.output_clocks:
            return []
        found = self.instance.ticking([self._reference[name] for name in self.output_clocks])
        return [name for name, active in zip(self.output_clocks, found, strict=True) if active]

    def update(self) -> bool:
        """End a turn of the event."""
        event = self.instance.update_discrete_states()
        self._time_event = math.inf if event.next_time is None else event.next_time
        self._told = self.instance.wants_event = False
        return event.again

    def leave_event(self, time: float) -> None:
        """Plan the ticks to come, and go back to stepping."""
        if not self._in_event:
            return
        for tick in self._served:
            self._agenda.served(tick)
        self._served.clear()
        self._agenda.count_down(time)
        self.instance.call("EnterStepMode")
        self._in_event = False

    def _is_new(self, name: str, value: Any) -> bool:
        return name not in self._known or not np.array_equal(self._known[name], value)

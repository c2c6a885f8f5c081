"""An FMU for scheduled execution as a component: its clocks tick when they are due, and each tick activates a model
partition."""

import ctypes
import heapq
import math
from collections.abc import Mapping, Sequence
from typing import Any

from fmus.errors import MisfitError
from orchestrator.cosim.component import Component, StepEnd
from orchestrator.cosim.fmu.base import Values
from orchestrator.cosim.fmu.clocks import Clock, read_clocks
from orchestrator.cosim.fmu.description import FmuDescription, Interface
from orchestrator.cosim.fmu.instance import Double
from orchestrator.cosim.fmu.instance3 import Instance3, Size
from orchestrator.cosim.fmu.messages import logger3
from orchestrator.cosim.fmu.unpacked import unpacked
from orchestrator.measurements.wording import nearest, shown

_PERIODIC = ("constant", "fixed", "calculated", "tunable", "changing")
_CHANGED = 2  # fmi3IntervalChanged
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

    def interval(self, clock: Clock) -> tuple[float, int]:
        """Interval of a clock in s and its qualifier: not yet known, unchanged or changed."""
        reference, found, qualifier = ctypes.c_uint32(clock.reference), Double(), ctypes.c_int()
        places = ctypes.byref(reference), Size(1), ctypes.byref(found), ctypes.byref(qualifier)
        self.call("GetIntervalDecimal", *places, what=lambda: f"'{clock.name}'")
        return found.value, qualifier.value


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
        self._inputs = [clock for clock in read_clocks(description.path) if clock.causality == "input"]
        self._given = _checked(ticks or {}, self._inputs)
        self.instance = ScheduledInstance(name, description, interface)
        self._values = Values(self.instance)
        self._prepared: dict[str, Any] | None = {}
        self._due: list[tuple[float, int, int, int]] = []  # time, priority, place among the inputs, number of the tick
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
        for place, clock in enumerate(self._inputs):
            if clock.variability in _PERIODIC:
                self._plan(place, self._first + clock.shift, 0)
            for time in self._given.get(clock.name, ()):
                if time >= self._first:
                    self._plan(place, time, 0)
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

    def _plan(self, place: int, time: float, number: int) -> None:
        heapq.heappush(self._due, (time, self._inputs[place].priority, place, number))

    def _serve(self, until: float) -> None:
        while self._due and self._due[0][0] <= until:
            time, _, place, number = heapq.heappop(self._due)
            clock = self._inputs[place]
            self.instance.wants_update = False
            self.instance.activate(clock, time)
            if clock.variability in _PERIODIC:
                self._plan(place, self._next(clock, time, number + 1), number + 1)
            if self.instance.wants_update:
                self._count_down(time)

    def _next(self, clock: Clock, time: float, number: int) -> float:
        """When a periodic clock ticks for the `number`-th time after its first."""
        if clock.interval is not None and clock.variability in ("constant", "fixed"):
            return self._first + clock.shift + number * clock.interval
        interval, _ = self.instance.interval(clock)
        if not (interval > 0.0 and math.isfinite(interval)):
            raise MisfitError(f"clock {clock.name!r} has the interval {interval:g} s; expected a positive time")
        return time + interval

    def _count_down(self, time: float) -> None:
        for place, clock in enumerate(self._inputs):
            if clock.variability == "countdown":
                interval, qualifier = self.instance.interval(clock)
                if qualifier == _CHANGED:
                    self._due = [each for each in self._due if each[2] != place]
                    heapq.heapify(self._due)
                    self._plan(place, time + interval, 0)


def _checked(ticks: Mapping[str, Any], inputs: Sequence[Clock]) -> dict[str, list[float]]:
    """Times of clocks to be triggered.

    Raises:
        MisfitError: if there is no such clock, it ticks by itself, or the times are none.
    """
    names = [clock.name for clock in inputs if clock.variability == "triggered"]
    found = {}
    for name, times in ticks.items():
        if name not in names:
            raise MisfitError(
                f"ticks of {name!r}: there is no input clock to be triggered of that name; {nearest(name, names)}"
            )
        numbers = isinstance(times, list) and all(isinstance(t, int | float) and not isinstance(t, bool) for t in times)
        if not numbers or not all(math.isfinite(t) for t in times):
            raise MisfitError(f"ticks of {name!r} = {shown(times)}; expected a list of times in s, such as [0, 0.5]")
        found[name] = sorted(map(float, times))
    return found

"""Components joined by their wiring: carries out operations, one after the other."""

import math
from collections.abc import Iterable, Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from fmus.errors import ComponentError
from orchestrator.cosim.component import Component, StepEnd
from orchestrator.cosim.masters.events import Events
from orchestrator.cosim.masters.loops import solve_loop
from orchestrator.cosim.masters.not_finite import NotFinite, fits, limits, outside
from orchestrator.cosim.masters.operations import Get, Operation, Set, Settle, Shape, Shaper, Solve, Step
from orchestrator.cosim.progress import Progress
from orchestrator.cosim.wiring import OUTSIDE, Link, Slot, Wiring

# A step that is cut more often than that, by events, gets nowhere.
_MOST_PARTS = 10_000
# Share of a step that is taken for rounding.
_ROUNDING = 1e-6


class StepCut(Exception):
    """A component ended its step early, at an event at `time` s, and the master wants to go back and meet it there."""

    def __init__(self, time: float) -> None:
        super().__init__(time)
        self.time = time


class Coupling:
    """The values of a system, flat as the wiring numbers them, and the components that they belong to.

    `time` is the last communication point in s, `k` the number of steps since `start`; `ended` says which component
    wanted the run to end, and when, if one did: after this step where it says so at the end of one. `stop` is the stop
    time that the components were told, which no step passes by a rounding error.
    """

    def __init__(
        self,
        wiring: Wiring,
        components: Mapping[str, Component],
        progress: Progress,
        shaper: Shaper | None = None,
        not_finite: NotFinite | None = None,
    ) -> None:
        self.wiring, self.components, self.progress = wiring, components, progress
        self.not_finite = not_finite or NotFinite(wiring, {})
        self.shaper = shaper
        self.events = Events(wiring, wiring.ticking)
        self.number = {name: k for k, name in enumerate(components)}
        self.values: list[Any] = [0.0] * wiring.size
        self.time = self.last_good = 0.0
        self.stop = math.inf
        self.ended: tuple[str, float] | None = None
        self.cut_at_events = False
        self._names: dict[int, tuple[str, ...]] = {}
        self._limits: dict[int, list[tuple[int, float, float, Slot, int]]] = {}
        for slot in wiring.slots:
            start = wiring.starts.get(slot.component, {}).get(slot.port.name, slot.port.start)
            if start is not None:
                self.store(slot, start)

    def store(self, slot: Slot, value: Any) -> None:
        """Keep a value of a port."""
        if slot.port.shape:
            self.values[slot.first : slot.first + slot.port.size] = np.ravel(value).tolist()
        else:
            self.values[slot.first] = value

    def fetch(self, slot: Slot) -> Any:
        """The value of a port as it was kept."""
        if not slot.port.shape:
            return self.values[slot.first]
        part = self.values[slot.first : slot.first + slot.port.size]
        kind = object if slot.port.type in ("String", "Binary") else None
        return np.array(part, dtype=kind).reshape(slot.port.shape)

    def carry_out(self, operations: Iterable[Operation], k: int, start: float, size: float) -> bool:
        """Carry out the operations of step `k`, from `start + k size` s to the next point; whether the run goes on."""
        for operation in operations:
            if not self.carry_out_one(operation, k, start, size):
                return False
        self.time = self.last_good = self.progress.word.last_good = self.not_past_stop(start + (k + 1) * size, size)
        return True

    def carry_out_one(self, operation: Operation, k: int, start: float, size: float) -> bool:
        """Carry out an operation of step `k`; whether the run goes on.

        Args:
            operation: the operation.
            k: number of the step, from 0; -1 for before the first one.
            start: beginning of the run, in s.
            size: of the step, in s.
        """
        time = self.not_past_stop(start + (k + 1) * size, size)
        if isinstance(operation, Get):
            self.get(operation, time)
        elif isinstance(operation, Set):
            self.set(operation, time)
        elif isinstance(operation, Solve):
            solve_loop(self, operation, time)
        elif isinstance(operation, Shape):
            assert self.shaper is not None
            self.shaper.apply(self, operation, start + k * size, size)
        elif isinstance(operation, Settle):
            self.settle(operation, time)
        else:
            return self.step(operation, k, start, size)
        return True

    def settle(self, operation: Settle, time: float) -> None:
        """Deal with all events of an instant, with everything that follows from them; then all components step again."""
        for _ in range(_MOST_PARTS):
            if not self.events.wanted(self, time):
                break
            self.events.turn(self, time)
            for each in operation.evaluation:
                self.carry_out_one(each, -1, time, 0.0)
        self.events.leave(self, time)

    def evaluate(self, operations: Iterable[Operation], time: float) -> None:
        """Carry out operations at one instant."""
        self.carry_out(operations, -1, time, 0.0)

    def get(self, operation: Get, time: float) -> None:
        """Read outputs and check them."""
        component = self.components[operation.component]
        self.progress.enter(self.number[operation.component], "get", time)
        for slot, value in zip(operation.slots, component.get(self._named(operation)), strict=True):
            self.store(slot, value)
            if self.not_finite.policies:
                self.not_finite.taken(slot, self.values, time)
        self.check(operation, time)

    def set(self, operation: Set, time: float) -> None:
        """Copy values along links, check them and write them."""
        self.copy(operation.links)
        self.check(operation, time)
        self.write(operation, time)

    def copy(self, links: Iterable[Link]) -> None:
        """Copy values along links, converted."""
        for link in links:
            for source, target in zip(link.sources, link.targets, strict=True):
                self.values[target] = link.convert(self.values[source])

    def write(self, operation: Set | Shape, time: float) -> None:
        """Give a component the kept values of its inputs."""
        component = self.components[operation.component]
        self.progress.enter(self.number[operation.component], "set", time)
        component.set(self._named(operation), [self.fetch(slot) for slot in operation.slots])

    def step(self, operation: Step, k: int, start: float, size: float) -> bool:
        """Let a component advance if it is its turn; whether the run goes on.

        Args:
            operation: the operation.
            k: number of the step, from 0.
            start: beginning of the run, in s.
            size: of the step, in s.
        """
        if (k + 1) % operation.every != 0:
            return True
        # A component with longer steps of its own is late rather than ahead: it steps when the others have arrived.
        first = start + (k + 1 - operation.every) * size
        piece = operation.every * size / operation.pieces
        # Where a step ends the next one begins, to the last bit: some FMUs count their own steps up to there.
        points = (*(first + n * piece for n in range(operation.pieces)), start + (k + 1) * size)
        return all(self._advance(operation.component, one, other - one) for one, other in pairwise(points))

    def finish_step(self, component: str, end: StepEnd, planned: float) -> bool:
        """Go on where a step ended early; whether the run goes on.

        Args:
            component: its name.
            end: where it got to.
            planned: where it was to go, in s.
        """
        for _ in range(_MOST_PARTS):
            left = planned - end.time
            arrived = left <= 1e-9 * max(1.0, abs(planned))
            if end.terminated:
                self.ended = (component, end.time)
                return arrived
            if arrived or not end.early:
                return True
            if self.cut_at_events:
                raise StepCut(end.time)
            before = end.time
            self.progress.enter(self.number[component], "step", before)
            end = self.components[component].step(before, left)
            if end.early and not end.time > before:
                break
        raise ComponentError(
            f"{component} ends every step early and gets no further than t = {end.time:.9g} s; "
            f"last good state is t = {self.last_good:.9g} s"
        )

    def _advance(self, component: str, time: float, size: float) -> bool:
        size = self._within_stop(time, size)
        self.progress.enter(self.number[component], "step", time)
        end = self.components[component].step(time, size)
        return True if not end.early and not end.terminated else self.finish_step(component, end, time + size)

    def not_past_stop(self, time: float, size: float) -> float:
        """A time, or the stop time where that is no further away than a rounding error of a step of `size` s."""
        return self.stop if abs(time - self.stop) <= _ROUNDING * size else time

    def _within_stop(self, time: float, size: float) -> float:
        """Size of a step from `time` which, added to it as an FMU adds them, does not pass the stop by a rounding error."""
        if not 0.0 < time + size - self.stop <= _ROUNDING * size:
            return size
        size = self.stop - time
        while time + size > self.stop:
            size = math.nextafter(size, 0.0)
        return size

    def check(self, operation: Get | Set, time: float) -> None:
        """Raise ComponentError for the first value that is not finite or outside its range."""
        key = id(operation)
        checked = self._limits.get(key)
        if checked is None:
            checked = self._limits[key] = list(_checked(operation.slots))
            self._names[key] = tuple(slot.port.name for slot in operation.slots)
        for place, low, high, slot, element in checked:
            value = self.values[place]
            if not fits(value, low, high) and not self.not_finite.passes(place, value):
                raise outside(slot, element, value, time, self.last_good)

    def _named(self, operation: Get | Set | Shape) -> Sequence[str]:
        names = self._names.get(id(operation))
        if names is None:
            names = self._names[id(operation)] = tuple(slot.port.name for slot in operation.slots)
        return names

    def show(self, name: str) -> Any:
        """Value of an output of the system."""
        slot = self.wiring.by_address[OUTSIDE, name]
        links = (*self.wiring.to_component(OUTSIDE), *self.wiring.clocked)
        self.copy(link for link in links if link.target is slot)
        return self.fetch(slot)


def _checked(slots: Iterable[Slot]) -> Iterable[tuple[int, float, float, Slot, int]]:
    for slot in slots:
        found = limits(slot)
        if found is not None:
            for element in range(slot.port.size):
                yield slot.first + element, *found, slot, element


def is_float(slot: Slot) -> bool:
    """Whether a port holds numbers that can be interpolated."""
    return slot.port.type in ("Float64", "Float32")

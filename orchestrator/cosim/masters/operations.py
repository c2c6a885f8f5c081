"""What a master does, as a table: reads, writes, loops and steps in their order."""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

from orchestrator.cosim.component import Component
from orchestrator.cosim.graph import Loop, Read
from orchestrator.cosim.wiring import OUTSIDE, Link, Slot, Wiring


@dataclass(frozen=True)
class Get:
    """Read outputs of a component."""

    component: str
    slots: tuple[Slot, ...]


@dataclass(frozen=True)
class Set:
    """Copy values along links to inputs of a component, converted, and set them."""

    component: str
    slots: tuple[Slot, ...]
    links: tuple[Link, ...]


@dataclass(frozen=True)
class Solve:
    """Find the values of an algebraic loop: of the inputs `torn`, with which `inside` gives them back."""

    loop: Loop
    torn: tuple[Set, ...]
    inside: tuple["Get | Set", ...]


@dataclass(frozen=True)
class Step:
    """Let a component advance: at every `every`-th step of the master, in `pieces` equal steps."""

    component: str
    every: int = 1
    pieces: int = 1


@dataclass(frozen=True)
class Shape:
    """Set inputs to what they are over the next step, where they are not to be held: extrapolated or smoothed."""

    component: str
    slots: tuple[Slot, ...]


@dataclass(frozen=True)
class Settle:
    """Deal with the events of components with an event mode, if there are any; `evaluation` follows each of their turns."""

    evaluation: tuple["Get | Set | Solve", ...]


Operation = Get | Set | Solve | Step | Shape | Settle


class Schedule:
    """Writes down operations for a wiring: an input is written once its source has been read, before it is needed."""

    def __init__(self, wiring: Wiring) -> None:
        self.wiring = wiring
        self.waiting: dict[str, dict[tuple[str, str], None]] = {}

    def get(self, component: str, outputs: Iterable[str]) -> Get:
        """Read outputs; whatever they drive waits to be written."""
        slots = tuple(self.wiring.by_address[component, name] for name in outputs)
        names = {slot.port.name for slot in slots}
        for link in self.wiring.from_component(component):
            if link.source.port.name in names and link.target.component != OUTSIDE:
                target = link.target
                self.waiting.setdefault(target.component, {})[target.component, target.port.name] = None
        return Get(component, slots)

    def set(self, component: str, except_for: Iterable[tuple[str, str]] = ()) -> list[Set]:
        """Write the inputs of a component that wait, if any."""
        waiting = self.waiting.get(component, {})
        names = [address for address in waiting if address not in except_for]
        for address in names:
            del waiting[address]
        return [self.writing(component, [name for _, name in names])] if names else []

    def writing(self, component: str, inputs: Sequence[str]) -> Set:
        """The operation that writes inputs."""
        slots = tuple(self.wiring.by_address[component, name] for name in inputs)
        into = self.wiring.to_component(component)
        # Inputs of the system are written when the user sets them.
        links = tuple(link for link in into if link.target.port.name in inputs and link.source.component != OUTSIDE)
        return Set(component, slots, links)

    def rest(self) -> list[Set]:
        """Write all that still waits."""
        return [operation for component in list(self.waiting) for operation in self.set(component)]

    def evaluation(self, order: Iterable[Read | Loop]) -> tuple[Get | Set | Solve, ...]:
        """Everything at one instant, without a delay."""
        operations: list[Get | Set | Solve] = []
        for part in order:
            if isinstance(part, Loop):
                operations += self._loop(part)
            else:
                operations += self.set(part.component)
                operations.append(self.get(part.component, part.outputs))
        return (*operations, *self.rest())

    def _loop(self, loop: Loop) -> list[Get | Set | Solve]:
        # What comes from outside the loop is written before, once.
        before: list[Get | Set | Solve] = []
        for component in {read.component: None for read in loop.reads}:
            before += self.set(component)
        tears = set(loop.tears)
        by_component: dict[str, list[str]] = {}
        for component, name in loop.tears:
            by_component.setdefault(component, []).append(name)
        torn = tuple(self.writing(component, names) for component, names in by_component.items())
        inside: list[Get | Set] = []
        for read in loop.reads:
            inside += self.set(read.component, except_for=tears)
            inside.append(self.get(read.component, read.outputs))
        for component, name in tears:
            self.waiting.get(component, {}).pop((component, name), None)
        return [*before, Solve(loop, torn, tuple(inside))]


def connected_inputs(wiring: Wiring) -> Mapping[str, tuple[Slot, ...]]:
    """For each component its inputs that another component drives."""
    found: dict[str, dict[str, Slot]] = {}
    for link in wiring.links:
        if OUTSIDE not in (link.source.component, link.target.component):
            found.setdefault(link.target.component, {})[link.target.port.name] = link.target
    return {component: tuple(slots.values()) for component, slots in found.items()}


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


class Shaper:
    """What components get as inputs while they step, instead of the values at the beginning of the step.

    Args:
        extrapolate: along the line through the last two points. A component that interpolates its inputs gets the slope,
            any other the value in the middle of the step, which serves a step of order two as well.
        smoothing: time constant in s of a first-order lag that inputs pass, 0 for none.
    """

    def __init__(self, extrapolate: bool, smoothing: float) -> None:
        self.extrapolate, self.smoothing = extrapolate, smoothing
        self._before: dict[int, tuple[float, float]] = {}
        self._smooth: dict[int, float] = {}

    def apply(self, coupling: Carrying, operation: Shape, time: float, size: float) -> None:
        """Set the inputs of a component for the step from `time`."""
        component = coupling.components[operation.component]
        kept, slopes = [], []
        for slot in operation.slots:
            for place in range(slot.first, slot.first + slot.port.size):
                value = coupling.values[place]
                kept.append((place, value))
                smooth = self._smoothed(place, value, size)
                last_time, last = self._before.get(place, (time, smooth))
                slopes.append((smooth - last) / (time - last_time) if self.extrapolate and time > last_time else 0.0)
                self._before[place] = (time, smooth)
                coupling.values[place] = smooth
        interpolates = getattr(component, "interpolates_inputs", False)
        if not interpolates:
            for (place, _), slope in zip(kept, slopes, strict=True):
                coupling.values[place] += 0.5 * size * slope
        coupling.write(operation, time)
        if interpolates and self.extrapolate:
            component.slopes([slot.port.name for slot in operation.slots], slopes)  # type: ignore[attr-defined]
        for place, value in kept:
            coupling.values[place] = value

    def _smoothed(self, place: int, value: float, size: float) -> float:
        if self.smoothing <= 0.0:
            return value
        before = self._smooth.get(place, value)
        self._smooth[place] = before + (value - before) * -math.expm1(-size / self.smoothing)
        return self._smooth[place]

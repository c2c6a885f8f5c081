"""What a master does, as a table: reads, writes, loops and steps in their order."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

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

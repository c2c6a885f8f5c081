"""Events at one instant: clocks tick and pass their ticks on, until nothing changes any more."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from functools import cached_property

from fmus.errors import ComponentError
from orchestrator.cosim.component import Clocked
from orchestrator.cosim.masters.operations import Carrying, Get, Set
from orchestrator.cosim.wiring import OUTSIDE, Link, Slot, Wiring

# Turns at one instant, after which it will never end.
_MOST_TURNS = 1000
Clock = tuple[str, str]  # component and name


@dataclass
class Ticks:
    """How often a clock has ticked, and when it did so last, in s."""

    count: int = 0
    last: float = 0.0

    def __str__(self) -> str:
        return f"ticked {self.count} time{'s' * (self.count != 1)}, last at t = {self.last:.9g} s"


@dataclass
class Events:
    """The event modes of the components `names` of a system; `ticks` counts those of all clocks that pass theirs on."""

    wiring: Wiring
    names: Sequence[str]
    ticks: dict[str, Ticks] = field(default_factory=dict)
    # Operations are made once: who carries them out knows them by their identity.
    _writes: dict[tuple[str, tuple[int, ...]], Set] = field(default_factory=dict)

    def next(self, carrying: Carrying) -> float:
        """When the next event is due, in s."""
        return min(self._part(carrying, name).next_event() for name in self.names)

    def wanted(self, carrying: Carrying, time: float) -> bool:
        """Whether there is something to do at `time` s."""
        parts = [self._part(carrying, name) for name in self.names]
        return any(part.wants_event or part.next_event() <= time + 1e-12 * max(1.0, abs(time)) for part in parts)

    def turn(self, carrying: Carrying, time: float) -> None:
        """Tick and update until no component asks for more; all stay in event mode.

        Raises:
            ComponentError: if that does not end.
        """
        due = self._begin(carrying, time)
        active = {name for name, _ in due} | {n for n in self.names if self._part(carrying, n).wants_event}
        for _ in range(_MOST_TURNS):
            for name in active:
                self._part(carrying, name).enter_event()
            active |= self._tick(carrying, due, active, time)
            again = [name for name in active if self._part(carrying, name).update()]
            due = self._told(carrying, active)
            if not again and not due:
                return
        raise ComponentError(
            f"the events of {', '.join(sorted(active))} at t = {time:.9g} s do not end; last good state is t = {carrying.last_good:.9g} s"
        )

    def leave(self, carrying: Carrying, time: float) -> None:
        """All go back to stepping."""
        for name in self.names:
            self._part(carrying, name).leave_event(time)

    def _begin(self, carrying: Carrying, time: float) -> list[Clock]:
        """Let the clocks tick that are due, in all components, before anything is read that follows from them."""
        found: list[Clock] = []
        for name in self.names:
            due = self._part(carrying, name).due(time)
            if due:
                self._let_tick(carrying, name, due, time)
                found += [(name, clock) for clock in due]
        return found

    def _tick(self, carrying: Carrying, due: Iterable[Clock], active: set[str], time: float) -> set[str]:
        """Pass ticks on, those of output clocks first, so that all inputs are set where outputs are read; who got some."""
        reached: set[str] = set()
        waiting, done = list(due), set[Clock]()
        while True:
            told = self._told(carrying, active | reached)
            wave = [clock for clock in told or waiting if clock not in done]
            if not told:
                waiting = []
            if not wave:
                return reached
            done |= set(wave)
            for component, clock in wave:
                self._note(component, clock, time)
                self._read(carrying, component, clock, time)
            reached |= self._pass_on(carrying, wave, time)

    def _told(self, carrying: Carrying, active: Iterable[str]) -> list[Clock]:
        return [
            (name, clock) for name in self.names if name in active for clock in self._part(carrying, name).ticking()
        ]

    def _read(self, carrying: Carrying, component: str, clock: str, time: float) -> None:
        operation = self._reads.get((component, clock))
        if operation is not None:
            carrying.get(operation, time)

    def _pass_on(self, carrying: Carrying, wave: Sequence[Clock], time: float) -> set[str]:
        """Let the clocks tick that are connected to these, and set what else their outputs drive; which components these are."""
        clocks: dict[str, list[str]] = {}
        for each in wave:
            for link in self._from_clock.get(each, ()):
                clocks.setdefault(link.target.component, []).append(link.target.port.name)
            plain = [link for link in self._driven_by.get(each, ()) if not link.target.port.clocks]
            for component in dict.fromkeys(link.target.component for link in plain):
                self._set(carrying, component, [link for link in plain if link.target.component == component], time)
        for component, names in clocks.items():
            self._part(carrying, component).enter_event()
            self._let_tick(carrying, component, list(dict.fromkeys(names)), time)
        return set(clocks)

    def _let_tick(self, carrying: Carrying, component: str, clocks: Sequence[str], time: float) -> None:
        part = self._part(carrying, component)
        part.enter_event()
        part.tick(clocks)
        links = [link for clock in clocks for link in self._into.get((component, clock), ())]
        self._set(carrying, component, links, time)
        for clock in clocks:
            if (component, clock) not in self._from_clock:
                self._note(component, clock, time)

    def _set(self, carrying: Carrying, component: str, links: Sequence[Link], time: float) -> None:
        if not links:
            return
        if component == OUTSIDE:
            carrying.copy(links)
            return
        key = (component, tuple(map(id, links)))
        if key not in self._writes:
            slots = tuple({link.target.address: link.target for link in links}.values())
            self._writes[key] = Set(component, slots, tuple(links))
        carrying.set(self._writes[key], time)

    def _note(self, component: str, clock: str, time: float) -> None:
        noted = self.ticks.setdefault(f"{component}.{clock}", Ticks())
        noted.count, noted.last = noted.count + 1, time

    def _part(self, carrying: Carrying, name: str) -> Clocked:
        part = carrying.components[name]
        assert isinstance(part, Clocked)
        return part

    @cached_property
    def _reads(self) -> dict[Clock, Get]:
        """How the outputs that belong to a clock are read."""
        found: dict[Clock, list[Slot]] = {}
        for slot in self.wiring.slots:
            if slot.component in self.names and slot.port.causality == "output" and slot.port.type != "Clock":
                for clock in slot.port.clocks:
                    found.setdefault((slot.component, clock), []).append(slot)
        return {clock: Get(clock[0], tuple(slots)) for clock, slots in found.items()}

    @cached_property
    def _from_clock(self) -> dict[Clock, list[Link]]:
        found: dict[Clock, list[Link]] = {}
        for link in self.wiring.clocked:
            if link.source.port.type == "Clock":
                found.setdefault((link.source.component, link.source.port.name), []).append(link)
        return found

    @cached_property
    def _driven_by(self) -> dict[Clock, list[Link]]:
        """Links from variables that belong to a clock."""
        return _by_clock(self.wiring.clocked, lambda link: link.source)

    @cached_property
    def _into(self) -> dict[Clock, list[Link]]:
        """Links into variables that belong to a clock."""
        return _by_clock(self.wiring.clocked, lambda link: link.target)


def _by_clock(links: Iterable[Link], end: Callable[[Link], Slot]) -> dict[Clock, list[Link]]:
    found: dict[Clock, list[Link]] = {}
    for link in links:
        for clock in end(link).port.clocks:
            found.setdefault((end(link).component, clock), []).append(link)
    return found

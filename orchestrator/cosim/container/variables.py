"""What importers see of a container: open inputs, the inputs and outputs of the system, all outputs, parameters and settable states inside."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fmus.errors import MisfitError
from orchestrator.cosim.component import Port
from orchestrator.cosim.container.planned import KINDS, NUMBERS, PlannedSystem
from orchestrator.cosim.wiring import OUTSIDE, Link, Slot


@dataclass(frozen=True)
class Exposed:
    """One scalar variable of a container.

    `port` holds its type, unit, start, range and description, `place` its number among the signals, `element` its place
    in the port. `links` are those that an input is passed on by, or the one that gives an output of the system.
    `knowns` are the names of the inputs that an output depends on at the same instant.
    """

    name: str
    access: str
    port: Port
    component: str = OUTSIDE
    element: int = 0
    place: int = -1
    settable: int = 0
    links: tuple[tuple[Link, int], ...] = ()
    written: tuple[Slot, ...] = ()
    knowns: tuple[str, ...] = ()

    @property
    def start(self) -> Any:
        """The start value, None where it has none."""
        if self.port.start is None:
            return None
        return np.ravel(self.port.start)[self.element] if self.port.shape else self.port.start


def exposed_variables(planned: PlannedSystem) -> tuple[list[Exposed], list[str]]:
    """All variables, and lines about those that are left out.

    Raises:
        MisfitError: if two of them have one name.
    """
    found = _Exposing(planned)
    variables = [*found.system_inputs(), *found.of_components(), *found.system_outputs()]
    variables.append(Exposed("time", "OF_TIME", Port("time", "independent", unit="s", description="Simulation time")))
    names = [each.name for each in variables]
    for name in names:
        if names.count(name) > 1:
            raise MisfitError(
                f"{name!r} would be the name of {names.count(name)} variables; rename the input or output of the system"
            )
    return variables, found.notes


class _Exposing:
    def __init__(self, planned: PlannedSystem) -> None:
        self.planned, self.wiring = planned, planned.wiring
        self.driven = {place for link in self.wiring.links for place in link.targets}
        self.notes: list[str] = []

    def system_inputs(self) -> Iterator[Exposed]:
        """Inputs of the system, which look like outputs from inside."""
        for slot in self.wiring.slots:
            if slot.component == OUTSIDE and slot.port.causality == "output":
                yield from self._input(slot, slot.port.elements)

    def _input(self, slot: Slot, names: Sequence[str]) -> Iterator[Exposed]:
        port = replace(slot.port, causality="input")
        for element, name in enumerate(names):
            place = slot.first + element
            links = tuple(
                (link, k)
                for link in self.wiring.from_component(slot.component)
                if slot.component == OUTSIDE
                for k, source in enumerate(link.sources)
                if source == place
            )
            targets = [link.target for link, _ in links] if slot.component == OUTSIDE else [slot]
            written = {each.address: each for each in targets if each.component != OUTSIDE}
            yield Exposed(
                name, "OF_INPUT", port, slot.component, element, place, 2, links,
                tuple(written.values()),
            )  # fmt: skip

    def system_outputs(self) -> Iterator[Exposed]:
        """Outputs of the system, which look like inputs from inside."""
        for link in self.wiring.to_component(OUTSIDE):
            slot = link.target
            port = replace(slot.port, causality="output", start=None, initial="")
            for k, target in enumerate(link.targets):
                element = target - slot.first
                source = link.source.component, link.source.port.name
                knowns = tuple(dict.fromkeys(self._knowns(source, set())))
                yield Exposed(
                    slot.port.elements[element],
                    "OF_SYSTEM_OUTPUT",
                    port,
                    OUTSIDE,
                    element,
                    target,
                    0,
                    ((link, k),),
                    (),
                    knowns,
                )

    def of_components(self) -> Iterator[Exposed]:
        """Open inputs, outputs, parameters and states whose start can be set, of components, as `component.variable`."""
        for name, part in self.planned.parts.items():
            starts = self.wiring.starts.get(name, {})
            states = getattr(part.described, "state_names", ())
            for port in part.described.ports:
                begins = port.causality == "local" and port.initial == "exact" and port.name in states
                if port.causality not in ("input", "output", "parameter") and not begins:
                    continue
                slot = self.wiring.by_address.get((name, port.name))
                own = slot.port if slot is not None else port
                own = replace(own, start=starts.get(port.name, own.start))
                if port.type not in KINDS or (port.type == "String" and port.shape):
                    self.notes.append(f"{name}.{port.name} is left out: its type is {port.type}")
                    continue
                yield from self._of_port(name, own, slot)

    def _of_port(self, component: str, port: Port, slot: Slot | None) -> Iterator[Exposed]:
        names = [f"{component}.{element}" for element in port.elements]
        if port.causality == "input" and port.type in NUMBERS:
            assert slot is not None
            for each in self._input(replace(slot, port=port), names):
                if each.place not in self.driven:
                    yield each
            return
        is_signal = port.causality == "output" and port.type in NUMBERS
        knowns = tuple(dict.fromkeys(self._knowns((component, port.name), set()))) if port.causality == "output" else ()
        early = port.causality == "parameter" or port.initial in ("exact", "approx")
        settable = (
            2 if port.variability == "tunable" or port.causality == "input" else int(early and port.start is not None)
        )
        if port.causality != "output" and port.start is None:
            self.notes.append(f"{component}.{port.name} is left out: it has no start value")
            return
        for element, name in enumerate(names):
            place = slot.first + element if is_signal and slot is not None else -1
            access = "OF_OUTPUT" if is_signal else "OF_COMPONENT"
            yield Exposed(name, access, port, component, element, place, settable, knowns=knowns)

    def _knowns(self, output: tuple[str, str], seen: set[tuple[str, str]]) -> Iterator[str]:
        """Inputs of the container that an output depends on at the same instant."""
        if output in seen:
            return
        seen.add(output)
        component, name = output
        ports = [port for port in self.planned.parts[component].described.ports if port.causality == "input"]
        known = self.planned.feedthrough[component].get(name)
        for port in ports:
            if known is not None and port.name not in known:
                continue
            slot = self.wiring.by_address[component, port.name]
            for link in self.wiring.to_component(component):
                if link.target.port.name != port.name:
                    continue
                if link.source.component == OUTSIDE:
                    yield from (link.source.port.elements[k - link.source.first] for k in link.sources)
                else:
                    yield from self._knowns((link.source.component, link.source.port.name), seen)
            for element, text in enumerate(port.elements):
                if (
                    slot.first + element not in self.driven
                    and port.type in KINDS
                    and not (port.type == "String" and port.start is None)
                ):
                    yield f"{component}.{text}"

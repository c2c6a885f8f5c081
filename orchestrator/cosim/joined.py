"""Which model exchange FMUs are connected with each other, and so are integrated together."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

from orchestrator.cosim.component import Component
from orchestrator.cosim.graph import Loop, plan
from orchestrator.cosim.masters.operations import Schedule
from orchestrator.cosim.progress import Progress
from orchestrator.cosim.system import System
from orchestrator.cosim.wiring import Link, Wiring


def join_equations(
    wiring: Wiring,
    components: Mapping[str, Component],
    feedthrough: Mapping[str, Mapping[str, Sequence[str]]],
    system: System,
    progress: Progress,
) -> list[str]:
    """Join model exchange FMUs that drive each other to one system of equations; which ones, for the user.

    What cannot be joined stays coupled at communication points: FMUs in an algebraic loop, with steps of their own, or
    connected by anything but real numbers.
    """
    from orchestrator.cosim.fmu.exchange import ExchangeFmu, couple

    free = {n: c for n, c in components.items() if isinstance(c, ExchangeFmu) and system.components[n].step is None}
    inside = [
        link for link in wiring.links if _real(link) and {link.source.component, link.target.component} <= set(free)
    ]
    numbers = {name: k for k, name in enumerate(components)}
    found = []
    for names in _groups(free, inside):
        links = tuple(link for link in inside if link.source.component in names)
        order = plan(replace(wiring, links=links), feedthrough)
        if any(isinstance(part, Loop) for part in order):
            continue
        operations = Schedule(replace(wiring, links=links)).evaluation(order)
        couple([free[name] for name in names], operations, wiring.size, numbers, progress)
        found.append(", ".join(names))
    return found


def _real(link: Link) -> bool:
    types = {link.source.port.type, link.target.port.type}
    return link.is_linear and types == {"Float64"} and link.source.component != link.target.component


def _groups(names: Mapping[str, object], links: Sequence[Link]) -> list[list[str]]:
    """Sets of two or more that are connected, directly or through others."""
    group = {name: [name] for name in names}
    for link in links:
        one, other = group[link.source.component], group[link.target.component]
        if one is not other:
            one += other
            for name in other:
                group[name] = one
    unique = {id(each): each for each in group.values() if len(each) > 1}
    return [[name for name in names if name in each] for each in unique.values()]

"""The order in which outputs are read and inputs set at one instant, and the algebraic loops that have none."""

from collections import deque
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from orchestrator.cosim.wiring import OUTSIDE, Wiring

# Component and port; for a component whose output depends on all inputs also (component, "").
Node = tuple[str, str]
Feedthrough = Mapping[str, Mapping[str, Sequence[str]]]


@dataclass(frozen=True)
class Read:
    """Read these outputs of a component together; all that they depend on has been set before."""

    component: str
    outputs: tuple[str, ...]


@dataclass(frozen=True)
class Loop:
    """Values that depend on each other at one instant.

    With the inputs `tears` (component, port) guessed, the `reads` in their order give all values of the loop, those that
    the tears should have had included. `path` names the shortest way around.
    """

    tears: tuple[Node, ...]
    reads: tuple[Read, ...]
    path: tuple[str, ...]

    def __str__(self) -> str:
        return " -> ".join(self.path)


@dataclass(frozen=True)
class Delay:
    """An output that answers its inputs one step late, because the component computes it in a step only."""

    component: str
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]

    def __str__(self) -> str:
        return f"{self.component}: {', '.join(self.outputs)} follows {', '.join(self.inputs)} one step late"


def plan(wiring: Wiring, feedthrough: Feedthrough, wanted: Iterable[Node] = ()) -> tuple[Read | Loop, ...]:
    """Order the outputs that drive something, and those `wanted` beside, by what they depend on at one instant.

    After each `Read` the links from its outputs are to be followed. A component is asked as seldom as the dependencies allow.

    Args:
        wiring: of the system.
        feedthrough: for every component the inputs that each output depends on; an output that is missing depends on all.
        wanted: further outputs (component, port) to be read, such as recorded ones.
    """
    graph = _Graph(wiring, feedthrough, wanted)
    parts = strongly_connected(graph.edges)
    part_of = {node: number for number, part in enumerate(parts) for node in part}
    loops = {number: _loop(graph, part) for number, part in enumerate(parts) if len(part) > 1}
    outputs = [[node for node in part if node in graph.outputs] for part in parts]
    waits: list[set[int]] = [set() for _ in parts]
    for node, ends in graph.edges.items():
        for end in ends:
            if part_of[node] != part_of[end]:
                waits[part_of[end]].add(part_of[node])
    return tuple(_ordered(parts, outputs, waits, loops))


def without_feedthrough(wiring: Wiring, component: str) -> Mapping[str, Sequence[str]]:
    """Dependencies of a component whose outputs do not follow its inputs before the next step: none."""
    return {slot.port.name: () for slot in wiring.slots if slot.component == component}


def forced_delay(wiring: Wiring, component: str, feedthrough: Mapping[str, Sequence[str]]) -> Delay | None:
    """What comes one step late where a component's outputs do not follow its inputs; None where nothing does.

    Args:
        wiring: the links between ports.
        component: name of the component.
        feedthrough: inputs that each output follows; an output that is not named follows all.
    """
    driven = list(dict.fromkeys(link.target.port.name for link in wiring.to_component(component)))
    read = dict.fromkeys(link.source.port.name for link in wiring.from_component(component))
    late = {name: [each for each in feedthrough.get(name, driven) if each in driven] for name in read}
    outputs = tuple(name for name, inputs in late.items() if inputs)
    if not outputs:
        return None
    return Delay(component, tuple(name for name in driven if any(name in late[o] for o in outputs)), outputs)


class _Graph:
    """Edges from each input or output to those that change with it at the same instant."""

    def __init__(self, wiring: Wiring, feedthrough: Feedthrough, wanted: Iterable[Node]) -> None:
        self.edges: dict[Node, list[Node]] = {}
        inside = [link for link in wiring.links if link.source.component != OUTSIDE]
        self.outputs = dict.fromkeys((link.source.component, link.source.port.name) for link in inside)
        self.outputs.update(dict.fromkeys(wanted))
        driven: dict[str, dict[str, None]] = {}
        for link in inside:
            start, end = ((slot.component, slot.port.name) for slot in (link.source, link.target))
            if end[0] != OUTSIDE:
                self.edges.setdefault(start, []).append(end)
                driven.setdefault(end[0], {})[end[1]] = None
        for component, output in self.outputs:
            self.edges.setdefault((component, output), [])
            known = feedthrough[component].get(output)
            if known is None:
                self._through_all(component, output, driven.get(component, {}))
                continue
            for name in known:
                if name in driven.get(component, ()):
                    self.edges.setdefault((component, name), []).append((component, output))
        for ends in list(self.edges.values()):
            for end in ends:
                self.edges.setdefault(end, [])

    def _through_all(self, component: str, output: str, driven: Iterable[str]) -> None:
        """Let an output depend on all inputs, by way of one node: n + m edges instead of n m."""
        hub = (component, "")
        if hub not in self.edges:
            for name in driven:
                self.edges.setdefault((component, name), []).append(hub)
        self.edges.setdefault(hub, []).append((component, output))


def strongly_connected(edges: Mapping[Node, Sequence[Node]]) -> list[list[Node]]:
    """Sets of nodes that reach each other, each set before those that it can be reached from (Tarjan 1972)."""
    number: dict[Node, int] = {}
    lowest: dict[Node, int] = {}
    stack: list[Node] = []
    waiting: set[Node] = set()
    parts: list[list[Node]] = []
    for root in edges:
        if root in number:
            continue
        path = [(root, iter(edges[root]))]
        number[root] = lowest[root] = len(number)
        stack.append(root)
        waiting.add(root)
        while path:
            node, rest = path[-1]
            end = next((e for e in rest if e not in number or e in waiting), None)
            if end is None:
                path.pop()
                if path:
                    lowest[path[-1][0]] = min(lowest[path[-1][0]], lowest[node])
                if lowest[node] == number[node]:
                    part = [stack.pop()]
                    while part[-1] != node:
                        part.append(stack.pop())
                    parts.append(part[::-1])
                    waiting.difference_update(part)
            elif end in number:
                lowest[node] = min(lowest[node], number[end])
            else:
                number[end] = lowest[end] = len(number)
                stack.append(end)
                waiting.add(end)
                path.append((end, iter(edges[end])))
    return parts


def _ordered(
    parts: Sequence[Sequence[Node]],
    outputs: Sequence[Sequence[Node]],
    waits: Sequence[set[int]],
    loops: Mapping[int, Loop],
) -> Iterable[Read | Loop]:
    """Go through the sets in an order that their dependencies allow, reading each component as seldom as possible."""
    missing = [len(each) for each in waits]
    followers: list[list[int]] = [[] for _ in parts]
    for number, before in enumerate(waits):
        for each in before:
            followers[each].append(number)
    left: dict[str, int] = {}
    for number, found in enumerate(outputs):
        if number not in loops:
            for component, _ in found:
                left[component] = left.get(component, 0) + 1
    free = deque(number for number, count in enumerate(missing) if count == 0)
    ready: dict[str, list[int]] = {}
    while free or ready:
        if free:
            number = free.popleft()
            if number not in loops and outputs[number]:
                ready.setdefault(outputs[number][0][0], []).append(number)
                continue
            done = [number]
            if number in loops:
                yield loops[number]
        else:
            # A component all of whose outputs can be read now is asked once; another would be asked again later.
            component = next((name for name, found in ready.items() if len(found) == left[name]), next(iter(ready)))
            done = ready.pop(component)
            left[component] -= len(done)
            yield Read(component, tuple(outputs[number][0][1] for number in done))
        for number in done:
            for follower in followers[number]:
                missing[follower] -= 1
                if missing[follower] == 0:
                    free.append(follower)


def _loop(graph: _Graph, part: Sequence[Node]) -> Loop:
    inside = set(part)
    edges = {node: [end for end in graph.edges[node] if end in inside] for node in part}
    start = next(node for node in part if node in graph.outputs)
    path = [".".join(node) for node in _cycle(edges, start) if node[1]]
    tears: list[Node] = []
    cyclic = [list(part)]
    while cyclic:
        group = cyclic.pop()
        found = _tears(graph, group)
        tears += found
        cut = set(found)
        for node in edges:
            edges[node] = [end for end in edges[node] if end not in cut]
        within = set(group)
        rest = {node: [end for end in edges[node] if end in within] for node in group}
        cyclic += [each for each in strongly_connected(rest) if len(each) > 1]
    parts = strongly_connected(edges)
    part_of = {node: number for number, each in enumerate(parts) for node in each}
    waits: list[set[int]] = [set() for _ in parts]
    for node, ends in edges.items():
        for end in ends:
            waits[part_of[end]].add(part_of[node])
    outputs = [[node for node in each if node in graph.outputs] for each in parts]
    reads = tuple(step for step in _ordered(parts, outputs, waits, {}) if isinstance(step, Read))
    return Loop(tuple(tears), reads, tuple(path))


def _tears(graph: _Graph, group: Sequence[Node]) -> list[Node]:
    """The inputs within a loop of that component which has the fewest of them: cutting there breaks the loop there."""
    inputs: dict[str, list[Node]] = {}
    for node in group:
        if node not in graph.outputs and node[1]:
            inputs.setdefault(node[0], []).append(node)
    return min(inputs.values(), key=len)


def _cycle(edges: Mapping[Node, Sequence[Node]], start: Node) -> list[Node]:
    """The shortest way around through a node, which is at both ends."""
    before: dict[Node, Node] = {}
    queue = deque([start])
    while start not in before:
        node = queue.popleft()
        for end in edges[node]:
            if end not in before:
                before[end] = node
                queue.append(end)
    path = [start, before[start]]
    while path[-1] != start:
        path.append(before[path[-1]])
    return path[::-1]

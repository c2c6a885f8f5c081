"""Several buses as one: each node is on one of them, and what is for a group goes to all."""

import select
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, NamedTuple, TypeVar

import can

from fmus.errors import MisfitError
from hil.bus.messages import NO_HANDLE, Frames, frames_of
from hil.codecs.barrett.identifiers import LAST_NODE, address_of
from hil.codecs.frame import LAST_IDENTIFIER, Frame
from hil.errors import BusError

# Buses that cannot be waited for are looked at so often.
PAUSE_S = 1e-4

T = TypeVar("T")


class Part(NamedTuple):
    """A bus by its name, the way to its frames, and the nodes that are on it."""

    name: str
    bus: can.BusABC
    frames: Frames
    nodes: frozenset[int]


def name_of(settings: Mapping[str, Any]) -> str:
    """What a bus is called in messages."""
    return f"{settings.get('interface')} {settings.get('channel', '')}".strip()


def join(
    first: Mapping[str, Any], tables: Sequence[Mapping[str, Any]], opened: Callable[[Mapping[str, Any]], can.BusABC]
) -> can.BusABC:
    """A bus and those of `[[bus.also]]` as one; the bus alone if there are none.

    Args:
        first: what `opened` takes, for the bus of all nodes that no table names.
        tables: the same, and `nodes`, the numbers of the nodes on that bus.

    Raises:
        MisfitError: if a table says no nodes, or those of another one.
    """
    rest = opened(first)
    parts = [Part(name_of(first), rest, frames_of(rest), frozenset())]
    try:
        for table in tables:
            nodes = _nodes(table, parts)
            bus = opened({key: value for key, value in table.items() if key != "nodes"})
            parts.append(Part(name_of(table), bus, frames_of(bus), nodes))
    except BaseException:
        for part in parts:
            part.bus.shutdown()
        raise
    return JoinedBus(parts) if tables else rest


def _nodes(table: Mapping[str, Any], parts: Iterable[Part]) -> frozenset[int]:
    nodes = table.get("nodes", ())
    if not nodes or not all(isinstance(node, int) and 1 <= node <= LAST_NODE for node in nodes):
        raise MisfitError(f"[[bus.also]] has nodes = {nodes!r}; numbers from 1 to {LAST_NODE} were expected")
    if twice := [node for node in nodes if any(node in part.nodes for part in parts)]:
        raise MisfitError(f"[[bus.also]]: node {twice[0]} is on two buses; name it once")
    return frozenset(nodes)


class JoinedBus(can.BusABC):
    """What a session sees of several buses; what one of them says is heard in its order.

    Args:
        parts: the first one is the bus of all nodes that no other names.
    """

    def __init__(self, parts: Sequence[Part]) -> None:
        super().__init__(channel="joined")
        self.channel_info = " and ".join(part.name for part in parts)
        self._parts = tuple(parts)
        self._handles = [part.frames.handle() for part in parts]
        self._of_node = {node: part for part in parts for node in part.nodes}
        self._first = 0

    def next_frame(self, timeout_s: float) -> Frame | None:
        """The next frame of any bus; None if none comes in time.

        Raises:
            BusError: if one of them reports an error.
            CanOperationError: if one of them broke; names it.
        """
        return self._next(lambda part: part.frames.next_frame(0.0), timeout_s)

    def send_frames(self, frames: Sequence[Frame]) -> None:
        """Put each frame on the bus of its receiver, those for a group on all; a bus that broke keeps none from the others.

        Raises:
            BusError: if one of them reports an error.
            CanOperationError: if one does not take its frames; names the first of them.
        """
        ways = [self._ways(frame.identifier) for frame in frames]
        failures = []
        for part in self._parts:
            mine = [frame for frame, way in zip(frames, ways, strict=True) if part in way]
            if mine:
                try:
                    part.frames.send_frames(mine)
                except (BusError, can.CanError, OSError) as error:
                    failures.append(_named(part, error))
        if failures:
            raise failures[0]

    def handle(self) -> int:
        """None: there is one for each of them."""
        return NO_HANDLE

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        """The same for a message of python-can."""
        ways = self._parts if msg.is_extended_id else self._ways(msg.arbitration_id)
        for part in ways:
            part.bus.send(msg, timeout)

    def shutdown(self) -> None:
        """Give all buses back."""
        for part in self._parts:
            part.bus.shutdown()
        super().shutdown()

    def _ways(self, identifier: int) -> Sequence[Part]:
        if identifier > LAST_IDENTIFIER:
            return self._parts
        address = address_of(identifier)
        return self._parts if address.to_group else (self._of_node.get(address.receiver, self._parts[0]),)

    def _recv_internal(self, timeout: float | None) -> tuple[can.Message | None, bool]:
        return self._next(lambda part: part.bus.recv(0.0), timeout), True

    def _next(self, take: Callable[[Part], T | None], timeout_s: float | None) -> T | None:
        """What one of the buses has; they take turns, so that a busy one does not hide another."""
        end = None if timeout_s is None else time.monotonic() + timeout_s
        count = len(self._parts)
        numbers: Iterable[int] = [(self._first + k) % count for k in range(count)]
        while True:
            for number in numbers:
                try:
                    found = take(self._parts[number])
                except (BusError, can.CanError, OSError) as error:
                    raise _named(self._parts[number], error) from error
                if found is not None:
                    self._first = (number + 1) % count
                    return found
            left = 1.0 if end is None else end - time.monotonic()
            if left <= 0:
                return None
            numbers = self._ready(left)

    def _ready(self, seconds: float) -> Iterable[int]:
        """Numbers of the buses that may have news, as soon as one has, or time is up."""
        if NO_HANDLE in self._handles:
            time.sleep(min(seconds, PAUSE_S))
            return range(len(self._parts))
        ready = select.select(self._handles, [], [], seconds)[0]
        return [number for number, handle in enumerate(self._handles) if handle in ready]


def _named(part: Part, error: Exception) -> Exception:
    """The same error with the name of its bus."""
    kind = BusError if isinstance(error, BusError) else can.CanOperationError
    return kind(f"{part.name}: {error}")

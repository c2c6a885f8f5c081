"""Several buses as one: each node is on one of them, and what is for a group goes to all."""

import select
import time
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import can

from fmus.errors import MisfitError
from hil.codecs.barrett.identifiers import LAST_NODE, address_of
from hil.codecs.frame import LAST_IDENTIFIER

# Buses that cannot be waited for are looked at so often.
PAUSE_S = 1e-4


class Part(NamedTuple):
    """A bus, and the nodes that are on it."""

    bus: can.BusABC
    nodes: frozenset[int]


def join(
    rest: can.BusABC, tables: Sequence[Mapping[str, Any]], opened: Callable[[Mapping[str, Any]], can.BusABC]
) -> can.BusABC:
    """A bus and those of `[[bus.also]]` as one; the bus alone if there are none.

    Args:
        tables: what `opened` takes, and `nodes`, the numbers of the nodes on that bus.

    Raises:
        MisfitError: if a table says no nodes, or those of another one.
    """
    parts: list[Part] = []
    try:
        for table in tables:
            nodes = table.get("nodes", ())
            if not nodes or not all(isinstance(node, int) and 1 <= node <= LAST_NODE for node in nodes):
                raise MisfitError(f"[[bus.also]] has nodes = {nodes!r}; numbers from 1 to {LAST_NODE} were expected")
            if twice := [node for node in nodes if any(node in part.nodes for part in parts)]:
                raise MisfitError(f"[[bus.also]]: node {twice[0]} is on two buses; name it once")
            bus = opened({key: value for key, value in table.items() if key != "nodes"})
            parts.append(Part(bus, frozenset(nodes)))
    except BaseException:
        for bus in (rest, *(part.bus for part in parts)):
            bus.shutdown()
        raise
    return JoinedBus(rest, parts) if parts else rest


class JoinedBus(can.BusABC):
    """What a session sees of several buses.

    Args:
        rest: the bus of all nodes that no part names.
        parts: further buses.
    """

    def __init__(self, rest: can.BusABC, parts: Sequence[Part]) -> None:
        super().__init__(channel="joined")
        self.channel_info = " and ".join(str(bus) for bus in (rest, *(part.bus for part in parts)))
        self._rest = rest
        self._of_node: Mapping[int, can.BusABC] = {node: part.bus for part in parts for node in part.nodes}
        self._buses = (rest, *(part.bus for part in parts))
        self._first = 0

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        """Put a frame on the bus of its receiver; one for a group on all of them."""
        for bus in self._ways(msg):
            bus.send(msg, timeout)

    def shutdown(self) -> None:
        """Give all buses back."""
        for bus in self._buses:
            bus.shutdown()
        super().shutdown()

    def _ways(self, msg: can.Message) -> Sequence[can.BusABC]:
        if msg.is_extended_id or msg.arbitration_id > LAST_IDENTIFIER:
            return self._buses
        address = address_of(msg.arbitration_id)
        return self._buses if address.to_group else (self._of_node.get(address.receiver, self._rest),)

    def _recv_internal(self, timeout: float | None) -> tuple[can.Message | None, bool]:
        deadline = None if timeout is None else time.monotonic() + timeout
        while True:
            message = self._waiting()
            left = 1.0 if deadline is None else deadline - time.monotonic()
            if message is not None or left <= 0:
                return message, True
            self._wait(left)

    def _waiting(self) -> can.Message | None:
        """The next frame of any bus; they take turns, so that a busy one does not hide another."""
        count = len(self._buses)
        for k in range(count):
            number = (self._first + k) % count
            message = self._buses[number].recv(0.0)
            if message is not None:
                self._first = (number + 1) % count
                return message
        return None

    def _wait(self, seconds: float) -> None:
        try:
            handles = [bus.fileno() for bus in self._buses]
        except NotImplementedError:
            handles = [-1]
        if min(handles) < 0:
            time.sleep(min(seconds, PAUSE_S))
        else:
            select.select(handles, [], [], seconds)

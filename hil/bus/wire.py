"""A CAN bus as a session uses it: send a frame, take what has come, and torques only through the gate."""

import logging
import time
from collections.abc import Callable, Iterable, Mapping
from typing import Any

import can
from can.interfaces.socketcan import SocketcanBus

from fmus.errors import MisfitError
from hil.bus.joined import join, name_of
from hil.bus.messages import frames_of
from hil.bus.slcan import SlcanBus, SlcanVoice
from hil.bus.socketcand import SocketcandBus
from hil.codecs.barrett.identifiers import SENDER_MASK, SENDER_SHIFT
from hil.codecs.frame import Frame, Timed
from hil.errors import BusError

# python-can's client writes to the terminal whenever a frame arrives in two parts, which is no news.
logging.getLogger("can.interfaces.socketcand").setLevel(logging.ERROR)

# So many frames are 50 ms of a bus without a pause between them.
MOST_DRAINED = 512

Tap = Callable[[Timed, bool], None]

# Ours unless the settings say `client = "python-can"`.
_OWN: dict[str, Callable[..., can.BusABC]] = {"socketcand": SocketcandBus, "slcan": SlcanBus}
# For python-can's. Without it two small writes in a row wait for each other: 42 ms a cycle instead of 0.3 ms.
_ALWAYS: dict[str, dict[str, Any]] = {"socketcand": {"tcp_tune": True}, "slcan": {"sleep_after_open": 0.0}}


class Wire:
    """One bus, open until `close`.

    Torque frames are those with an identifier in `torque_identifiers`; only a `TorqueGate` sends them. `now` is the clock
    (ns) that stamps what comes; `tap` is told of every frame, and whether it was sent.
    """

    def __init__(
        self,
        bus: can.BusABC,
        torque_identifiers: frozenset[int],
        name: str,
        now: Callable[[], int] = time.monotonic_ns,
    ) -> None:
        self.bus, self.torque_identifiers, self.name, self.now = bus, torque_identifiers, name, now
        self._frames = frames_of(bus)
        self.tap: Tap = _nobody

    def send(self, *frames: Frame) -> None:
        """Put frames on the bus; several at once where it can.

        Raises:
            BusError: if the bus does not take them, or if there is a torque frame; then none is sent.
        """
        for frame in frames:
            if frame.identifier in self.torque_identifiers:
                raise BusError(f"{self.name}: torque frame {frame} did not come from the safety core; it was not sent")
        self.send_decided(*frames)

    def send_decided(self, *frames: Frame) -> None:
        """Put frames on the bus that the safety core let pass; for the loop of a session, and nobody else."""
        try:
            self._frames.send_frames(frames)
        except (can.CanError, OSError) as error:
            raise BusError(f"{self.name}: {', '.join(map(str, frames))} could not be sent: {error}") from error
        sent_ns = self.now()
        for frame in frames:
            self.tap(Timed(sent_ns, frame), True)

    def receive(self, timeout_s: float) -> Timed | None:
        """The next frame with the monotonic time at which it was taken from the bus; None if none comes in time.

        Raises:
            BusError: if the bus broke or reported an error.
        """
        try:
            frame = self._frames.next_frame(timeout_s)
        except BusError as error:
            raise BusError(f"{self.name}: {error}") from error
        except (can.CanError, OSError) as error:
            raise BusError(f"{self.name}: the bus broke while receiving: {error}") from error
        if frame is None:
            return None
        timed = Timed(self.now(), frame)
        self.tap(timed, False)
        return timed

    def drain(self, most: int = MOST_DRAINED) -> list[Timed]:
        """The frames that are waiting, so many at most: a node that babbles must not keep a cycle from going on."""
        found: list[Timed] = []
        while len(found) < most and (timed := self.receive(0.0)) is not None:
            found.append(timed)
        return found

    def listen_to(self, nodes: Iterable[int]) -> None:
        """Have the kernel leave out what comes from other nodes, on buses of which it can; hosts, number 0, are always
        heard."""
        self.hear_only([(k << SENDER_SHIFT, SENDER_MASK) for k in sorted({0, *nodes})])

    def hear_only(self, heard: Iterable[tuple[int, int]]) -> None:
        """Have the kernel leave out what fits none of these pairs of identifier and mask, on buses of which it can."""
        kernel = self.bus
        if isinstance(kernel, SocketcanBus):
            kernel.set_filters([{"can_id": k, "can_mask": mask, "extended": False} for k, mask in heard])

    def close(self) -> None:
        """Give the bus back."""
        self.bus.shutdown()


def _nobody(timed: Timed, sent: bool) -> None:
    """Nobody listens."""


def open_wire(settings: Mapping[str, Any], torque_identifiers: frozenset[int], *, beside: bool = False) -> Wire:
    """Open a bus.

    Args:
        settings: what python-can takes, such as `{"interface": "socketcan", "channel": "can0"}`; `client =
            "python-can"` takes its own clients also for the interfaces that have one here. `also` is a list of further
            buses, each with the `nodes` that are on it.
        beside: for a second wire to the same bus that need not hear anything; serial adapters have one reader only.

    Raises:
        MisfitError: if there is no such interface or channel.
    """
    also = settings.get("also", [])
    first = {key: value for key, value in settings.items() if key != "also"}
    bus = join(first, also, lambda table: _opened(table, beside))
    return Wire(bus, torque_identifiers, " and ".join(map(name_of, (first, *also))))


def _opened(settings: Mapping[str, Any], beside: bool) -> can.BusABC:
    interface = settings.get("interface")
    known = ", ".join(sorted(can.VALID_INTERFACES))
    if interface is None:
        raise MisfitError(f"[bus] names no interface; there are {known}")
    try:
        return _open(str(interface), dict(settings), beside)
    except (can.CanError, OSError, ValueError, TypeError, ImportError) as error:
        hint = (
            "docs/can_setup.md says what it needs" if interface in can.VALID_INTERFACES else f"interfaces are {known}"
        )
        raise MisfitError(f"bus {name_of(settings)!r} cannot be opened: {error}; {hint}") from error


def _open(interface: str, settings: dict[str, Any], beside: bool) -> can.BusABC:
    client = settings.pop("client", "misfit")
    if client not in ("misfit", "python-can"):
        raise ValueError(f"client = {client!r}; 'misfit' or 'python-can' was expected")
    if beside and interface == "slcan":
        return SlcanVoice(str(settings.get("channel")))
    if interface in _OWN and client == "misfit":
        del settings["interface"]
        return _OWN[interface](**settings)
    return can.Bus(**{**_ALWAYS.get(interface, {}), **settings})

"""One conformance suite over every wire: the virtual robot answers the same bytes, to python-can as it is and to our clients."""

import threading
import time
from collections.abc import Iterator
from contextlib import closing, contextmanager

import can
import pytest

from hil.bus.wire import Wire, open_wire
from hil.codecs.frame import Frame
from hil.robots import proficio
from hil.virtual.adapters import BusServer, SerialAdapter
from hil.virtual.direct_bus import DirectBus
from hil.virtual.plant import FreeJoints
from hil.virtual.robot import VirtualRobot
from hil.virtual.socketcand import SocketcandServer
from tests.hil.conformance import PATIENCE_S, answers_to_odd_messages, frame_of, message_of, wrong_answers

WIRES = ("direct", "virtual", "socketcand", "slcan")
CLIENTS = [(wire, client) for wire in WIRES for client in ("python-can", "misfit")]


def robot() -> VirtualRobot:
    return VirtualRobot(FreeJoints(proficio.HOME["right"]))


@contextmanager
def serving(server: SocketcandServer | BusServer) -> Iterator[None]:
    done = threading.Event()
    thread = threading.Thread(target=server.serve, args=(done.is_set,), daemon=True)
    thread.start()
    try:
        yield
    finally:
        done.set()
        thread.join(PATIENCE_S)


@contextmanager
def wire_to_a_robot(kind: str, client: str) -> Iterator[tuple[can.BusABC, Wire]]:
    """A new robot's bus; over sockets and terminals by one client or the other."""
    if kind == "direct":
        bus = DirectBus(robot())
        yield bus, Wire(bus, frozenset(), "direct", lambda: bus.time_ns)
        bus.shutdown()
        return
    if kind == "socketcand":
        server = SocketcandServer(robot())
        settings = {"interface": "socketcand", "host": "127.0.0.1", "port": server.port, "channel": "can0"}
        with serving(server), closing(open_wire({**settings, "client": client}, frozenset())) as wire:
            yield wire.bus, wire
        return
    far: can.BusABC = SerialAdapter() if kind == "slcan" else can.Bus(interface="virtual", channel="conformance")
    with far:
        path = far.path if isinstance(far, SerialAdapter) else "conformance"
        settings = {"interface": kind, "channel": path, "client": client}
        with serving(BusServer(robot(), far)), closing(open_wire(settings, frozenset())) as wire:
            yield wire.bus, wire


@pytest.mark.parametrize(("kind", "client"), CLIENTS)
def test_every_question_has_the_same_answers_on_every_wire(kind: str, client: str) -> None:
    with wire_to_a_robot(kind, client) as (bus, _):
        assert wrong_answers(lambda frame: bus.send(message_of(frame)), lambda s: frame_of(bus.recv(s))) == []


@pytest.mark.parametrize(("kind", "client"), CLIENTS)
def test_frames_without_messages_are_answered_the_same(kind: str, client: str) -> None:
    def receive(seconds: float) -> Frame | None:
        timed = wire.receive(seconds)
        return None if timed is None else timed.frame

    with wire_to_a_robot(kind, client) as (_, wire):
        assert wrong_answers(wire.send, receive) == []


@pytest.mark.parametrize(("kind", "client"), CLIENTS)
def test_what_a_barrett_bus_never_carries_is_not_answered(kind: str, client: str) -> None:
    with wire_to_a_robot(kind, client) as (bus, _):
        assert answers_to_odd_messages(bus) == []


@pytest.mark.parametrize("client", ["python-can", "misfit"])
def test_a_client_may_join_while_others_speak(client: str) -> None:
    """Frames glued to the last `< ok >` would end python-can's handshake; one without data would end it later."""
    server = SocketcandServer(robot())
    settings = {"interface": "socketcand", "host": "127.0.0.1", "port": server.port, "channel": "can0"}
    with serving(server), closing(open_wire(settings, frozenset())) as talker:
        done = threading.Event()

        def talk() -> None:
            while not done.is_set():
                talker.send(Frame(0x123, b""), Frame(0x404, b"\x30"))
                talker.drain()
                time.sleep(0.0005)

        thread = threading.Thread(target=talk)
        thread.start()
        try:
            for _ in range(5):
                with closing(open_wire({**settings, "client": client}, frozenset())) as wire:
                    heard = {timed.frame for timed in (wire.receive(PATIENCE_S) for _ in range(20)) if timed}
                    assert heard == {Frame(0x123, b""), Frame(0x404, b"\x30")}
        finally:
            done.set()
            thread.join(PATIENCE_S)

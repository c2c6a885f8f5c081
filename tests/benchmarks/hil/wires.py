"""What our text buses can do, against peers in other processes: frames per second, round trips, and the conformance suite.

Beside each figure is that of python-can's client, and for round trips that of a bare loop that only reads and writes bytes.
"""

import multiprocessing
import os
import select
import socket
import subprocess
import sys
import time
import tty
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np

from fmus.errors import MisfitError
from hil.bus.wire import Wire, open_wire
from hil.codecs.frame import Frame
from hil.robots.proficio import HOME
from hil.virtual.direct_bus import DirectBus
from hil.virtual.plant import FreeJoints
from hil.virtual.process import virtual_robot
from hil.virtual.robot import VirtualRobot
from tests.hil.conformance import EXCHANGES, answers_to_odd_messages, frame_of, message_of, wrong_answers

CLIENTS = ("misfit", "python-can")
QUESTION = Frame(0x404, b"\x30")
# What a peer says at once when it is asked, and at most so often without being asked.
SAYINGS = {
    "slcan": b"\rt42330003E8\r",
    "socketcand": b"< frame 423 1795222169.624496 0003E8 >",
}
_GLUED = 100


@dataclass(frozen=True)
class Speed:
    """Frames received in a second of wall time and of CPU time, and a round trip in us (p50, p99)."""

    frames_per_s: float
    frames_per_cpu_s: float
    round_trip_us: tuple[float, float]


def speed(kind: str, client: str, frames: int, trips: int) -> Speed:
    """Measure one client."""
    with _peer(kind, 0) as settings, closing(open_wire({**settings, "client": client}, frozenset())) as wire:

        def trip() -> None:
            wire.send(QUESTION)
            if wire.receive(1.0) is None:
                raise TimeoutError(f"{kind}: no answer within 1 s")

        found = _trips(trip, trips)
    with (
        _peer(kind, frames // _GLUED) as settings,
        closing(open_wire({**settings, "client": client}, frozenset())) as wire,
    ):
        wire.send(QUESTION)
        wire.receive(1.0)
        began, worked = time.perf_counter(), time.process_time()
        for _ in range(frames - 1):
            if wire.receive(1.0) is None:
                raise TimeoutError(f"{kind}: frames were lost")
        return Speed(frames / (time.perf_counter() - began), frames / (time.process_time() - worked), found)


def bare_round_trip(kind: str, trips: int) -> tuple[float, float]:
    """p50 and p99 in us of a loop that only writes and reads the same bytes."""
    answer = SAYINGS[kind]
    with _peer(kind, 0) as settings:
        if kind == "slcan":
            line = os.open(settings["channel"], os.O_RDWR | os.O_NOCTTY)
            question = b"t404130\r"
        else:
            connection = socket.create_connection((settings["host"], settings["port"]))
            connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            line, question = connection.detach(), b"< send 404 1 30 >"
            os.read(line, 64)
            for command in (b"< open can0 >", b"< rawmode >"):
                os.write(line, command)
                os.read(line, 64)

        def trip() -> None:
            os.write(line, question)
            said = b""
            while len(said) < len(answer):
                select.select([line], [], [], 1.0)
                said += os.read(line, 4096)

        try:
            return _trips(trip, trips)
        finally:
            os.close(line)


def silent_server_seconds(patience_s: float) -> float:
    """How long opening takes with a server that accepts and then says nothing."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
        settings = {"interface": "socketcand", "host": "127.0.0.1", "port": port, "channel": "can0"}
        began = time.monotonic()
        try:
            open_wire({**settings, "answer_s": patience_s}, frozenset()).close()
        except MisfitError:
            return time.monotonic() - began
    return float("inf")


def conformance() -> Iterator[tuple[str, list[str]]]:
    """Each wire and client with what was answered otherwise than it should be; robots behind wires are processes of their own."""
    bus = DirectBus(VirtualRobot(FreeJoints(HOME["right"])))
    yield "virtual", _wrong(Wire(bus, frozenset(), "virtual", lambda: bus.time_ns))
    bus.shutdown()
    for kind, robot in (("socketcand", virtual_robot), ("slcan", _robot_behind_an_adapter)):
        for client in CLIENTS:
            with robot() as settings, closing(open_wire({**settings, "client": client}, frozenset())) as wire:
                yield f"{kind} by {client}", _wrong(wire)


def _wrong(wire: Wire) -> list[str]:
    """By messages, the last exchanges once more by frames, and what is never on a Barrett bus."""
    bus = wire.bus
    found = wrong_answers(lambda frame: bus.send(message_of(frame)), lambda seconds: frame_of(bus.recv(seconds)))
    found += wrong_answers(wire.send, lambda seconds: _frame(wire, seconds), EXCHANGES[-12:])
    return found + answers_to_odd_messages(bus)


def _frame(wire: Wire, seconds: float) -> Frame | None:
    timed = wire.receive(seconds)
    return None if timed is None else timed.frame


def _trips(trip: Callable[[], None], count: int) -> tuple[float, float]:
    times = []
    for _ in range(count):
        began = time.perf_counter_ns()
        trip()
        times.append(time.perf_counter_ns() - began)
    p50, p99 = np.percentile(np.array(times) * 1e-3, [50, 99])
    return float(p50), float(p99)


@contextmanager
def _robot_behind_an_adapter() -> Iterator[dict[str, object]]:
    command = [sys.executable, "-c", "from hil.virtual.__main__ import Made, serve_slcan; serve_slcan(0, Made())"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout is not None
            yield {"interface": "slcan", "channel": process.stdout.readline().strip(), "bitrate": 1_000_000}
        finally:
            process.terminate()


@contextmanager
def _peer(kind: str, blocks: int) -> Iterator[dict[str, Any]]:
    """A process that answers each question; the first one with so many blocks of glued frames if there are any."""
    context = multiprocessing.get_context("fork")
    if kind == "slcan":
        master, slave = os.openpty()
        tty.setraw(slave)
        target: tuple[Any, ...] = (_adapter, (master, blocks))
        settings: dict[str, Any] = {"interface": "slcan", "channel": os.ttyname(slave)}
    else:
        server = socket.create_server(("127.0.0.1", 0))
        target = (_server, (server, blocks))
        port = server.getsockname()[1]
        settings = {"interface": "socketcand", "host": "127.0.0.1", "port": port, "channel": "can0"}
    process = context.Process(target=target[0], args=target[1], daemon=True)
    process.start()
    try:
        yield settings
    finally:
        process.terminate()
        process.join()
        if kind == "slcan":
            os.close(master)
            os.close(slave)
        else:
            server.close()


def _adapter(line: int, blocks: int) -> None:
    while True:
        data = os.read(line, 4096)
        if b"t" not in data:
            os.write(line, b"\r" * data.count(b"\r"))
        else:
            _say(line, SAYINGS["slcan"], blocks)


def _server(server: socket.socket, blocks: int) -> None:
    connection, _ = server.accept()
    connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    line = connection.fileno()
    os.write(line, b"< hi >")
    while data := os.read(line, 4096):
        if b"send" in data:
            _say(line, SAYINGS["socketcand"], blocks)
        else:
            os.write(line, b"< ok >")


def _say(line: int, saying: bytes, blocks: int) -> None:
    for _ in range(max(blocks, 1)):
        data = memoryview(saying if not blocks else saying * _GLUED)
        while data:
            data = data[os.write(line, data) :]

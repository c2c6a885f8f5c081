"""Why sessions over slcan are slow: `python -m tests.benchmarks.hil.terminals [--seconds S]`; about two minutes.

First bytes alone, back and forth every 2 ms between two processes with real-time priority, over a pseudo-terminal, TCP at 127.0.0.1
and a pair of sockets. Then sessions with the virtual robot behind a serial adapter on a pseudo-terminal, and over socketcand, at
several rates. Both with both cores loaded at normal priority.
"""

import argparse
import multiprocessing
import os
import select
import socket
import subprocess
import sys
import tempfile
import time
import tty
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np

from hil.control.timing import real_time_priority
from hil.robots import proficio
from hil.session.entry import Operator
from hil.session.session import run_session
from hil.settings import virtual_settings
from hil.virtual.process import virtual_robot
from tests.benchmarks.hil.burners import burning

PERIOD_NS, LATE_US = 2_000_000, 1000.0
ROBOT = "from hil.virtual.__main__ import Made, serve_slcan; serve_slcan(0, Made())"


def main() -> None:
    """Print a line for each way and rate."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=8.0, help="of each session")
    seconds = parser.parse_args().seconds
    with burning():
        for way in ("pseudo-terminal", "TCP", "pair of sockets"):
            print(_bytes_alone(way), flush=True)
        for kind, rate_hz in (("slcan", 100.0), ("slcan", 200.0), ("slcan", 500.0), ("socketcand", 500.0)):
            print(_session(kind, rate_hz, seconds), flush=True)


@contextmanager
def _ends(way: str) -> Iterator[tuple[int, int]]:
    if way == "pseudo-terminal":
        far, near = os.openpty()
        tty.setraw(far)
        tty.setraw(near)
        yield near, far
        os.close(near)
        os.close(far)
        return
    if way == "TCP":
        with socket.create_server(("127.0.0.1", 0)) as server:
            one = socket.create_connection(server.getsockname())
            other, _ = server.accept()
        for end in (one, other):
            end.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    else:
        one, other = socket.socketpair()
    with one, other:
        yield one.fileno(), other.fileno()


def _bytes_alone(way: str, count: int = 3000) -> str:
    with _ends(way) as (near, far):
        peer = multiprocessing.get_context("fork").Process(target=_echo, args=(far,), daemon=True)
        peer.start()
        times = []
        with real_time_priority() as refused:
            next_ns = time.monotonic_ns()
            for _ in range(count):
                next_ns += PERIOD_NS
                time.sleep(max(next_ns - time.monotonic_ns(), 0) * 1e-9)
                began = time.monotonic_ns()
                os.write(near, b"t0018\r")
                select.select([near], [], [])
                os.read(near, 64)
                times.append((time.monotonic_ns() - began) * 1e-3)
        peer.terminate()
        peer.join()
    p50, p99, p999 = np.percentile(times, [50, 99, 99.9])
    late = 100 * np.mean(np.array(times) > LATE_US)
    without = f"; WITHOUT {' and '.join(refused)}" if refused else ""
    return f"bytes alone, {way}: {p50:.0f} / {p99:.0f} / {p999:.0f} us (50 / 99 / 99.9 %), {late:.2f} % above 1 ms{without}"


def _echo(line: int) -> None:
    with real_time_priority(70):
        while True:
            select.select([line], [], [])
            os.write(line, os.read(line, 64))


@contextmanager
def _behind_an_adapter() -> Iterator[dict[str, object]]:
    with subprocess.Popen([sys.executable, "-c", ROBOT], stdout=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout is not None
            yield {"interface": "slcan", "channel": process.stdout.readline().strip(), "bitrate": 1_000_000}
        finally:
            process.terminate()


def _session(kind: str, rate_hz: float, seconds: float) -> str:
    robot = _behind_an_adapter if kind == "slcan" else virtual_robot
    with tempfile.TemporaryDirectory() as name, robot() as bus:
        settings = replace(virtual_settings(rate_hz=rate_hz), bus=bus)
        document = run_session(settings, seconds, Operator(lambda: True, lambda found: True), Path(name) / "session")
    late = 100 * document["answers_late"] / (proficio.JOINTS * max(document["cycles"], 1))
    stopped = "".join(f"; stopped by {fault}" for fault in document["faults"])
    return f"session over {kind} at {rate_hz:g} Hz: {late:.2f} % of answers after half a period{stopped}"


if __name__ == "__main__":
    main()

"""How late cycles begin and how long they take: a bare timer, and sessions with the virtual robot over 127.0.0.1."""

import json
import multiprocessing
import select
import socket
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hil.control.timing import SPIN_NS, RealTimer, real_time_priority
from hil.recording.records import Kind
from hil.recording.replay import read_records
from hil.robots import proficio
from hil.session.recorded import replay_session
from hil.virtual.__main__ import PRIORITY
from hil.virtual.node import ANSWER_NS
from tests.benchmarks.hil.burners import burning


@dataclass(frozen=True)
class Timing:
    """Percentiles in us (p50, p99, p99.9, largest) of lateness and of whole cycles, and what went wrong."""

    lateness: tuple[float, ...]
    cycle: tuple[float, ...]
    missed: float
    lost: int
    refused: tuple[str, ...]
    replay: str = ""


def percentiles(values_ns: list[int]) -> tuple[float, ...]:
    """p50, p99, p99.9 and the largest, in us."""
    values = np.array(values_ns or [0]) * 1e-3
    return (*np.percentile(values, [50, 99, 99.9]).round(1).tolist(), round(float(values.max()), 1))


def bare_timer(rate_hz: float, seconds: float) -> Timing:
    """A loop that does nothing but wait, with the session's own clock and priority, both cores loaded."""
    late: list[int] = []
    with burning(), real_time_priority() as refused:
        timer = RealTimer(round(1e9 / rate_hz))
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            due, now = timer.wait()
            late.append(now - due)
        missed = timer.missed
    return Timing(percentiles(late), (), 100 * missed / max(len(late), 1), 0, tuple(refused))


def bare_answer(rate_hz: float, seconds: float) -> Timing:
    """The same loop with a question in each cycle over TCP at 127.0.0.1, which another process of a robot's priority answers after the
    time that the last position takes on the bus: what is left of a cycle if neither side computes anything."""
    took: list[int] = []
    with socket.create_server(("127.0.0.1", 0)) as server, socket.create_connection(server.getsockname()) as ours:
        theirs, _ = server.accept()
        for end in (ours, theirs):
            end.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        robot = multiprocessing.get_context("fork").Process(target=_answer, args=(theirs,), daemon=True)
        robot.start()
        with burning(), real_time_priority() as refused:
            timer = RealTimer(round(1e9 / rate_hz))
            until = time.monotonic() + seconds
            while time.monotonic() < until:
                timer.wait()
                began = time.monotonic_ns()
                ours.send(b"?")
                select.select([ours], [], [])
                ours.recv(1)
                took.append(time.monotonic_ns() - began)
        robot.terminate()
        robot.join()
        theirs.close()
    return Timing((), percentiles(took), 100 * timer.missed / len(took), 0, tuple(refused))


def _answer(line: socket.socket) -> None:
    with real_time_priority(PRIORITY):
        while line.recv(1):
            due = time.monotonic_ns() + proficio.JOINTS * ANSWER_NS
            select.select([], [], [], (due - SPIN_NS - time.monotonic_ns()) * 1e-9)
            while time.monotonic_ns() < due:
                pass
            line.send(b"!")


def session(rate_hz: float, seconds: float) -> Timing:
    """`misfit hil hold --virtual`, both cores loaded; cycles are timed from its recording, which is then replayed."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name) / "session"
        command = [str(Path(sys.executable).with_name("misfit")), "hil", "hold", "--virtual", "--rate", f"{rate_hz:g}"]
        with burning():
            done = subprocess.run(
                [*command, "--seconds", f"{seconds:g}", "--out", str(folder), "--json", "-", "--quiet"],
                capture_output=True,
                text=True,
                check=False,
            )
        try:
            document = json.loads(done.stdout)
        except ValueError:
            return Timing((), (), 100.0, 0, (), f"the session failed: {done.stderr.strip()[-200:]}")
        began = time.process_time()
        found = replay_session(folder)
        speed = found.cycles / rate_hz / (time.process_time() - began)
        same = "identical" if found.first_different is None else f"cycle {found.first_different} DIFFERS"
        late = tuple(document["lateness_us"].values())
        missed = 100 * document["missed"] / max(document["cycles"], 1)
        words = f"{found.cycles} cycles {same}, {speed:.0f} times real time" + "".join(
            f"; stopped by {fault}" for fault in document["faults"]
        )
        cycle = percentiles(_cycles(folder))
        return Timing(late, cycle, missed, document["frames_lost"], tuple(document["not_permitted"]), words)


def _cycles(folder: Path) -> list[int]:
    """From the first question of each cycle to the frame that its decision sent, in ns."""
    found, start, decided = [], 0, 0
    for kind, _flags, timed in read_records(folder):
        if kind is Kind.CYCLE:
            if decided > start > 0:
                found.append(decided - start)
            start, decided = timed.time_ns, 0
        elif kind is Kind.DECIDED and not decided:
            decided = timed.time_ns
    return found

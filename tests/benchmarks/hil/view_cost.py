"""What a bench view costs the loop it looks at: `python -m tests.benchmarks.hil.view_cost [--turns N] [--seconds S]`.

One session of 500 Hz with a virtual robot; readers come and go while it runs, so that both cases see the same machine. A
reader is what a browser window makes of a studio: the session looked at 20 times a second and drawn 4 times a second in one process, and
the stop button asked 4 times a second whether it lives. Lateness is taken from the recording: cycles begin at multiples of
the period, and how much later than the earliest hundredth each one began is how late it was.
"""

import argparse
import multiprocessing
import tempfile
import time
import urllib.request
from dataclasses import replace
from multiprocessing.connection import Connection
from pathlib import Path

import numpy as np

from hil.recording.records import Kind
from hil.recording.replay import read_records
from hil.session.entry import Operator
from hil.session.session import run_session
from hil.settings import default_settings
from hil.virtual.process import virtual_robot

RATE_HZ = 500
SPAWN = multiprocessing.get_context("spawn")


def main() -> None:
    """Print lateness with and without a reader."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--turns", type=int, default=6, help="with and without")
    parser.add_argument("--seconds", type=float, default=4.0, help="of each")
    args = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "session"
        length = 2 * args.turns * args.seconds + 5.0
        session = SPAWN.Process(target=_session, args=(out, length))
        session.start()
        while not (out / "frames.bin").exists() or (out / "frames.bin").stat().st_size < 100_000:
            time.sleep(0.1)
        connection, theirs = SPAWN.Pipe()
        reader = SPAWN.Process(target=_reader, args=(theirs,))
        reader.start()
        connection.recv()  # it has imported what it needs
        began, spans, cpu_s = time.monotonic_ns(), [], 0.0
        for _ in range(args.turns):
            time.sleep(args.seconds)
            start = time.monotonic_ns()
            connection.send(args.seconds)
            cpu_s += connection.recv()
            spans.append((start, time.monotonic_ns()))
        ended = time.monotonic_ns()
        connection.send(0.0)
        reader.join()
        session.join()
        times = np.array(
            [r.timed.time_ns for r in read_records(out) if r.kind is Kind.CYCLE and began < r.timed.time_ns < ended]
        )
    _report(times, spans, cpu_s / (args.turns * args.seconds))


def _session(out: Path, seconds: float) -> None:
    """Hold a virtual robot, and go on whatever a busy machine does to it: this measures time, not safety."""
    settings = default_settings(rate_hz=RATE_HZ)
    patient = replace(settings.limits, missing_comply_s=20.0, missing_release_s=21.0, late_comply_s=20.0, stall_s=20.0)
    with virtual_robot() as bus:
        settings = replace(settings, bus=bus, gravity=False, limits=patient)
        result = run_session(settings, seconds, Operator(lambda: True, lambda robot: True), out)
    print("session:", result["faults"] or "went well", result["not_permitted"] or "with real-time priority")


def _reader(connection: Connection) -> None:
    """Look for as many seconds as it is told to, again and again; says what CPU time in s each took, ends at 0."""
    from hil.bench_view.page import _PARTS
    from hil.bench_view.sentences import state
    from hil.bench_view.watched import PAUSE_S, Sessions

    sessions = Sessions()
    connection.send(0.0)
    while seconds := connection.recv():
        end, began = time.monotonic() + seconds, time.process_time()
        turn = 0
        while time.monotonic() < end:
            sessions.find() if turn % 10 == 0 else sessions.look()
            seen = sessions.chosen(None)
            if turn % 5 == 0 and seen is not None and seen.glance is not None and seen.stop is not None:
                state(seen)
                for draw in _PARTS.values():
                    draw(seen)
                with urllib.request.urlopen(f"{seen.stop.address('127.0.0.1')}state", timeout=1.0) as answer:
                    answer.read()
            turn += 1
            time.sleep(PAUSE_S)
        connection.send(time.process_time() - began)


def _report(times: np.ndarray, spans: list[tuple[int, int]], cpu_share: float) -> None:
    period = 10**9 // RATE_HZ
    late = (times - times[0]) % period
    late = (late - np.median(late) + period // 4) % period  # the phase of the first one is chance
    late = np.maximum(late - np.percentile(late, 1.0), 0.0) * 1e-3
    read = np.zeros(len(times), dtype=bool)
    for start, end in spans:
        read |= (times >= start) & (times <= end)
    gaps = np.diff(times, prepend=times[0]) * 1e-6
    for name, chosen in (("without a reader", ~read), ("with a reader", read)):
        skipped = int(np.round(gaps[chosen] * 1e6 / period - 1).clip(0).sum())
        p50, p99, p999 = np.percentile(late[chosen], [50, 99, 99.9])
        print(
            f"{name:17s} {chosen.sum():6d} cycles: late by {p50:.0f} us (median), {p99:.0f} us (99 %), {p999:.0f} us (99.9 %);"
            f" longest gap {gaps[chosen].max():.1f} ms, {100 * skipped / (skipped + chosen.sum()):.1f} % skipped"
        )
    print(f"the reader takes {100 * cpu_share:.1f} % of a core")


if __name__ == "__main__":
    main()

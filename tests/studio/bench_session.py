"""A session with a virtual robot in a process of its own, for tests of the bench view."""

import json
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from itertools import pairwise
from pathlib import Path

from hil.recording.records import Flag, Kind
from hil.recording.replay import read_records
from hil.virtual.control import Remote

PATIENCE_S = 60.0
RATE_HZ = 50
# Rules that only a machine breaks that stands still for so long, in s.
STALLED, STANDSTILL_S = {"watched", "on_time", "positions_answered"}, 0.028
TRIES = 3


@dataclass
class Session:
    """One that runs, and records into a folder."""

    folder: Path
    process: "subprocess.Popen[str]"

    def tell(self, words: str) -> None:
        """Let something happen to the robot."""
        bus = json.loads((self.folder / "settings.json").read_text())["bus"]
        with Remote(int(bus["port"])) as remote:
            remote.tell(words)

    def end(self) -> tuple[int, list[str]]:
        """Wait for its end; exit code and faults."""
        output, errors = self.process.communicate(timeout=PATIENCE_S)
        assert "Traceback" not in errors, errors
        return self.process.returncode, json.loads(output)["faults"]

    def cycles(self) -> list[tuple[int, bool]]:
        """Time (ns) of each recorded cycle, and whether somebody wanted to stop in it."""
        records = [record for record in read_records(self.folder) if record.kind is Kind.CYCLE]
        return [(record.timed.time_ns, bool(record.flags & Flag.ABORT)) for record in records]

    def stopped_after(self, moment_ns: int) -> tuple[float, int]:
        """Time in s from a moment to the first cycle that knew of the stop, and cycles from there to the last torque."""
        told = [at for at, abort in self.cycles() if abort]
        return (told[0] - moment_ns) * 1e-9, len(told)

    def standstill_s(self) -> float:
        """Longest time without a cycle, or without an answer of the robot."""
        times = {
            kind: [record.timed.time_ns for record in read_records(self.folder) if record.kind is kind]
            for kind in (Kind.CYCLE, Kind.RECEIVED)
        }
        return max((after - before) * 1e-9 for found in times.values() for before, after in pairwise(found))

    def kill(self) -> None:
        """End it, whatever its state."""
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGCONT)
            self.process.kill()
        # What it started holds its pipes for as long as it takes to notice.
        with suppress(subprocess.TimeoutExpired):
            self.process.communicate(timeout=PATIENCE_S)


def hold(folder: Path) -> Session:
    """Hold a virtual robot, until stopped; returns when it is armed.

    On a machine that stalls, the watchdog ends a session before it has begun; then another one is begun.
    """
    for attempt in range(TRIES):
        session = _begin(folder / str(attempt))
        wait_until(partial(_is_on_its_way_or_over, session))
        if session.process.poll() is None:
            return session
        print(*session.process.communicate(timeout=PATIENCE_S), sep="\n")
    raise AssertionError("this machine is too busy for a session")


def _is_on_its_way_or_over(session: Session) -> bool:
    frames = session.folder / "frames.bin"
    return session.process.poll() is not None or (frames.exists() and frames.stat().st_size > 40_000)


def _begin(folder: Path) -> Session:
    options = ["--virtual", "--seconds", "600", "--rate", str(RATE_HZ), "--out", str(folder), "--json", "-"]
    process = subprocess.Popen(
        [sys.executable, "-m", "orchestrator.cli", "hil", "hold", *options],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    return Session(folder, process)


def wait_until(condition: Callable[[], bool]) -> None:
    """Wait for something to become true."""
    deadline = time.monotonic() + PATIENCE_S
    while not condition():
        assert time.monotonic() < deadline, "it did not happen"
        time.sleep(0.02)

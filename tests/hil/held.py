"""Sessions of `misfit hil hold` with a virtual robot, each in a process of its own and in real time.

A machine that stalls for longer than the safety rules allow ends a session by itself, as it should; then another one is begun.
"""

import json
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from hil.recording.records import Kind
from hil.recording.replay import read_records

PATIENCE_S = 60.0
# After real nodes were woken a second passes; virtual ones are awake at once.
SETTLE_S = 0.05
BEGIN = f"import hil.barrett.start_up as start; start.SETTLE_S = {SETTLE_S}; from hil.cli import hil; hil()"
# Rules that a machine breaks which stalls, and sessions that it may spoil in a row.
STALLED, TRIES = {"positions_answered", "answered", "on_time", "watched", "force_bounded"}, 5


def hold(folder: Path, seconds: float) -> subprocess.Popen[str]:
    """Begin a session."""
    arguments = ["hold", "--virtual", "--seconds", str(seconds), "--out", str(folder), "--json", "-", "--rate", "100"]
    return subprocess.Popen(
        [sys.executable, "-c", BEGIN, *arguments],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def cycles_in(folder: Path) -> int:
    """Cycles that are on disk."""
    file = folder / "frames.bin"
    written = file.exists() and file.stat().st_size > 16
    return sum(record.kind is Kind.CYCLE for record in read_records(folder)) if written else 0


class Ended(NamedTuple):
    """A session that is over; one that was killed says no faults."""

    folder: Path
    code: int
    faults: list[str]
    errors: str


def end_by(folder: Path, act: Callable[["subprocess.Popen[str]", Path], None], expected: str) -> Ended:
    """Hold until there are 100 cycles, `act` on the process and the folder of its recording, and wait for the end.

    A session whose first fault is one of a machine that stalls, and not of the rule that is `expected`, is held again.
    """
    for attempt in range(TRIES):
        session = folder / str(attempt)
        process = hold(session, 600)
        deadline = time.monotonic() + PATIENCE_S
        while process.poll() is None and cycles_in(session) < 100:
            assert time.monotonic() < deadline, "the session did not begin to cycle"
            time.sleep(0.03)
        if process.poll() is None:
            act(process, session)
        output, errors = process.communicate(timeout=PATIENCE_S)
        ended = Ended(session, process.returncode, json.loads(output)["faults"] if output else [], errors)
        first = ended.faults[0].partition(":")[0] if ended.faults else ""
        if first == expected or first not in STALLED:
            break
    return ended

"""What a loop shows of itself in shared memory: the last cycle, how late all of them were, and which rules were broken.

One writer, any number of readers, who cannot write. The writer counts up before and after it writes, so a reader that sees
an odd number, or two different ones, has looked in the middle of it and looks again.
"""

import json
import mmap
import os
import tempfile
from array import array
from bisect import bisect
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from fmus.errors import MisfitError
from hil.control.pilot import Decision, Pilot
from hil.processes import of_living, shared_folder
from hil.safety.cycle import Trip
from hil.view import layout

PREFIX = "misfit-view-"
_NOW = layout.HEAD
_NOTHING = (0.0,) * layout.JOINTS
_RULE = {name: place for place, name in enumerate(layout.RULE_NAMES)}


class Window:
    """A file in shared memory that the loop writes to; `hil.view.glance` reads it."""

    def __init__(self, path: Path, period_ns: int, about: Mapping[str, Any] | None = None) -> None:
        """Begin to show in an empty file of the right size."""
        text = json.dumps(about or {}).encode()
        if len(text) > layout.ABOUT:
            raise MisfitError(f"{len(text)} bytes about the session; a window has room for {layout.ABOUT}")
        self.path = path
        with path.open("r+b") as file:
            self._memory = mmap.mmap(file.fileno(), layout.SIZE)
        self._memory[layout.ABOUT_AT : layout.ABOUT_AT + len(text)] = text
        self._numbers = memoryview(self._memory)[: layout.PLACES * 8].cast("d")
        self._numbers[layout.PERIOD] = float(period_ns)
        self._writes = 0.0
        self._said = ""

    @staticmethod
    def create(period_ns: int, about: Mapping[str, Any] | None = None) -> "Window":
        """A new one, in shared memory where there is any.

        Args:
            about: what never changes while the session lasts; see `hil.view.about`.
        """
        windows()
        handle, name = tempfile.mkstemp(prefix=f"{PREFIX}{os.getpid()}-", dir=shared_folder())
        os.ftruncate(handle, layout.SIZE)
        os.close(handle)
        return Window(Path(name), period_ns, about)

    def put(self, start_ns: int, late_ns: int, missed: int, pilot: Pilot, decision: Decision) -> None:
        """Show a cycle; takes a few microseconds. `missed` cycles have been skipped so far."""
        outcome, observed, numbers = decision.outcome, decision.observed, self._numbers
        torques: Sequence[float] = outcome.torques or _NOTHING
        joints = (observed.q, observed.w, torques, decision.asked, observed.f)
        armed, stopped = pilot.is_armed, pilot.stopped
        late_us = late_ns * 1e-3
        self._writes += 1
        numbers[layout.BEGUN] = self._writes
        if numbers[layout.BEGAN] == 0.0:
            numbers[layout.BEGAN] = float(start_ns)
        if late_us > numbers[layout.LATEST]:
            numbers[layout.LATEST] = late_us
        numbers[layout.CLASSES + bisect(layout.EDGES, late_us)] += 1.0
        head = (start_ns, pilot.cycle, pilot.missing_answers, missed, outcome.reaction)
        stage = 2.0 if stopped is not None else float(armed)
        # A robot with fewer joints shows zeros for those that it has not, one with more its first ones.
        vectors = (part for each in joints for part in (*each, *_NOTHING)[: layout.JOINTS])
        now = array("d", (*head, stage, *vectors, *decision.shown[: layout.SIGNALS]))
        numbers[_NOW : _NOW + len(now)] = now
        if armed and outcome.trips:
            self._count(start_ns, outcome.trips)
        reason = stopped if armed else pilot.refused
        if (words := str(reason or "")) != self._said:
            self._said = words
            self._write(layout.REASON_AT, layout.REASON, words)
        numbers[layout.DONE] = self._writes

    def _count(self, time_ns: int, trips: tuple[Trip, ...]) -> None:
        """Count rules that were broken; the words are those of the last cycle with the worst reaction."""
        numbers = self._numbers
        for trip in trips:
            rule = _RULE[trip.rule]
            place = layout.TRIPS + rule * layout.PER_TRIP
            if numbers[place] == 0.0:
                numbers[place] = float(time_ns)
            numbers[place + 1] = float(time_ns)
            numbers[place + 2] += 1.0
            if trip.reaction >= numbers[place + 3]:
                numbers[place + 3] = float(trip.reaction)
                self._write(layout.WORDS_AT + rule * layout.WORDS, layout.WORDS, trip.words)

    def _write(self, at: int, size: int, words: str) -> None:
        self._memory[at : at + size] = words.encode()[:size].ljust(size, b"\0")

    def remove(self) -> None:
        """Give the memory back, and end the show."""
        self._numbers.release()
        self._memory.close()
        self.path.unlink(missing_ok=True)


def newest() -> Path:
    """The window of the session that began last.

    Raises:
        MisfitError: if none runs.
    """
    found = windows()
    if not found:
        raise MisfitError("no session runs here; start one in another terminal: misfit hil hold --virtual")
    return found[-1]


def windows() -> list[Path]:
    """Windows of sessions that run, the newest last; those of killed ones are cleared away."""
    found = []
    for path in of_living(shared_folder(), PREFIX):
        with suppress(OSError):  # gone by now
            found.append((path.stat().st_mtime, path))
    return [path for _, path in sorted(found)]

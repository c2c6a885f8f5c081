"""What a loop shows of itself in shared memory: the last cycle, how late all of them were, and why it was stopped.

One writer, any number of readers. The writer counts up before and after it writes, so a reader that sees an odd number, or
two different ones, has looked in the middle of it and looks again.
"""

import mmap
import os
import tempfile
from array import array
from bisect import bisect
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from fmus.errors import MisfitError
from hil.session.pilot import Decision, Pilot

PREFIX = "misfit-view-"
# Upper ends of the classes of lateness, in us; the last class has none.
CLASSES = (10.0, 30.0, 100.0, 300.0, 1000.0, 3000.0, 10000.0)
_JOINTS = 3
_VECTORS = ("angles", "speeds", "torques", "asked", "force")
# Doubles: two counts of the writer, period ns, begin and time of the last cycle in ns, cycles, missing answers, reaction, stage; the vectors; the classes.
_HEAD = 9
_PLACES = _HEAD + len(_VECTORS) * _JOINTS + len(CLASSES) + 1
_TEXT = 240
_TRIES = 100


@dataclass(frozen=True)
class Glance:
    """One look: times in ns, vectors by joint (force: x, y, z), counts of cycles by lateness, the reason of a stop."""

    period_ns: float
    began_ns: float
    time_ns: float
    cycles: int
    missing: int
    reaction: int
    stage: int
    angles: tuple[float, ...]
    speeds: tuple[float, ...]
    torques: tuple[float, ...]
    asked: tuple[float, ...]
    force: tuple[float, ...]
    lateness: tuple[int, ...]
    stopped: str


class Window:
    """A file in shared memory that the loop writes to and viewers read."""

    def __init__(self, path: Path) -> None:
        """Open one.

        Raises:
            MisfitError: if it is none.
        """
        self.path = path
        try:
            with path.open("r+b") as file:
                self._memory = mmap.mmap(file.fileno(), _PLACES * 8 + _TEXT)
        except (OSError, ValueError) as error:
            raise MisfitError(f"{path} shows no session: {error}; it may have ended") from error
        self._numbers = memoryview(self._memory)[: _PLACES * 8].cast("d")
        self._classes = [0.0] * (len(CLASSES) + 1)
        self._writes = 0.0
        self._said = ""

    @staticmethod
    def create(period_ns: int) -> "Window":
        """A new one, in shared memory where there is any."""
        _windows()
        handle, name = tempfile.mkstemp(prefix=f"{PREFIX}{os.getpid()}-", dir=_folder())
        os.ftruncate(handle, _PLACES * 8 + _TEXT)
        os.close(handle)
        window = Window(Path(name))
        window._numbers[2] = float(period_ns)
        return window

    def put(self, start_ns: int, late_ns: int, pilot: Pilot, decision: Decision) -> None:
        """Show a cycle; takes a few microseconds."""
        outcome, observed = decision.outcome, decision.observed
        self._classes[bisect(CLASSES, late_ns * 1e-3)] += 1
        torques: Sequence[float] = outcome.torques or (0.0,) * _JOINTS
        numbers, stage = self._numbers, 2.0 if pilot.stopped is not None else float(pilot.is_armed)
        self._writes += 1
        numbers[0] = self._writes
        if numbers[3] == 0.0:
            numbers[3] = float(start_ns)
        head = (start_ns, pilot.cycle, pilot.missing_answers, outcome.reaction, stage)
        numbers[4:] = array(
            "d", (*head, *observed.angles, *observed.speeds, *torques, *decision.asked, *observed.force, *self._classes)
        )
        if (words := str(pilot.stopped or "")) != self._said:
            self._said = words
            self._memory[_PLACES * 8 :] = words.encode()[:_TEXT].ljust(_TEXT, b"\0")
        numbers[1] = self._writes

    def look(self) -> Glance | None:
        """The last cycle; None before the first one, or if the writer never lets one look."""
        for _ in range(_TRIES):
            after = self._numbers[1]
            values = self._numbers.tolist()
            text = bytes(self._memory[_PLACES * 8 :])
            if after and self._numbers[0] == after:
                break
        else:
            return None
        places = range(_HEAD, _HEAD + len(_VECTORS) * _JOINTS, _JOINTS)
        angles, speeds, torques, asked, force = (tuple(values[place : place + _JOINTS]) for place in places)
        lateness = tuple(int(count) for count in values[_HEAD + len(_VECTORS) * _JOINTS :])
        cycles, missing, reaction, stage = (int(value) for value in values[5:_HEAD])
        said = text.rstrip(b"\0").decode("utf-8", "replace")
        period, began, last = values[2:5]
        head = (period, began, last, cycles, missing, reaction, stage)
        return Glance(*head, angles, speeds, torques, asked, force, lateness, said)

    def close(self) -> None:
        """Give the memory back; the file stays for others."""
        self._numbers.release()
        self._memory.close()

    def remove(self) -> None:
        """Give the memory back, and end the show."""
        self.close()
        self.path.unlink(missing_ok=True)


def newest() -> Path:
    """The window of the session that began last.

    Raises:
        MisfitError: if none runs.
    """
    found = sorted(_windows(), key=lambda path: path.stat().st_mtime)
    if not found:
        raise MisfitError("no session runs here; start one in another terminal: misfit hil hold --virtual")
    return found[-1]


def _windows() -> list[Path]:
    """Windows of sessions that run; those of killed ones are cleared away."""
    found = []
    for path in Path(_folder()).glob(f"{PREFIX}*"):
        if _lives(path.name.removeprefix(PREFIX).split("-")[0]):
            found.append(path)
        else:
            path.unlink(missing_ok=True)
    return found


def _lives(process: str) -> bool:
    try:
        os.kill(int(process), 0)
    except PermissionError:
        return True
    except (ValueError, OSError):
        return False
    return True


def _folder() -> str:
    return "/dev/shm" if os.access("/dev/shm", os.W_OK) else tempfile.gettempdir()

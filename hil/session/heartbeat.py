"""The loop's heartbeat, in shared memory, and whether the watchdog has had enough."""

import mmap
import os
import subprocess
import tempfile
from pathlib import Path

from hil.processes import shared_folder

_SIZE = 64
# Loop and watchdog let the arm go after so long without a sign of each other. On a machine without a real-time kernel
# gaps of 28 ms were measured in loops that were well, but rarely.
LIMIT_NS = 25_000_000
# Places of eight-byte numbers. Elements of a memoryview are stored at once; `Struct.pack_into` writes zeros first, which
# the watchdog would take for a loop that has not begun.
_BEAT, _TRIPPED, _DONE, _WATCHING = 0, 1, 2, 3
_IN_GOOD_ORDER, _ABANDONED = 1, 2


class Heartbeat:
    """One file in shared memory that loop and watchdog both open; times are monotonic ns, 0 before the first one. Each
    watches the other."""

    def __init__(self, path: Path) -> None:
        self.path = path
        with path.open("r+b") as file:
            self._memory = mmap.mmap(file.fileno(), _SIZE)
        self._numbers = memoryview(self._memory).cast("q")
        # After so long (ns) without a sign of the watchdog the loop lets the arm go.
        self.limit_ns = LIMIT_NS
        # The longest time (ns) between two beats of this side's loop: what the watchdog has waited for.
        self.longest_ns = 0
        # The process that watches, where this is the loop's side.
        self.watchdog: subprocess.Popen[str] | None = None

    @staticmethod
    def create() -> "Heartbeat":
        """A new one."""
        handle, name = tempfile.mkstemp(prefix="misfit-heartbeat-", dir=shared_folder())
        os.ftruncate(handle, _SIZE)
        os.close(handle)
        return Heartbeat(Path(name))

    def beat(self, time_ns: int) -> None:
        """Say that the loop is alive."""
        self.longest_ns = max(self.longest_ns, time_ns - (self.last_ns or time_ns))
        self._numbers[_BEAT] = time_ns

    def beat_and_look(self, time_ns: int) -> bool:
        """Say that the loop is alive; whether the watchdog has fallen silent, which cannot wait for the next cycle."""
        self.beat(time_ns)
        return self.is_watchdog_silent(time_ns)

    @property
    def last_ns(self) -> int:
        """The last beat."""
        return self._numbers[_BEAT]

    def trip(self, time_ns: int) -> None:
        """Say that the watchdog has let the arm go."""
        self._numbers[_TRIPPED] = time_ns

    @property
    def tripped_ns(self) -> int:
        """When the watchdog let the arm go; 0 if it did not."""
        return self._numbers[_TRIPPED]

    def watch(self, time_ns: int) -> None:
        """Say that the watchdog is awake."""
        self._numbers[_WATCHING] = time_ns

    @property
    def watched_ns(self) -> int:
        """When the watchdog last was awake; 0 if it never was."""
        return self._numbers[_WATCHING]

    def is_watchdog_silent(self, now_ns: int) -> bool:
        """Whether the watchdog has not been awake for too long."""
        watched_ns = self.watched_ns
        return bool(watched_ns) and now_ns - watched_ns > self.limit_ns

    @property
    def is_watched(self) -> bool:
        """Whether the watchdog is there, and content."""
        return not self.tripped_ns and (self.watchdog is None or self.watchdog.poll() is None)

    def stood_still(self, time_ns: int) -> str:
        """Words on a loop that gave no sign for too long; "" if it always did."""
        self.beat(time_ns)
        return (
            f" (the session stood still for {self.longest_ns * 1e-6:.3g} ms)" if self.longest_ns > self.limit_ns else ""
        )

    def finish(self) -> None:
        """Say that the session has ended in good order."""
        self._numbers[_DONE] = _IN_GOOD_ORDER

    def abandon(self) -> None:
        """Say that the session has ended by an error, so that nobody knows what its last torque was."""
        self._numbers[_DONE] = _ABANDONED

    @property
    def is_finished(self) -> bool:
        """Whether the session has ended, in good order or not."""
        return self._numbers[_DONE] != 0

    @property
    def is_abandoned(self) -> bool:
        """Whether it has ended by an error."""
        return self._numbers[_DONE] == _ABANDONED

    def remove(self) -> None:
        """Give the memory back."""
        self._numbers.release()
        self._memory.close()
        self.path.unlink(missing_ok=True)

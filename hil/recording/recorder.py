"""The loop's side of a recording."""

import os
import subprocess
import time
from collections.abc import Callable
from pathlib import Path

from fmus.children import child_environment, python_command
from fmus.errors import ComponentError, MisfitError
from hil.codecs.frame import Timed
from hil.control.pilot import CycleInput
from hil.recording.records import MAGIC, RECORD, Flag, Kind, pack_asked, pack_begin, pack_cycle, pack_frame
from hil.recording.ring import Ring

FRAMES = "frames.bin"
# A recorder that takes nothing for so long stands still; a disk may need a second now and then, and memory holds two minutes.
SILENT_NS = 3_000_000_000
# One that is told of the end is waited for so long, and so long if it stood still already.
PATIENCE_S, IMPATIENCE_S = 30.0, 1.0


class Recorder:
    """Records what a session does into a folder, through a process of its own; `trouble` says why it does not, "" while it does."""

    trouble = ""
    # Records that the process had taken when it was last seen to take any, and when that was.
    _taken = _taken_ns = 0

    def __init__(self, folder: Path, clock: Callable[[], int] = time.monotonic_ns) -> None:
        """Begin.

        Args:
            folder: where the recording goes.
            clock: the time (ns) in which the process that writes lives: real time, also where the session's is virtual.

        Raises:
            MisfitError: if the folder holds a recording already, or cannot be written.
        """
        if (folder / FRAMES).exists():
            raise MisfitError(f"{folder} holds a recording already; name another folder")
        try:
            folder.mkdir(parents=True, exist_ok=True)
            (folder / FRAMES).touch()
        except OSError as error:
            raise MisfitError(f"{folder} cannot be written: {error.strerror}") from error
        self.folder, self.ring, self._clock = folder, Ring.create(), clock
        self._process = subprocess.Popen(
            python_command("hil.recording.writer", str(self.ring.path), str(folder / FRAMES)),
            env=child_environment(),
            start_new_session=True,  # a closed terminal must not stop it
        )

    def keeps_up(self) -> bool:
        """Whether everything is still recorded; `trouble` says why not."""
        if self.trouble:
            return False
        now_ns = self._clock()
        if self.ring.is_empty or self.ring.taken != self._taken or not self._taken_ns:
            self._taken, self._taken_ns = self.ring.taken, now_ns
        silent_ns = now_ns - self._taken_ns
        if self.ring.overflowed:
            self.trouble = "the memory for what is to be recorded is full"
        elif self._process.poll() is not None:
            self.trouble = "the recorder has ended; the disk may be full"
        elif silent_ns > SILENT_NS:
            self.trouble = f"the recorder has stood still for {silent_ns * 1e-9:.3g} s"
        return not self.trouble

    def frame(self, timed: Timed, sent: bool) -> None:
        """Record a frame of the bus."""
        self.ring.put(pack_frame(Kind.SENT if sent else Kind.RECEIVED, timed))

    def begin(self, time_ns: int) -> None:
        """Record that the cycles begin."""
        self.ring.put(pack_begin(time_ns))

    def cycle(self, given: CycleInput) -> None:
        """Record what a decision depends on besides the frames before it."""
        wishes = (
            given.arm,
            given.abort,
            given.recording,
            given.end,
            given.watched,
            given.confirm,
            given.watchdog_silent,
        )
        flags = sum(flag for flag, wish in zip(Flag, wishes, strict=True) if wish)
        for record in pack_asked(given.start_ns, given.asked or ()):
            self.ring.put(record)
        self.ring.put(pack_cycle(given.start_ns, flags, given.computing_ns))

    def decided(self, timed: Timed) -> None:
        """Record a frame that a decision wants to send, whether or not it was sent."""
        self.ring.put(pack_frame(Kind.DECIDED, timed))

    def finish(self) -> None:
        """Wait until all is on disk; what a recorder that ended or stands still has not written is written here.

        Raises:
            ComponentError: if records were lost.
        """
        self.ring.close()
        try:
            self._process.wait(timeout=IMPATIENCE_S if self.trouble else PATIENCE_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        try:
            if self._process.returncode != 0:
                self._write_the_rest()
        except OSError as error:
            raise ComponentError(
                f"{self.folder}: records were lost: {FRAMES} cannot be written: {error.strerror}"
            ) from error
        finally:
            overflowed = self.ring.overflowed
            self.ring.remove()
        if overflowed:
            raise ComponentError(f"{self.folder}: records were lost; the recorder did not keep up")

    def _write_the_rest(self) -> None:
        """Go on after the last whole record of the file."""
        with (self.folder / FRAMES).open("r+b") as file:
            written = max(file.seek(0, os.SEEK_END) - len(MAGIC), 0) // RECORD.size
            file.seek(0)
            file.write(MAGIC)
            file.truncate(len(MAGIC) + written * RECORD.size)
            file.seek(0, os.SEEK_END)
            file.write(self.ring.since(written))
            file.flush()
            os.fsync(file.fileno())

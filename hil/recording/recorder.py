"""The loop's side of a recording."""

import contextlib
import subprocess
from pathlib import Path

from fmus.children import child_environment, python_command
from fmus.errors import ComponentError, MisfitError
from hil.codecs.frame import Timed
from hil.control.pilot import CycleInput
from hil.recording.records import Flag, Kind, pack_asked, pack_begin, pack_cycle, pack_frame
from hil.recording.ring import Ring

FRAMES = "frames.bin"


class Recorder:
    """Records what a session does into a folder, through a process of its own."""

    def __init__(self, folder: Path) -> None:
        """Begin.

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
        self.folder, self.ring = folder, Ring.create()
        self._process = subprocess.Popen(
            python_command("hil.recording.writer", str(self.ring.path), str(folder / FRAMES)),
            env=child_environment(),
            start_new_session=True,  # a closed terminal must not stop it
        )

    @property
    def is_alive(self) -> bool:
        """Whether everything is still recorded."""
        return not self.ring.overflowed and self._process.poll() is None

    def frame(self, timed: Timed, sent: bool) -> None:
        """Record a frame of the bus."""
        self.ring.put(pack_frame(Kind.SENT if sent else Kind.RECEIVED, timed))

    def begin(self, time_ns: int) -> None:
        """Record that the cycles begin."""
        self.ring.put(pack_begin(time_ns))

    def cycle(self, given: CycleInput) -> None:
        """Record what a decision depends on besides the frames before it."""
        *wishes, asked = given[3:]
        flags = sum(flag for flag, wish in zip(Flag, wishes, strict=True) if wish)
        for record in pack_asked(given.start_ns, asked or ()):
            self.ring.put(record)
        self.ring.put(pack_cycle(given.start_ns, flags, given.computing_ns))

    def decided(self, timed: Timed) -> None:
        """Record a frame that a decision wants to send, whether or not it was sent."""
        self.ring.put(pack_frame(Kind.DECIDED, timed))

    def finish(self) -> None:
        """Wait until all is on disk.

        Raises:
            ComponentError: if records were lost.
        """
        overflowed, died = self.ring.overflowed, self._process.poll() is not None
        self.ring.close()
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._process.wait(timeout=30)
        if overflowed or died or self._process.returncode != 0:
            raise ComponentError(f"{self.folder}: records were lost; the recorder did not keep up or ended early")

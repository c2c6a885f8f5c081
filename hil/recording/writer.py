"""The recorder, a process of its own: `python -m hil.recording.writer RING FILE`.

It ends when the ring is closed, or when the process that began it is gone; in both cases after the last record. Where
the disk takes no more it says so and ends, which the session notices.
"""

import os
import signal
import sys
import time
from pathlib import Path

from fmus.children import parent_process
from hil.recording.records import MAGIC, RECORD
from hil.recording.ring import Ring

# How often the ring is emptied, and the disk told to keep what it got.
PAUSE_S, SYNC_S = 0.01, 1.0


def main(ring_path: Path, file_path: Path) -> None:
    """Copy records from the ring to the file until there are no more."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the session ends first, and then says so
    ring = Ring(ring_path)
    try:
        _copy(ring, file_path)
    except OSError as error:
        sys.exit(f"misfit: {file_path} can no longer be written: {error.strerror}; the session ends")
    finally:
        ring.remove()


def _copy(ring: Ring, file_path: Path) -> None:
    parent = parent_process()
    with file_path.open("ab", buffering=0) as file:
        if file.tell() == 0:
            file.write(MAGIC)
        synced = time.monotonic()
        while True:
            done = ring.is_closed or os.getppid() != parent
            # Their room is given back when they are in the file: what a recorder that was killed in between has not written is still there.
            data = ring.waiting()
            count = len(data) // RECORD.size
            while data:  # a disk that is nearly full takes a part
                data = data[file.write(data) :]
            ring.took(count)
            if time.monotonic() - synced > SYNC_S:
                os.fsync(file.fileno())
                synced = time.monotonic()
            if done:
                break
            time.sleep(PAUSE_S)
        os.fsync(file.fileno())


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))

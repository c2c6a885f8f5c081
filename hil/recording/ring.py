"""Shared memory between the loop, which must never wait, and the recorder, which waits for the disk.

One writer, one reader, no locks: the writer counts what it has written after writing it, the reader what it has taken
after taking it. On x86 and ARM an aligned store of eight bytes is seen whole. `Struct.pack_into` is none, it writes zeros
first; an element of a memoryview in the machine's own byte order is.
"""

import mmap
import os
import tempfile
from pathlib import Path

from fmus.errors import ComponentError
from hil.processes import shared_folder
from hil.recording.records import RECORD

# Two minutes of a session at 1 kHz with eight frames a cycle.
CAPACITY = 1 << 20
# Bytes before the records; places of eight-byte numbers in them.
_HEADER, _WRITTEN, _TAKEN, _CLOSED = 64, 0, 1, 2


class Ring:
    """Records in a file that lives in memory; both sides open the same path."""

    def __init__(self, path: Path, capacity: int = CAPACITY) -> None:
        self.path, self.capacity = path, capacity
        with path.open("r+b") as file:
            self._memory = mmap.mmap(file.fileno(), _HEADER + capacity * RECORD.size)
        self._counts = memoryview(self._memory)[:_HEADER].cast("Q")
        self._written = self._counts[_WRITTEN]
        self.overflowed = False

    @staticmethod
    def create(capacity: int = CAPACITY) -> "Ring":
        """A new ring, in shared memory where there is any."""
        handle, name = tempfile.mkstemp(prefix="misfit-ring-", dir=shared_folder())
        os.ftruncate(handle, _HEADER + capacity * RECORD.size)
        os.close(handle)
        return Ring(Path(name), capacity)

    def put(self, record: bytes) -> None:
        """Add a record; if the reader is too slow it is lost, and `overflowed` says so from then on."""
        if self._written - self._counts[_TAKEN] >= self.capacity:
            self.overflowed = True
            return
        at = _HEADER + self._written % self.capacity * RECORD.size
        self._memory[at : at + RECORD.size] = record
        self._written += 1
        self._counts[_WRITTEN] = self._written

    def waiting(self) -> bytes:
        """All records that wait, one after the other; they stay until `took` says that they are kept elsewhere."""
        taken, written = self._counts[_TAKEN], self._counts[_WRITTEN]
        if not 0 <= written - taken <= self.capacity:
            raise ComponentError(f"{self.path}: the ring of records is damaged ({written} written, {taken} taken)")
        first, count = taken % self.capacity, written - taken
        until_end = min(count, self.capacity - first)
        at = _HEADER + first * RECORD.size
        data = self._memory[at : at + until_end * RECORD.size]
        return data + self._memory[_HEADER : _HEADER + (count - until_end) * RECORD.size]

    def took(self, count: int) -> None:
        """Give the room of so many records back."""
        self._counts[_TAKEN] += count

    def take(self) -> bytes:
        """All records that wait, and give their room back."""
        data = self.waiting()
        self.took(len(data) // RECORD.size)
        return data

    @property
    def taken(self) -> int:
        """Records that the reader has taken so far."""
        return self._counts[_TAKEN]

    @property
    def is_empty(self) -> bool:
        """Whether no record waits."""
        return self.taken == self._counts[_WRITTEN]

    def since(self, count: int) -> bytes:
        """All records but the first `count` that were ever put, at most `capacity` back: for who goes on in the reader's place."""
        self._counts[_TAKEN] = count
        return self.take()

    def close(self) -> None:
        """Say that nothing more will come."""
        self._counts[_CLOSED] = 1

    @property
    def is_closed(self) -> bool:
        """Whether the writer is done."""
        return self._counts[_CLOSED] == 1

    def remove(self) -> None:
        """Give the memory back."""
        self._counts.release()
        self._memory.close()
        self.path.unlink(missing_ok=True)

"""Recording to a file: rows go to the side file at once, the file proper is made of it in the end."""

import os
import signal
import tempfile
import threading
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import IO, Any

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from fmus.errors import MisfitError
from fmus.files import require_name_of_results
from orchestrator.results.column import Column
from orchestrator.results.formats import Header, format_of
from orchestrator.results.journal import Journal, batches_in, header_in, is_abandoned, journal_of

# What a killed process may lose: rows wait until there are so many, or until the next ones come so much later.
FLUSH_ROWS = 2048
FLUSH_S = 0.25
KILLED = "the run was killed before it ended"


class FileRecorder:
    """Writes a result file in the format of its ending, with bounded memory."""

    def __init__(self, path: Path) -> None:
        format_of(path)
        require_name_of_results(path)
        self.path = path
        self._journal: Journal | None = None
        self._waiting: list[tuple[NDArray[np.float64], NDArray[np.float64]]] = []
        self._count, self._flushed = 0, time.monotonic()
        self._broken = False
        self._kept = (0, path)

    @property
    def kept(self) -> tuple[int, Path]:
        """How many rows are on disk, and in which file: the result, or its side file where that could not be made."""
        return self._kept if self._journal is None else (self._journal.rows, self._journal.path)

    def begin(self, columns: Sequence[Column], provenance: Mapping[str, Any]) -> None:
        """Open the side file."""
        self._journal = Journal(self.path, Header(tuple(columns), provenance))

    def rows(self, times: NDArray[np.float64], values: NDArray[np.float64]) -> None:
        """Take times (n,) in s and values (n, k); they are forgotten once the disk has refused some."""
        if self._broken or self._journal is None:
            return
        self._waiting.append((np.array(times, dtype=float), np.array(values, dtype=float)))
        self._count += len(times)
        if self._count >= FLUSH_ROWS or time.monotonic() - self._flushed > FLUSH_S:
            self.flush()

    def flush(self) -> None:
        """Hand all rows to the operating system, where they survive the end of this process."""
        assert self._journal is not None
        with _interrupts_deferred():
            if self._waiting:
                times, values = (np.concatenate(parts) for parts in zip(*self._waiting, strict=True))
                self._broken = True
                self._journal.write(times, values)
                self._broken = False
            self._waiting, self._count, self._flushed = [], 0, time.monotonic()

    def finish(self, failure: str = "") -> None:
        """Turn the side file into the file proper; a recorder that never began leaves no file."""
        if self._journal is None:
            return
        try:
            if self._broken:
                return
            self.flush()
            self._journal.close()
            with self._journal.path.open("rb") as file:
                _make(self.path, replace(self._journal.header, failure=failure), batches_in(file))
            self._kept = (self._journal.rows, self.path)
            self._journal.remove()
        finally:
            if self._kept[0] == 0:
                self._kept = self.kept
            self._journal.release()
            self._journal = None


@contextmanager
def _interrupts_deferred() -> Iterator[None]:
    """Hold Ctrl-C back until the block has ended: after half a batch no later row could be read."""
    if threading.current_thread() is not threading.main_thread():
        yield  # Python interrupts the main thread only
        return
    heard: list[int] = []
    before = signal.signal(signal.SIGINT, lambda number, _: heard.append(number))
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before if before is not None else signal.SIG_DFL)
        if heard:
            signal.raise_signal(signal.SIGINT)


def finish_abandoned(path: Path) -> None:
    """Turn the side file that a killed run left into a result file; nothing happens while the run goes on."""
    journal = journal_of(path)
    try:
        with journal.open("rb") as file:
            if is_abandoned(file):
                _finish(path, journal, file)
    except FileNotFoundError:
        return
    except PermissionError:
        return  # somebody else's folder: it is read as it is


def _finish(path: Path, journal: Path, file: IO[bytes]) -> None:
    header = replace(header_in(file, path), failure=KILLED)
    _make(path, header, batches_in(file))
    journal.unlink(missing_ok=True)


def _make(path: Path, header: Header, batches: Iterator[pa.RecordBatch]) -> None:
    """Write the file, and what belongs to it, in a folder of its own, so that readers see the old one or the new one."""
    try:
        with tempfile.TemporaryDirectory(dir=path.parent, prefix=f".{path.name}.") as folder:
            format_of(path).write(Path(folder) / path.name, header, batches)
            for file in Path(folder).iterdir():
                os.replace(file, path.parent / file.name)
    except OSError as error:
        raise MisfitError(
            f"{path} cannot be written: {error.strerror or error}; its rows are kept in {journal_of(path).name}"
        ) from error

"""Memory that two processes share through an open file without a name, so that nothing is left when both are gone."""

import ctypes
import mmap
import os
import tempfile

import numpy as np
from numpy.typing import NDArray

from orchestrator.cosim.progress import ProgressWord

# The word has a page of its own, the result buffer follows.
PAGE = mmap.PAGESIZE


class SharedMemory:
    """A page with the progress word, and a result buffer that is added when its size is known."""

    def __init__(self, handle: int | None = None) -> None:
        self.handle = _nameless() if handle is None else handle
        self._page = mmap.mmap(self.handle, PAGE)
        self.word = ProgressWord.from_buffer(self._page)
        if handle is None:
            self.word.component = -1
        self._rest: mmap.mmap | None = None

    def reset(self) -> None:
        """Set the word back to what it is before a run."""
        ctypes.memset(ctypes.addressof(self.word), 0, ctypes.sizeof(self.word))
        self.word.component = -1

    @property
    def page(self) -> mmap.mmap:
        """The memory of the word."""
        return self._page

    def buffer(self, rows: int, columns: int) -> NDArray[np.float64]:
        """The result buffer (rows, columns), the same memory in both processes."""
        size = PAGE + max(rows * columns * 8, 1)
        if os.fstat(self.handle).st_size < size:
            os.ftruncate(self.handle, size)
        self._rest = mmap.mmap(self.handle, size)
        return np.frombuffer(self._rest, dtype=float, count=rows * columns, offset=PAGE).reshape(rows, columns)


def _nameless() -> int:
    if hasattr(os, "memfd_create"):
        handle = os.memfd_create("misfit", os.MFD_CLOEXEC)
    else:
        with tempfile.TemporaryFile() as file:
            handle = os.dup(file.fileno())
    os.ftruncate(handle, PAGE)
    return handle

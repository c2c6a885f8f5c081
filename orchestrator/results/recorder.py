"""What takes the rows of a run: memory here, files in `file_recorder`."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from orchestrator.results.column import Column
from orchestrator.results.result import Result


class Recorder(Protocol):
    """Takes rows as they come; whoever makes a recorder ends it with `finish`, also after a failure."""

    def begin(self, columns: Sequence[Column], provenance: Mapping[str, Any]) -> None:
        """Say what the rows will be."""

    def rows(self, times: NDArray[np.float64], values: NDArray[np.float64]) -> None:
        """Take times (n,) in s and values (n, k); the arrays may be reused by the caller afterwards."""

    def finish(self, failure: str = "") -> None:
        """Complete the result; `failure` is why the run ended early, if it did."""


class MemoryRecorder:
    """Keeps all rows in memory."""

    def __init__(self) -> None:
        self._columns: tuple[Column, ...] = ()
        self._provenance: Mapping[str, Any] = {}
        self._times: list[NDArray[np.float64]] = []
        self._values: list[NDArray[np.float64]] = []
        self._failure, self._complete = "", False

    def begin(self, columns: Sequence[Column], provenance: Mapping[str, Any]) -> None:
        """Say what the rows will be."""
        self._columns, self._provenance = tuple(columns), provenance

    def rows(self, times: NDArray[np.float64], values: NDArray[np.float64]) -> None:
        """Take times (n,) in s and values (n, k)."""
        self._times.append(np.array(times, dtype=float))
        self._values.append(np.array(values, dtype=float))

    def finish(self, failure: str = "") -> None:
        """Say that no more rows come."""
        self._failure, self._complete = failure, True

    def result(self) -> Result:
        """What has been recorded until now."""
        count = len(self._columns)
        values = np.concatenate(self._values) if self._values else np.zeros((0, count))
        time = np.concatenate(self._times) if self._times else np.zeros(0)
        arrays = {c.name: values[:, k].astype(c.stored_as) for k, c in enumerate(self._columns)}
        return Result(time, self._columns, arrays, self._provenance, self._failure, self._complete)


class Nowhere:
    """Forgets every row, for runs whose results nobody wants."""

    def begin(self, columns: Sequence[Column], provenance: Mapping[str, Any]) -> None:
        """Do nothing."""

    def rows(self, times: NDArray[np.float64], values: NDArray[np.float64]) -> None:
        """Do nothing."""

    def finish(self, failure: str = "") -> None:
        """Do nothing."""


def recorder_for(path: str | Path | None) -> Recorder:
    """Recorder that writes to a file, in the format of its ending, or to memory without a file.

    Raises:
        MisfitError: if no format has that ending, or the package that writes it is not installed.
    """
    if path is None:
        return MemoryRecorder()
    from orchestrator.results.file_recorder import FileRecorder

    return FileRecorder(Path(path))

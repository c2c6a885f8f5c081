"""The side file of a run that goes on: an Arrow stream beside the result, readable at any time up to the last flush.

Parquet has its index at the end and HDF5 and MF4 are not sound until they are closed, so a process that is killed would
leave nothing. The stream only grows. Its writer holds a lock, which the system drops when the writer dies.
"""

import json
import os
from collections.abc import Iterator, Sequence
from contextlib import suppress
from pathlib import Path
from typing import IO

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from fmus.errors import MisfitError
from fmus.files import try_lock
from orchestrator.results.arrow import KEY, batch_of, header_of, numpy_of, schema_of
from orchestrator.results.formats import Content, Header, as_numbers

ENDING = ".unfinished"
# Of Arrow's streaming format: the mark of a message, and a length of zero.
_END_OF_STREAM = b"\xff\xff\xff\xff\x00\x00\x00\x00"


def journal_of(path: Path) -> Path:
    """Where the side file of a result is."""
    return path.with_name(path.name + ENDING)


class Journal:
    """A stream that is being written."""

    def __init__(self, path: Path, header: Header) -> None:
        self.path, self.header = journal_of(path), header
        self.schema = schema_of(header)
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            self._file = _locked(self.path, path)
        except OSError as error:
            raise MisfitError(f"{path} cannot be written: {error.strerror}; choose another place") from error
        try:
            self._file.truncate(0)
            self._append(self.schema.serialize())
        except OSError as error:
            self.path.unlink(missing_ok=True)
            raise MisfitError(f"{path} cannot be written: {_reason(error)}; choose another place") from error
        self.rows = 0

    def write(self, times: NDArray[np.float64], values: NDArray[np.float64]) -> None:
        """Append rows; they are with the operating system when this returns.

        Raises:
            MisfitError: if they cannot be written; those that fit on the disk are kept.
        """
        try:
            self._append(batch_of(self.schema, self.header.columns, times, values).serialize())
        except OSError as error:
            half = len(times) // 2
            if half == 0:
                raise MisfitError(f"{self.path} cannot be written: {_reason(error)}; free some space") from error
            self.write(times[:half], values[:half])
            self.write(times[half:], values[half:])
            return
        self.rows += len(times)

    def _append(self, message: pa.Buffer) -> None:
        """Write a whole message of the stream, or nothing of it."""
        whole = os.fstat(self._file.fileno()).st_size
        left = memoryview(message)
        try:
            while left:
                left = left[os.write(self._file.fileno(), left) :]
        except OSError:
            with suppress(OSError):
                os.ftruncate(self._file.fileno(), whole)
            raise

    def close(self) -> None:
        """Complete the stream; the lock stays until `remove`. A full disk only takes its last mark, which readers can
        do without."""
        with suppress(OSError):
            self._append(pa.py_buffer(_END_OF_STREAM))

    def release(self) -> None:
        """Give up the lock; the side file stays, and is read in place of the result."""
        with suppress(OSError):
            self._file.close()

    def remove(self) -> None:
        """Delete the side file and give up the lock."""
        self.path.unlink(missing_ok=True)
        self._file.close()


def _reason(error: OSError) -> str:
    return error.strerror or " ".join(str(error).split())


def _locked(journal: Path, path: Path) -> IO[bytes]:
    file = journal.open("ab")
    if not is_abandoned(file):
        file.close()
        raise MisfitError(f"{path} is being written by another run; choose another name, or wait for it")
    return file


def is_abandoned(file: IO[bytes]) -> bool:
    """Whether nobody writes to a side file any more; the caller then holds its lock."""
    return try_lock(file)


def batches_in(file: IO[bytes]) -> Iterator[pa.RecordBatch]:
    """The whole batches of a side file, up to where its writer was killed."""
    file.seek(0)
    try:
        with pa.ipc.open_stream(file) as stream:
            yield from stream
    except (pa.ArrowInvalid, OSError):
        return  # the last batch is not whole


def header_in(file: IO[bytes], path: Path) -> Header:
    """Header of a side file.

    Raises:
        MisfitError: if not even that had been written.
    """
    file.seek(0)
    try:
        with pa.ipc.open_stream(file) as stream:
            schema = stream.schema
    except (pa.ArrowInvalid, OSError) as error:
        raise MisfitError(f"{path}: the run that wrote it was killed before its first row; run it again") from error
    said = json.loads(schema.metadata[KEY])
    empty = {name: np.zeros(0) for name in schema.names if name != "time"}
    return Header(header_of(schema, empty).columns, said["provenance"], said["failure"])


def read_journal(file: IO[bytes], path: Path, wanted: Sequence[str] | None) -> Content:
    """Columns of a side file as they are now.

    Args:
        file: the open side file.
        path: its path, for messages.
        wanted: names of the columns that are wanted; None for all.
    """
    header = header_in(file, path)
    file.seek(0)
    with pa.ipc.open_stream(file) as stream:
        schema = stream.schema
    table = pa.Table.from_batches(list(batches_in(file)), schema=schema)
    names = [name for name in table.schema.names if wanted is None or name in wanted]
    found = {name: as_numbers(numpy_of(table.column(name))) for name in names}
    arrays = {name: values for name, values in found.items() if values is not None}
    columns = tuple(column for column in header.columns if column.name in arrays)
    return Content(Header(columns, header.provenance, header.failure), arrays)

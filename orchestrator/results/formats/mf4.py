"""MF4 (ASAM MDF 4.10): channels with units in one group, provenance in the comment of the file."""

import gc
import json
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import asammdf
import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from fmus.errors import MisfitError
from orchestrator.results.arrow import document, grouped, numpy_of
from orchestrator.results.column import Column
from orchestrator.results.formats import Content, Header, as_numbers, kind_of

ROWS_PER_BLOCK = 131_072


def write(path: Path, header: Header, batches: Iterator[pa.RecordBatch]) -> None:
    """Write one group of channels over a common time; Booleans as 0 and 1, which MF4 has no type for.

    Args:
        path: the file.
        header: columns, provenance and failure.
        batches: rows, the first column of each time in s.
    """
    with asammdf.MDF(version="4.10") as file:
        file.header.description = document(header)
        first = True
        for group in grouped(batches, ROWS_PER_BLOCK):
            table = pa.Table.from_batches(group)
            time, *parts = (_plain(numpy_of(column)) for column in table.columns)
            if first:
                signals = [
                    asammdf.Signal(part, time, unit=c.unit, name=c.name, comment=c.description)
                    for part, c in zip(parts, header.columns, strict=True)
                ]
                file.append(signals, common_timebase=True, comment="misfit")
                first = False
            else:
                file.extend(0, [(time, None), *((part, None) for part in parts)])
        file.save(path, overwrite=True, compression=0)


def _plain(values: NDArray[Any]) -> NDArray[Any]:
    return values.astype(np.uint8) if values.dtype.kind == "b" else values


def read(path: Path, wanted: Sequence[str] | None) -> Content:
    """Read the numeric channels of a file whose groups share one time.

    Raises:
        MisfitError: if the file is none, or its groups were sampled at different times.
    """
    with _quiet_ends():
        signals, comment, failure = _contents(path, wanted)
    if failure:
        raise MisfitError(f"{path} cannot be read as MF4: {failure}")
    said = _said(comment)
    columns: list[Column] = []
    arrays: dict[str, NDArray[Any]] = {}
    time: NDArray[Any] | None = None
    for signal in signals:
        values = as_numbers(np.asarray(signal.samples))
        if values is None:
            continue
        if time is not None and not np.array_equal(time, signal.timestamps):
            raise MisfitError(
                f"{path}: channel {signal.name!r} has other times than {columns[0].name!r}; resample the file to one raster"
            )
        time = np.asarray(signal.timestamps, dtype=float)
        kind = said.get("kinds", {}).get(signal.name, kind_of(values))
        column = Column(signal.name, str(signal.unit), kind, str(signal.comment))
        arrays[column.name] = values.astype(column.stored_as)
        columns.append(column)
    if time is not None:
        arrays = {"time": time, **arrays}
        columns.insert(0, Column("time", "s"))
    return Content(Header(tuple(columns), said.get("provenance", {}), said.get("failure", "")), arrays)


def _contents(path: Path, wanted: Sequence[str] | None) -> tuple[list[Any], str, str]:
    """Signals, comment, and why there are none."""
    try:
        with asammdf.MDF(path) as file:
            signals = list(file.iter_channels(skip_master=True)) if wanted is None else _some(file, wanted)
            return signals, str(file.header.description), ""
    except Exception as error:  # asammdf raises whatever broken bytes lead to
        return [], "", " ".join(str(error).split()) or type(error).__name__


@contextmanager
def _quiet_ends() -> Iterator[None]:
    """Keep quiet about what fails while asammdf clears up after a file that it could not open."""
    hook, sys.unraisablehook = sys.unraisablehook, lambda _: None
    try:
        yield
        gc.collect()
    finally:
        sys.unraisablehook = hook


def _some(file: asammdf.MDF, wanted: Sequence[str]) -> list[Any]:
    return [file.get(name) for name in wanted if name in file and name != "time"]


def _said(comment: str) -> dict[str, Any]:
    try:
        said = json.loads(comment)
    except ValueError:
        return {}
    return said if isinstance(said, dict) else {}

"""Frames of a recording as MF4 (ASAM's bus logging), a block at a time: python-can's writer takes 3,000 frames a second."""

from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

from fmus.errors import MisfitError
from hil.recording.recorder import FRAMES
from hil.recording.records import Kind
from hil.recording.replay import record_bytes

# As `RECORD`.
_RECORDS = np.dtype(
    [("kind", "u1"), ("flags", "u1"), ("identifier", "<u2"), ("size", "<u4"), ("time_ns", "<i8"), ("data", "(8,)u1")]
)
# Names are ASAM's; data of classic frames have eight bytes.
_FRAMES = np.dtype(
    [
        (f"CAN_DataFrame.{name}", kind)
        for name, kind in (
            ("BusChannel", "<u1"), ("ID", "<u4"), ("IDE", "<u1"), ("DLC", "<u1"), ("DataLength", "<u1"),
            ("DataBytes", "(8,)u1"), ("Dir", "<u1"), ("EDL", "<u1"), ("BRS", "<u1"), ("ESI", "<u1"),
        )
    ]
)  # fmt: skip
_COMMENT = "<FHcomment><TX>frames of a recording</TX><tool_id>misfit</tool_id></FHcomment>"
# Records that are held at a time.
_BLOCK = 1 << 20


def write_mf4(folder: Path, path: Path) -> int:
    """Write the frames of a recording that were on the bus; times are monotonic seconds.

    Returns:
        How many there are.

    Raises:
        MisfitError: if there is no recording, or a damaged one.
        ImportError: if asammdf is not installed.
        OSError: if the file cannot be written.
    """
    from asammdf import MDF, Signal
    from asammdf.blocks.v4_blocks import FileHistory, SourceInformation
    from asammdf.blocks.v4_constants import BUS_TYPE_CAN, SOURCE_BUS

    table = _records(folder)
    count = 0
    with MDF(version="4.10") as mdf:
        # Two exports of a recording are the same bytes; its monotonic times begin nowhere.
        mdf.header.start_time = datetime.fromtimestamp(0, UTC)
        history = FileHistory()
        history.abs_time, history.comment = 0, _COMMENT
        mdf.file_history.append(history)
        source = SourceInformation(source_type=SOURCE_BUS, bus_type=BUS_TYPE_CAN)
        nothing: Any = (np.array([], dtype=_FRAMES), np.array([], dtype="<f8"))
        mdf.append(Signal(*nothing, name="CAN_DataFrame", source=source))
        for times, frames in _blocks(table):
            mdf.extend(0, [(times, None), (frames, None)])
            count += len(frames)
        mdf.save(path, compression=1, overwrite=True, add_history_block=False)
    return count


def _records(folder: Path) -> np.ndarray:
    data = record_bytes(folder)
    table = np.frombuffer(data, dtype=_RECORDS, count=len(data) // _RECORDS.itemsize)
    strange = np.setdiff1d(table["kind"], list(Kind))
    if len(strange):
        raise MisfitError(f"{folder / FRAMES} is damaged: a record of the kind {strange[0]}, which is not known")
    return table


def _blocks(table: np.ndarray) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Times in s and frames."""
    for start in range(0, len(table), _BLOCK):
        block = table[start : start + _BLOCK]
        block = block[np.isin(block["kind"], (Kind.RECEIVED, Kind.SENT))]
        frames = np.zeros(len(block), dtype=_FRAMES)
        frames["CAN_DataFrame.ID"] = block["identifier"]
        frames["CAN_DataFrame.DLC"] = frames["CAN_DataFrame.DataLength"] = block["size"]
        frames["CAN_DataFrame.DataBytes"] = block["data"]
        frames["CAN_DataFrame.Dir"] = block["kind"] == Kind.SENT
        yield block["time_ns"] * 1e-9, frames

"""The frames of a recording in the formats of other CAN tools."""

import tempfile
from collections.abc import Iterator
from pathlib import Path

import can

from fmus.errors import MisfitError
from hil.recording.mf4 import write_mf4
from hil.recording.records import Kind
from hil.recording.replay import read_records

FRAMES_BLF = "frames.blf"
# python-can writes more, but CSV loses the direction of frames and SQLite most of the frames.
FORMATS = (".blf", ".asc", ".mf4", ".trc", ".log")


def write_frames(folder: Path, path: Path) -> int:
    """Write all frames of a recording in the format of the file's ending; times are monotonic seconds.

    Returns:
        How many there are.

    Raises:
        MisfitError: if there is no recording, no such format, or the file cannot be written.
    """
    ending = path.suffix.lower()
    if ending not in FORMATS:
        raise MisfitError(
            f"{path}: frames are written as {', '.join(FORMATS)}, not as {ending or 'a file without ending'}"
        )
    try:
        with tempfile.TemporaryDirectory(dir=path.parent) as scratch:
            whole = Path(scratch) / f"frames{ending}"
            count = write_mf4(folder, whole) if ending == ".mf4" else _log(folder, whole)
            whole.replace(path)
    except OSError as error:
        raise MisfitError(f"{path} cannot be written: {error.strerror}") from error
    except (ImportError, NotImplementedError) as error:
        raise MisfitError(
            f"{path} needs a package that is not installed: {error}; pip install 'misfit-fmu[mf4]'"
        ) from error
    return count


def _log(folder: Path, path: Path) -> int:
    """By python-can's writer for a format."""
    count = 0
    with can.Logger(str(path)) as writer:
        for message in _messages(folder):
            writer.on_message_received(message)
            count += 1
    return count


def _messages(folder: Path) -> Iterator[can.Message]:
    for kind, _flags, timed in read_records(folder):
        if kind in (Kind.RECEIVED, Kind.SENT):
            yield can.Message(
                timestamp=timed.time_ns * 1e-9,
                arbitration_id=timed.frame.identifier,
                data=timed.frame.data,
                is_extended_id=False,
                is_rx=kind is Kind.RECEIVED,
            )

"""A log of any robot's bus as a measurement set, by a database of its messages (DBC, KCD, ...)."""

import json
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path

import can
import numpy as np

from fmus.errors import MisfitError
from fmus.files import write_atomically
from fmus.units import si_exponents
from hil.codecs.database import Database, Decoded
from hil.codecs.frame import MOST_BYTES, Frame
from hil.errors import FrameError
from orchestrator.results import Column, recorder_for

SIGNALS, CASE = "signals.parquet", "case.toml"
MOST_SHOWN = 8
# What can be read, of what python-can reads.
FORMATS = (".asc", ".blf", ".csv", ".log", ".mf4", ".trc")
# Share of the log that is learnt from; the rest is held out.
_LEARNING = 2 / 3


@dataclass
class Written:
    """What came of a log: rows, columns, the message whose times the rows have, and frames that say nothing here.

    `others` counts by identifier the frames that the database does not know or cannot decode; `units` are signals whose
    unit is not known here, which are written without one.
    """

    at: str = ""
    rows: int = 0
    columns: tuple[str, ...] = ()
    others: Counter[int] = field(default_factory=Counter)
    units: tuple[str, ...] = ()


def measurement_of_log(log: Path, database: Database, folder: Path, at: str | None = None) -> Written:
    """Write `signals.parquet` and `case.toml`; a column `MESSAGE.SIGNAL` for each signal that occurs.

    There is a row for each frame of one message; signals of others have the value that they had last. Rows from before
    every signal was there once are left out.

    Args:
        at: the message whose frames make rows; the most frequent one without it.

    Raises:
        MisfitError: if the log cannot be read, or holds nothing of the database.
    """
    found, times, said = _decoded(log, database)
    if not said:
        seen = ", ".join(f"{number:#x}" for number in sorted(found.others)[:MOST_SHOWN]) or "no frame"
        raise MisfitError(f"{log} has {seen}, none of which says {', '.join(database.messages)}; is this its database?")
    names = Counter(each.message for each in said)
    found.at = at or names.most_common(1)[0][0]
    if found.at not in names:
        raise MisfitError(f"{log} holds no message {found.at}; there are {', '.join(names)}")
    columns, odd = _columns(database, said)
    found.columns, found.units = tuple(column.name for column in columns), odd
    time, rows = _rows(times, said, found.columns, found.at)
    if len(time) < 2:
        raise MisfitError(f"{log} has {len(time)} rows at the times of {found.at}; at least 2 were expected")
    found.rows = len(time)
    recorder = recorder_for(folder / SIGNALS)
    recorder.begin(columns, {"log": log.name, "rows_at": found.at})
    recorder.rows(time - time[0], rows)
    recorder.finish()
    write_atomically(folder / CASE, _case(columns, float(time[-1] - time[0])).encode())
    return found


def _decoded(log: Path, database: Database) -> tuple[Written, list[float], list[Decoded]]:
    """Frames that the database knows, with their times in s."""
    if log.suffix.lower() not in FORMATS:
        raise MisfitError(
            f"{log}: logs are read as {', '.join(FORMATS)}, not as {log.suffix or 'a file without ending'}"
        )
    if log.suffix.lower() == ".blf" and _beginning(log) != b"LOGG":  # python-can would leave the file open
        raise MisfitError(f"{log} is no log of CAN frames: a .blf file begins with LOGG")
    found, times, said = Written(), list[float](), list[Decoded]()
    try:
        with can.LogReader(str(log)) as reader:
            for message in reader:
                _take(message, database, found, times, said)
    except MisfitError:
        raise
    except OSError as error:
        raise MisfitError(f"{log} cannot be read: {error.strerror}; name a log of CAN frames") from error
    except (ImportError, NotImplementedError) as error:
        raise MisfitError(f"{log} needs a package that is not installed: {error}") from error
    except Exception as error:  # python-can's readers raise whatever a damaged file makes of them
        raise MisfitError(f"{log} is no log of CAN frames: {' '.join(str(error).split())}") from error
    return found, times, said


def _beginning(log: Path) -> bytes:
    try:
        with log.open("rb") as file:
            return file.read(4)
    except OSError as error:
        raise MisfitError(f"{log} cannot be read: {error.strerror}; name a log of CAN frames") from error


def _take(message: can.Message, database: Database, found: Written, times: list[float], said: list[Decoded]) -> None:
    if message.is_error_frame or message.is_remote_frame or len(message.data) > MOST_BYTES:
        return
    try:
        said.append(database.decode(Frame(message.arbitration_id, bytes(message.data)), message.is_extended_id))
        times.append(message.timestamp)
    except FrameError:
        found.others[message.arbitration_id] += 1


def _columns(database: Database, said: list[Decoded]) -> tuple[list[Column], tuple[str, ...]]:
    """Columns for the signals that occur, and the names of those whose unit is not known."""
    columns, odd = [], []
    units = {message: database.units(message) for message in dict.fromkeys(each.message for each in said)}
    # Of a multiplexed message not all signals need to occur.
    for message, signal in dict.fromkeys((each.message, signal) for each in said for signal in each.signals):
        unit = units[message][signal]
        try:
            si_exponents(unit)
        except MisfitError:
            odd.append(f"{message}.{signal} ({unit})")
            unit = "1"
        columns.append(Column(f"{message}.{signal}", unit))
    return columns, tuple(odd)


def _rows(times: list[float], said: list[Decoded], names: tuple[str, ...], at: str) -> tuple[np.ndarray, np.ndarray]:
    """Times (n,) in s and values (n, columns); of frames with the same time the last one counts."""
    now: dict[str, float] = {}
    rows: dict[float, list[float]] = {}
    for time, each in zip(times, said, strict=True):
        now |= {f"{each.message}.{signal}": value for signal, value in each.signals.items()}
        if each.message == at and len(now) == len(names):
            rows[time] = [now[name] for name in names]
    order = sorted(rows)
    return np.array(order), np.array([rows[time] for time in order])


def _case(columns: list[Column], seconds: float) -> str:
    units = "\n".join(f"{json.dumps(column.name)} = {json.dumps(column.unit)}" for column in columns)
    cut, end = round(_LEARNING * seconds, 6), seconds + 2e-6  # a window does not hold its end
    return (
        f"files = [{json.dumps(SIGNALS)}]\n"
        f"learning_window_s = [0.0, {cut}]\nheld_out_window_s = [{cut}, {end:.6f}]\n\n"
        f'[columns]\ntime = "s"\n{units}\n'
    )

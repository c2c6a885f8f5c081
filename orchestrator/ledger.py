"""The history of a model: one line per version in `ledger.jsonl`, only ever added to.

A version whose figures changed, such as by a newer misfit, gets another line; the last line of a version counts.
"""

import json
import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from fmus.errors import MisfitError
from fmus.files import lock
from orchestrator.compare.result import SetErrors
from orchestrator.shown import Shown, drawing_of
from orchestrator.verdicts.result import NamedEffect

SCHEMA = "misfit.ledger/1"
FILE_NAME = "ledger.jsonl"


@dataclass(frozen=True)
class LedgerEntry:
    """One version of a model and its free-run errors.

    `version` 0 is the model as given, `model` the MODEL string that runs it, `effects` all effects in it so far.
    Errors and `noise_floor` are in `units`; hashes are hexadecimal sha256 of content; `date` is ISO 8601 in UTC.
    """

    version: int
    name: str
    model: str
    effects: tuple[NamedEffect, ...]
    learning: SetErrors
    held_out: SetErrors | None
    noise_floor: Mapping[str, float]
    units: Mapping[str, str]
    model_hash: str
    data_hash: str
    date: str
    misfit_version: str


class Ledger(list[LedgerEntry]):
    """All versions, the oldest first; a list that a notebook shows as a table and a picture."""

    def plot(self) -> Shown:
        """The error of each version.

        Raises:
            MisfitError: if there are fewer than two.
        """
        return drawing_of("ledger").plot(self)

    def _repr_html_(self) -> str:
        return drawing_of("ledger").html(self)


def append(folder: Path, entry: LedgerEntry) -> None:
    """Add one version to the ledger in `folder`, which is created if needed; on return the line is on disk.

    Raises:
        MisfitError: if the folder or the file cannot be written.
    """
    line = _to_line(entry)
    path = folder / FILE_NAME
    try:
        folder.mkdir(parents=True, exist_ok=True)
        handle = os.open(path, os.O_RDWR | os.O_CREAT | os.O_APPEND | getattr(os, "O_CLOEXEC", 0), 0o644)
        try:
            lock(handle)
            _write_line(handle, line)
        finally:
            os.close(handle)
        _sync_folder(folder)
    except OSError as error:
        reason = error.strerror or error
        raise MisfitError(
            f"{path}: version {entry.version} could not be recorded ({reason}); free it and retry"
        ) from error


def read(folder: Path) -> Ledger:
    """Return the versions in the order they were first recorded, each with its newest figures; a last line without its end is
    left out.

    Raises:
        MisfitError: if there is no ledger, or a complete line is damaged; names the file and the line.
    """
    path = folder / FILE_NAME
    try:
        content = path.read_bytes()
    except FileNotFoundError:
        raise MisfitError(f"{folder} has no {FILE_NAME}; give the folder that 'misfit discover --out' wrote") from None
    except OSError as error:
        raise MisfitError(f"{path} cannot be read: {error.strerror or error}") from error
    complete = content.split(b"\n")[:-1]
    entries = [_from_line(line, f"{path} line {number}") for number, line in enumerate(complete, start=1)]
    return Ledger({(entry.version, entry.model_hash, entry.data_hash): entry for entry in entries}.values())


def newest(entries: Sequence[LedgerEntry]) -> list[LedgerEntry]:
    """The versions along the measurements of the newest one: errors along others cannot be compared with these."""
    return [entry for entry in entries if entry.data_hash == entries[-1].data_hash]


def _write_line(handle: int, line: bytes) -> None:
    """Cut off a line that a killed writer left unfinished, then write the new one as a whole or not at all."""
    end = _end_of_complete_lines(handle)
    os.ftruncate(handle, end)
    try:
        written = os.write(handle, line)
        if written != len(line):
            raise OSError(f"{written} of {len(line)} bytes written, is the disk full?")
        os.fsync(handle)
    except OSError:
        os.ftruncate(handle, end)
        raise


def _end_of_complete_lines(handle: int) -> int:
    size = os.fstat(handle).st_size
    content = os.pread(handle, size, 0)
    return content.rfind(b"\n") + 1


def _sync_folder(folder: Path) -> None:
    """Make the name of a new file survive a power cut, as fsync of the file alone does not."""
    handle = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def _to_line(entry: LedgerEntry) -> bytes:
    document = {"schema": SCHEMA} | _strict(asdict(entry))
    return json.dumps(document, allow_nan=False).encode() + b"\n"


def _strict(value: Any) -> Any:
    """Spell numbers that JSON lacks as text, which `float` reads back: a version that diverged has infinite error."""
    if isinstance(value, Mapping):
        return {key: _strict(part) for key, part in value.items()}
    if isinstance(value, list | tuple):
        return [_strict(part) for part in value]
    if isinstance(value, float):
        return float(value) if math.isfinite(value) else str(float(value))
    return value


def _from_line(line: bytes, where: str) -> LedgerEntry:
    try:
        document = json.loads(line)
        schema = document.get("schema")
        if schema == SCHEMA:
            return _entry(document)
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError) as error:
        raise MisfitError(f"{where} is damaged; restore the file from a copy or delete this line") from error
    raise MisfitError(f"{where} has schema {schema!r:.60}, expected {SCHEMA!r}; read it with the misfit that wrote it")


def _entry(document: Mapping[str, Any]) -> LedgerEntry:
    held_out = document["held_out"]
    return LedgerEntry(
        version=int(document["version"]),
        **{key: str(document[key]) for key in ("name", "model", "model_hash", "data_hash", "date", "misfit_version")},
        effects=tuple(NamedEffect.of(part) for part in document["effects"]),
        learning=_errors(document["learning"]),
        held_out=None if held_out is None else _errors(held_out),
        noise_floor=_numbers(document["noise_floor"]),
        units={signal: str(unit) for signal, unit in document["units"].items()},
    )


def _errors(document: Mapping[str, Any]) -> SetErrors:
    return SetErrors(_numbers(document["rmse"]), float(document["over_floor"]))


def _numbers(document: Mapping[str, Any]) -> dict[str, float]:
    return {signal: float(value) for signal, value in document.items()}

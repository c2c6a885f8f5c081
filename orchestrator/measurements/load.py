"""From a path to a measurement set: find the files, read each once, split them into trials."""

import hashlib
from pathlib import Path

from fmus.errors import MisfitError
from orchestrator.measurements.case_file import CaseFile, read_case_file
from orchestrator.measurements.dirty.header_units import without_units
from orchestrator.measurements.dirty.reading import Reading
from orchestrator.measurements.dirty.repair import TIME, repaired
from orchestrator.measurements.dirty.text_table import read_text_table
from orchestrator.measurements.record import rate_notes, read_record
from orchestrator.measurements.table import Table, read_table
from orchestrator.measurements.trial import MeasurementSet, Record
from orchestrator.measurements.wording import listed

TEXT_ENDINGS = (".csv", ".txt", ".tsv", ".dat", ".asc", ".log")
TYPED_ENDINGS = (".parquet", ".mf4", ".mdf", ".h5", ".hdf5")
# Text of another ending is a table only where a [reading] says how it is read.
_ENDINGS = (".csv", *TYPED_ENDINGS)


def load_measurements(path: str | Path) -> MeasurementSet:
    """Load the measurement set at a folder, a case.toml or a single csv, parquet, mf4 or h5 file.

    Without a case.toml, every such file of the folder is a trial (in the order of the names), units are
    those that the files say, and the last third is held out: of the trials, or of a single record's time.

    Returns:
        Time in s, everything else in the units of the files; what was assumed stands in `notes`.

    Raises:
        MisfitError: the path, case.toml or a data file cannot be used; one line names the file, the
            line or column, the value, what was expected and what to do.
    """
    path = Path(path)
    folder, case, digest = _described(path)
    records: list[Record] = []
    repairs: list[str] = []
    frames: list[str] = []
    for name in case.files:
        if case.reading_of(name) is None:
            _require_known_ending(folder / name)
        content = _read(folder / name)
        digest.update(f"{name}\0{len(content)}\0".encode(errors="surrogateescape"))
        digest.update(content)
        table = _table(folder / name, content, case, name)
        records.append(read_record(name, table, case))
        repairs.extend(table.notes)
        frames.append(table.frame)
    notes = [*case.notes, *repairs, *case.split.notes(records)]
    for record in records:
        notes.extend(rate_notes(record, case.rate_hz))
    return MeasurementSet(
        path=path,
        trials=case.split.trials(records),
        sensors=case.sensors,
        variables=case.variables,
        initial_conditions_given=case.initial_conditions_given,
        tolerances=case.tolerances,
        interpolation=case.interpolation,
        frame=case.frame or next(filter(None, frames), ""),
        units_certain=case.units_certain,
        notes=tuple(notes),
        content_hash=digest.hexdigest(),
    )


def load_records(path: str | Path) -> tuple[Record, ...]:
    """Load the files of the measurement set at a path as they are, each as a whole, in the order of the set.

    Raises:
        MisfitError: as for `load_measurements`.
    """
    folder, case, _ = _described(Path(path))
    records = []
    for name in case.files:
        if case.reading_of(name) is None:
            _require_known_ending(folder / name)
        records.append(read_record(name, _table(folder / name, _read(folder / name), case, name), case))
    return tuple(records)


def _described(path: Path) -> "tuple[Path, CaseFile, hashlib._Hash]":
    """Find out which folder holds which files, and begin the hash with the case.toml if there is one."""
    folder, case_path = _located(path)
    if case_path is None:
        files = _data_names(path) if path.is_dir() else (path.name,)
        if not files:
            raise MisfitError(
                f"{path}: no case.toml and no *.csv file in this folder; expected recorded trials as csv, parquet or mf4 files"
            )
        note = f"{path}: no case.toml is used, so units are those of the file, if any, and columns are matched by name"
        return folder, CaseFile(files, notes=(note,)), hashlib.sha256()
    content = _read(case_path)
    case = read_case_file(case_path, content, _data_names(folder))
    return folder, case, hashlib.sha256(content)


def _located(path: Path) -> tuple[Path, Path | None]:
    """Give the folder of the data and the case.toml, which is None where there is none."""
    try:
        if path.is_dir():
            case_path = path / "case.toml"
            return path, case_path if case_path.exists() else None
        exists = path.exists()
    except (OSError, ValueError) as error:
        raise MisfitError(f"{str(path)!r}: not a usable path ({error})") from error
    if not exists:
        raise MisfitError(
            f"{path}: does not exist; expected a folder with case.toml, a case.toml or a csv, parquet or mf4 file"
        )
    if path.suffix.lower() == ".toml":
        return path.parent, path
    _require_known_ending(path)
    return path.parent, None


def _data_names(folder: Path) -> tuple[str, ...]:
    try:
        names = [file.name for file in folder.iterdir() if not file.name.startswith(".")]
    except OSError as error:
        raise MisfitError(f"{folder}: cannot be read ({error.strerror})") from error
    return tuple(sorted(name for name in names if name.lower().endswith(_ENDINGS)))


def _require_known_ending(file: Path) -> None:
    ending = file.suffix.lower()
    if ending not in _ENDINGS:
        raise MisfitError(
            f"{file}: ending {ending!r}, expected a folder with case.toml, a case.toml or a csv, parquet or mf4 file"
        )


def _table(file: Path, content: bytes, case: CaseFile, name: str) -> Table:
    reading = case.reading_of(name)
    if reading is not None:
        needed = [column for column, variable in case.variables.items() if variable != TIME]
        return repaired(read_any_table(file, content, reading), reading, needed, case.interpolation)
    if file.suffix.lower() == ".csv":
        return without_units(read_table(file, content), {*case.units, *case.variables, *case.interpolation})
    from orchestrator.measurements.table import read_typed_table

    return read_typed_table(file)


def read_any_table(file: Path, content: bytes, reading: Reading) -> Table:
    """Read a file as [reading] says, with NaN where a sample has no value.

    Args:
        file: the file, whose ending says what it is.
        content: its bytes.
        reading: how a text file is read.

    Raises:
        MisfitError: the file is not what [reading] says, or is damaged.
    """
    if file.suffix.lower() in TYPED_ENDINGS:
        from orchestrator.measurements.table import read_typed_table

        return read_typed_table(file, holes=True)
    return read_text_table(file, content, reading)


def _read(file: Path) -> bytes:
    try:
        return file.read_bytes()
    except FileNotFoundError as error:
        beside = listed(_data_names(file.parent)) if file.parent.is_dir() else "none"
        raise MisfitError(
            f"{file}: does not exist, but case.toml names it; data files in that folder: {beside}"
        ) from error
    except (OSError, ValueError) as error:
        raise MisfitError(f"{file}: cannot be read ({error})") from error

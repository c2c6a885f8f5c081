"""What a case.toml says, checked on its own before any data file is opened."""

import difflib
from collections.abc import Mapping
from dataclasses import dataclass, field
from os.path import normpath
from pathlib import Path

from fmus.errors import MisfitError
from fmus.units import conversion
from orchestrator.measurements.dirty.reading import Reading, read_reading
from orchestrator.measurements.sensors import sensor_key
from orchestrator.measurements.split import LastThird, Split, read_split
from orchestrator.measurements.toml_values import TomlTable, number
from orchestrator.measurements.wording import shown

_KNOWN_KEYS = (
    "files",
    "learning",
    "held_out",
    "learning_window_s",
    "held_out_window_s",
    "sampling",
    "columns",
    "variables",
    "sensors",
    "tolerances",
    "initial_conditions",
    "reading",
    "interpolation",
    "frame",
    "units_certain",
)
INTERPOLATIONS = ("linear", "hold")
# Free text for people, which needs no remark.
_REMARK_KEYS = ("note", "notes", "name", "title", "description", "source", "license")


@dataclass(frozen=True)
class CaseFile:
    """A measurement set as described, before any data file is read.

    `units` maps a column to its unit, `variables` a column to a model variable, `sensors` a key of [sensors] to its
    number, `tolerances` a model parameter to its relative standard deviation. `rate_hz` is None when no rate was given.
    `interpolation` says of columns whether they run in straight lines between samples ("linear") or stay ("hold").
    `frame` names the joints that columns belong to where those are not simply the model's; see `bind`. `reading` says
    how files of another make are read (None: as plain csv), `readings` how single ones that differ. `units_certain` says that
    no data check is to doubt the units.
    """

    files: tuple[str, ...]
    split: Split = field(default_factory=LastThird)
    units: Mapping[str, str] = field(default_factory=dict)
    variables: Mapping[str, str] = field(default_factory=dict)
    sensors: Mapping[str, float] = field(default_factory=dict)
    rate_hz: float | None = None
    initial_conditions_given: bool = False
    notes: tuple[str, ...] = ()
    tolerances: Mapping[str, float] = field(default_factory=dict)
    interpolation: Mapping[str, str] = field(default_factory=dict)
    reading: Reading | None = None
    readings: Mapping[str, Reading] = field(default_factory=dict)
    frame: str = ""
    units_certain: bool = False

    def reading_of(self, file: str) -> Reading | None:
        """How a file is read; None: as plain csv."""
        return self.readings.get(file, self.reading)


def read_case_file(path: Path, content: bytes, files_found: tuple[str, ...]) -> CaseFile:
    """Check and read the content of a case.toml.

    Args:
        path: where the content comes from, for messages only.
        content: the bytes of the file.
        files_found: the data files of the folder, used when case.toml has no `files`.

    Raises:
        MisfitError: names the key whose value does not fit and what was expected.
    """
    table = TomlTable.parse(path, content)
    files = _files(table, files_found)
    sensors, sensor_notes = _sensors(table.get_table("sensors"))
    reading, readings = read_reading(table.get_table("reading"))
    return CaseFile(
        files=files,
        split=read_split(table, files),
        units=_units(table.get_table("columns")),
        variables=_variables(table.get_table("variables")),
        sensors=sensors,
        rate_hz=table.get_table("sampling").get_positive("rate_hz"),
        initial_conditions_given=bool(table.get_table("initial_conditions").get_flag("given")),
        notes=(*_unknown_keys(table), *sensor_notes),
        tolerances=_tolerances(table.get_table("tolerances")),
        interpolation=_interpolation(table.get_table("interpolation")),
        reading=reading,
        readings=readings,
        frame=_frame(table),
        units_certain=bool(table.get_flag("units_certain")),
    )


def _files(table: TomlTable, files_found: tuple[str, ...]) -> tuple[str, ...]:
    files = table.get_texts("files")
    if files is None:
        files = files_found
    if not files:
        raise MisfitError(
            f'{table.where}: no data files; expected files = ["trial_01.csv", ...] or *.csv files in the same folder'
        )
    for position, name in enumerate(files):
        if not name or not name.isprintable():
            raise MisfitError(f"{table.where}: files holds {shown(name)}, expected a file name")
        if normpath(name) in map(normpath, files[:position]):
            raise MisfitError(f"{table.where}: files names {shown(name)} twice; a trial counts once")
    return files


def _frame(table: TomlTable) -> str:
    frame = table.values.get("frame", "")
    if not isinstance(frame, str):
        raise table.wrong("frame", 'the name of what the joints belong to, such as "robot: Proficio"')
    return frame


def _units(table: TomlTable) -> dict[str, str]:
    units = table.texts()
    for column, unit in units.items():
        try:
            conversion(unit, unit)
        except MisfitError as error:
            raise MisfitError(f"{table.where}: column {shown(column)}: {error}") from error
    return units


def _variables(table: TomlTable) -> dict[str, str]:
    variables = table.texts()
    column_of: dict[str, str] = {}
    for column, variable in variables.items():
        if variable in column_of:
            raise MisfitError(
                f"{table.where}: columns {shown(column_of[variable])} and {shown(column)} are both mapped to {shown(variable)}; keep one"
            )
        column_of[variable] = column
    return variables


def _interpolation(table: TomlTable) -> dict[str, str]:
    found = table.texts()
    for column, how in found.items():
        if how not in INTERPOLATIONS:
            raise table.wrong(column, '"linear" or "hold"')
    return found


def _sensors(table: TomlTable) -> tuple[dict[str, float], tuple[str, ...]]:
    sensors: dict[str, float] = {}
    notes: list[str] = []
    for key, value in table.values.items():
        converted = number(value)
        if converted is None:
            notes.append(f"{table.where}: {shown(key)} is no finite number and is not used")
        elif converted < 0.0:
            raise table.wrong(key, "0 or more")
        else:
            _require_unit(table, key)
            sensors[key] = converted
    return sensors, tuple(notes)


def _tolerances(table: TomlTable) -> dict[str, float]:
    """Relative standard deviations; a percentage may be written as text."""
    tolerances: dict[str, float] = {}
    for key, value in table.values.items():
        found = relative(value)
        if found is None:
            raise table.wrong(key, 'a share between 0 and 1 or a percentage, such as 0.05 or "5%"')
        tolerances[key] = found
    return tolerances


def relative(value: object) -> float | None:
    """A share between 0 and 1, from a number or from text such as "5%"; None if it is neither.

    >>> relative("5%"), relative(0.02), relative("much")
    (0.05, 0.02, None)
    """
    scale = 1.0
    if isinstance(value, str):
        text = value.strip()
        scale = 0.01 if text.endswith("%") else 1.0
        try:
            value = float(text.removesuffix("%"))
        except ValueError:
            return None
    found = number(value)
    return found * scale if found is not None and 0.0 <= found * scale < 1.0 else None


def _require_unit(table: TomlTable, key: str) -> None:
    try:
        sensor_key(key)
    except MisfitError as error:
        raise MisfitError(f"{table.where}: {error}") from error


def _unknown_keys(table: TomlTable) -> tuple[str, ...]:
    notes: list[str] = []
    for key in table.values:
        if key not in _KNOWN_KEYS and key not in _REMARK_KEYS:
            close = difflib.get_close_matches(key, _KNOWN_KEYS, n=1)
            hint = f"; did you mean {close[0]}?" if close else ""
            notes.append(f"{table.where}: {shown(key)} is not used{hint}")
    return tuple(notes)

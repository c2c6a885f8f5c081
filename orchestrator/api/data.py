"""Measurements from files or from arrays."""

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from fmus.errors import MisfitError
from orchestrator.measurements.trial import MeasurementSet, Record, Trial
from orchestrator.measurements.wording import listed

if TYPE_CHECKING:
    from orchestrator.measurements.bound import BoundSet

_TIME_NAMES = ("time", "t", "time_s")
_IN_MEMORY = "arrays in memory"


@dataclass(frozen=True, eq=False)
class Data:
    """Recorded trials, split into learning trials and held-out ones.

    `drives` names the columns that were declared to drive the model; each must be one of its inputs.
    """

    measurements: MeasurementSet
    drives: tuple[str, ...] = ()

    @staticmethod
    def read(path: "str | Path") -> "Data":
        """Read a folder of trials, its `case.toml`, or one file (CSV, Parquet, MF4, HDF5).

        Args:
            path: the folder or the file.

        Returns:
            The trials; time in s, everything else in the units of the files.

        Raises:
            MisfitError: if the path or a file cannot be used; the message names the file and the place in it.
        """
        from orchestrator.measurements.load import load_measurements

        if not isinstance(path, str | Path):
            raise MisfitError(
                f"Data.read({_kind(path)}): expected the path of a folder or a file; arrays go to Data.of"
            )
        return Data(load_measurements(path))

    @staticmethod
    def of(
        arrays: Any,
        *,
        units: Mapping[str, str] | None = None,
        inputs: Sequence[str] | Mapping[str, Any] | None = None,
        names: Mapping[str, str] | None = None,
        noise: Mapping[str, float] | None = None,
    ) -> "Data":
        """Make measurements of arrays.

        Args:
            arrays: a mapping from column to array (n,), a pandas or polars data frame, or a list of these, one for each
                trial. One column is `time` (or `t`, `time_s`) in s, strictly increasing.
            units: unit of each column, such as `{"q": "rad"}`; without one a column is taken in the model's unit.
            inputs: which columns drive the model, so that a misspelt input is an error and is not held at zero; or the
                driving columns themselves, by name, sampled at the same times (for one trial).
            names: the model variable that a column is, where names differ.
            noise: standard deviation of the noise of a column, in its unit, where it is known.

        Returns:
            The trials. The last third is held out: of the trials, or of a single record's time.

        Raises:
            MisfitError: if a column is missing, has another length than time or is not finite, or time does not increase.
        """
        from orchestrator.measurements.split import LastThird

        parts = list(arrays) if isinstance(arrays, list | tuple) else [arrays]
        if not parts:
            raise MisfitError("Data.of([]): expected at least one trial")
        drives: tuple[str, ...] = () if inputs is None else tuple(inputs)
        if isinstance(inputs, Mapping):
            if len(parts) > 1:
                raise MisfitError("Data.of: inputs as arrays belong to one trial; put them into the trials of the list")
            parts = [{**_columns(parts[0]), **inputs}]
        records = [_record(f"trial {k}", _columns(part), units or {}) for k, part in enumerate(parts, start=1)]
        _require_same_columns(records)
        _require_known("inputs", drives, records[0])
        _require_known("units", units or {}, records[0])
        _require_known("names", names or {}, records[0])
        _require_known("noise", noise or {}, records[0])
        split = LastThird()
        measurements = MeasurementSet(
            path=Path(_IN_MEMORY),
            trials=split.trials(records),
            sensors=_sensors(noise or {}, records[0]),
            variables=dict(names or {}),
            initial_conditions_given=False,
            notes=split.notes(records),
            content_hash=_hash(records),
        )
        return Data(measurements, drives)

    @property
    def trials(self) -> tuple[Trial, ...]:
        """All trials; `subset` says whether one is for learning or held out."""
        return self.measurements.trials

    @property
    def notes(self) -> tuple[str, ...]:
        """What was assumed when the data were read."""
        return self.measurements.notes

    def bound(self, inputs: Sequence[Any], outputs: Sequence[Any]) -> "BoundSet":
        """The trials in a model's inputs, outputs and units.

        Args:
            inputs: the model's input variables, with name and unit.
            outputs: the model's output variables, with name and unit.

        Returns:
            For each trial time (n,) in s, inputs (n, inputs) and measured outputs (n, outputs) in the model's units.

        Raises:
            MisfitError: if no output was measured, a dimension differs, or a declared input is none of the model.
        """
        from orchestrator.measurements.binding import bind

        self.check(inputs, outputs)
        return bind(self.measurements, inputs, outputs)

    def check(self, inputs: Sequence[Any], outputs: Sequence[Any]) -> None:
        """Make sure that what was declared as driving is an input of the model.

        Args:
            inputs: the model's input variables.
            outputs: the model's output variables.

        Raises:
            MisfitError: naming the first column that is not.
        """
        from orchestrator.measurements.matching import match_columns

        known = [variable.name for variable in inputs]
        found = match_columns(self.drives, self.measurements.variables, known).column_of.values()
        for name in self.drives:
            if name not in found:
                raise MisfitError(
                    f"column {name!r} was said to drive the model, which has the inputs {listed(known)}; "
                    "rename it, or map it with names={...}"
                )

    def _repr_html_(self) -> str:
        from html import escape

        rows = "".join(
            f"<tr><td>{escape(t.name)}</td><td>{t.subset.replace('_', ' ')}</td><td>{len(t.time)}</td>"
            f"<td>{t.time[-1] - t.time[0]:.4g} s</td><td>{escape(', '.join(t.columns))}</td></tr>"
            for t in self.trials
        )
        notes = "".join(f"<li>{escape(note)}</li>" for note in self.notes)
        head = "<tr><th>trial</th><th>set</th><th>samples</th><th>length</th><th>columns</th></tr>"
        return f"<table>{head}{rows}</table><ul>{notes}</ul>"


def as_data(given: Any) -> Data:
    """Data as they are, or read from a path, or made of arrays.

    Raises:
        MisfitError: for anything else.
    """
    if isinstance(given, Data):
        return given
    if isinstance(given, MeasurementSet):
        return Data(given)
    if isinstance(given, str | Path):
        return Data.read(given)
    if isinstance(given, Mapping | list | tuple) or hasattr(given, "columns"):
        return Data.of(given)
    raise MisfitError(
        f"{_kind(given)} is no measurement; expected misfit.Data, a path, a mapping of arrays or a data frame"
    )


def _columns(part: Any) -> dict[str, Any]:
    """Columns of a mapping or a data frame (pandas, polars and pyarrow give a column by `frame[name]`)."""
    if isinstance(part, Mapping):
        return dict(part)
    if hasattr(part, "columns") and hasattr(part, "__getitem__"):
        names = getattr(part, "column_names", None) or list(part.columns)
        return {str(name): part[name] for name in names}
    raise MisfitError(f"Data.of({_kind(part)}): expected a mapping from column to array, or a data frame")


def _record(name: str, columns: Mapping[str, Any], units: Mapping[str, str]) -> Record:
    arrays = {column: _array(name, column, values) for column, values in columns.items()}
    at = next((column for wanted in _TIME_NAMES for column in arrays if column.lower() == wanted), None)
    if at is None:
        raise MisfitError(f"{name} has no column time; it has {listed(arrays)}; name the times in s `time`")
    if units.get(at, "s") != "s":
        raise MisfitError(f"{name}: {at} is in {units[at]}; expected s")
    time = arrays.pop(at)
    if len(time) < 2 or not np.all(np.diff(time) > 0):
        raise MisfitError(f"{name}: {at} has to increase from sample to sample, with two samples or more")
    for column, values in arrays.items():
        if len(values) != len(time):
            raise MisfitError(f"{name}: {column} has {len(values)} values and {at} has {len(time)}; expected as many")
    return Record(name, time, arrays, {column: units.get(column, "") for column in arrays})


def _array(name: str, column: str, values: Any) -> np.ndarray:
    try:
        array = np.array(values, dtype=float)
    except (TypeError, ValueError) as error:
        raise MisfitError(f"{name}: {column} holds {_kind(values)} that are no numbers") from error
    if array.ndim != 1:
        raise MisfitError(f"{name}: {column} has the shape {array.shape}; expected (n,), one value for each time")
    if not np.all(np.isfinite(array)):
        first = int(np.flatnonzero(~np.isfinite(array))[0])
        raise MisfitError(f"{name}: {column}[{first}] = {array[first]}; expected finite numbers")
    return array


def _require_same_columns(records: Sequence[Record]) -> None:
    for record in records[1:]:
        if set(record.columns) != set(records[0].columns):
            raise MisfitError(
                f"{record.name} has the columns {listed(record.columns)}, trial 1 has {listed(records[0].columns)}"
            )


def _require_known(argument: str, names: Any, record: Record) -> None:
    for name in names:
        if name not in record.columns and name.lower() not in _TIME_NAMES:
            raise MisfitError(f"{argument} names {name!r}, which is no column; there are {listed(record.columns)}")


def _sensors(noise: Mapping[str, float], record: Record) -> dict[str, float]:
    """Noise as `[sensors]` of a case.toml states it."""
    found = {}
    for name, deviation in noise.items():
        unit = record.units[name]
        if not unit:
            raise MisfitError(f"noise of {name} needs to know in which unit it is; give units={{{name!r}: ...}}")
        if not deviation >= 0.0:
            raise MisfitError(f"noise of {name} = {deviation} {unit}; expected a standard deviation, 0 or more")
        found[f"{name}_noise_std_{unit.replace('/', '_per_')}"] = float(deviation)
    return found


def _hash(records: Sequence[Record]) -> str:
    digest = hashlib.sha256()
    for record in records:
        for name, values in (("time", record.time), *sorted(record.columns.items())):
            digest.update(f"{name}\0{record.units.get(name, '')}\0{len(values)}\0".encode())
            digest.update(np.ascontiguousarray(values).tobytes())
    return digest.hexdigest()


def _kind(given: Any) -> str:
    return f"a {type(given).__name__}"

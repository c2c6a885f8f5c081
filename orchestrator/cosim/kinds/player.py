"""A record of a measurement as a component: its columns are outputs."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from fmus.errors import ComponentError, MisfitError
from orchestrator.cosim.component import Component, Port, StepEnd, Timed
from orchestrator.cosim.system import ComponentSpec
from orchestrator.measurements.load import load_records
from orchestrator.measurements.toml_values import number
from orchestrator.measurements.trial import Record
from orchestrator.measurements.wording import listed, nearest, shown

# A time this close to a sample, as a share of the smallest distance of samples, is that of the sample.
_SAME = 1e-6


def open_player(spec: ComponentSpec, folder: Path) -> Component:
    """Play a file of the measurement set (or the single file) that `source` names, as a whole.

    Options: `trial`, the file's number from 1 or its name (needed where there are several); `columns` to play (all);
    `interpolation`, "linear" (the default) or "hold" for the last sample; `start`, the time in s of the run at which
    the record begins (its own time otherwise).

    Raises:
        MisfitError: if the measurements cannot be read or an option does not fit them.
    """
    trial = _chosen(load_records(folder / spec.source), spec.options.get("trial"), spec.source)
    interpolation = spec.options.get("interpolation", "linear")
    if interpolation not in ("linear", "hold"):
        raise MisfitError(f'interpolation = {shown(interpolation)}; expected "linear" or "hold"')
    columns = spec.options.get("columns", list(trial.columns))
    for name in columns if isinstance(columns, list) else [columns]:
        if name not in trial.columns:
            raise MisfitError(f"{trial.name} has no column {shown(name)}; {nearest(str(name), trial.columns)}")
    begin = number(spec.options["start"]) if "start" in spec.options else float(trial.time[0])
    if begin is None:
        raise MisfitError(f"start = {shown(spec.options['start'])}; expected a time in s")
    return Player(trial, columns, interpolation == "hold", begin - float(trial.time[0]))


def _chosen(records: Sequence[Record], wanted: Any, source: str) -> Record:
    if wanted is None and len(records) == 1:
        return records[0]
    numbered = [] if isinstance(wanted, bool) else list(enumerate(records, 1))
    found = [record for place, record in numbered if wanted in (place, record.name)]
    if len(found) != 1:
        names = listed(record.name for record in records)
        said = "" if wanted is None else f"trial = {shown(wanted)}; "
        raise MisfitError(
            f"{said}{source} has {len(records)} files; expected trial = a number from 1 or one of {names}"
        )
    return found[0]


class Player(Timed):
    """Columns of a record, interpolated linearly or held from sample to sample.

    A run may not go beyond the record: there is no value there.
    """

    kind = "player"

    def __init__(self, trial: Record, columns: Sequence[str], hold: bool, shift: float) -> None:
        self.ports = tuple(
            Port(
                name,
                "output",
                unit=trial.units.get(name, ""),
                variability="discrete" if hold else "continuous",
                description=f"recorded in {trial.name}",
            )
            for name in columns
        )
        self.feedthrough = {name: () for name in columns}
        self._name, self._hold = trial.name, hold
        self._times = trial.time + shift
        self._columns = {name: trial.columns[name] for name in columns}
        self._slack = _SAME * float(np.min(np.diff(trial.time)))
        self._time = float(self._times[0])

    def initialise(self, time: float, stop: float | None, tolerance: float | None) -> None:
        """Go to a time within the record; the stop time has to be within as well."""
        for limit in (time,) if stop is None else (time, stop):
            self._check(limit)
        self._time = time

    def set(self, names: Sequence[str], values: Sequence[Any]) -> None:
        """A record has no inputs."""
        if names:
            raise ComponentError(f"{self._name} is a record; {', '.join(names)} cannot be set")

    def get(self, names: Sequence[str]) -> list[Any]:
        """Values of columns at the time reached."""
        if self._hold:
            place = int(np.searchsorted(self._times, self._time + self._slack, side="right")) - 1
            return [float(self._columns[name][max(place, 0)]) for name in names]
        return [float(np.interp(self._time, self._times, self._columns[name])) for name in names]

    def step(self, time: float, size: float) -> StepEnd:
        """Go on in the record."""
        self._check(time + size)
        self._time = time + size
        return StepEnd(self._time)

    def _check(self, time: float) -> None:
        first, last = float(self._times[0]), float(self._times[-1])
        if not first - self._slack <= time <= last + self._slack:
            raise ComponentError(
                f"{self._name} has no values at t = {time:.9g} s: it is recorded from {first:.9g} s to {last:.9g} s; "
                f"stop earlier, or set its start"
            )

"""A recorded trial and a set of them, in the units of the files (time alone is always in s)."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

Subset = Literal["learning", "held_out"]
Array = NDArray[np.float64]
# How a note about a mended column begins.
MENDED = "mended: "


@dataclass(frozen=True, eq=False)
class Trial:
    """One stretch of recorded time.

    `name` is the file name, followed by the window where a file was cut (`"swing.csv [0, 10] s"`).
    `time` has shape (n,), n >= 2, in s, strictly increasing; it is the time of the record and need
    not start at 0. `columns` holds every other column, each (n,), in the unit that `units` gives for
    it; the unit `""` means that nobody said. The arrays are made read-only.
    """

    name: str
    subset: Subset
    time: Array
    columns: Mapping[str, Array]
    units: Mapping[str, str]

    def __post_init__(self) -> None:
        """Protect the measurement from whoever computes with it."""
        for values in (self.time, *self.columns.values()):
            values.setflags(write=False)


@dataclass(frozen=True, eq=False)
class Record:
    """One data file as read: the whole of its time in s, shape (n,), and its other columns."""

    name: str
    time: Array
    columns: Mapping[str, Array]
    units: Mapping[str, str]

    def trial(self, subset: Subset) -> Trial:
        """Take the whole record as one trial."""
        return Trial(self.name, subset, self.time, self.columns, self.units)

    def window(self, subset: Subset, start: float, stop: float, rows: NDArray[np.bool_]) -> Trial:
        """Take some rows as a trial of their own, which is named after its limits.

        Args:
            subset: learning or held out.
            start: limit, s, for the name.
            stop: limit, s, for the name.
            rows: (n,) which rows it has.
        """
        columns = {name: values[rows] for name, values in self.columns.items()}
        name = f"{self.name} [{start:g}, {stop:g}] s"
        return Trial(name, subset, self.time[rows], columns, self.units)


@dataclass(frozen=True, eq=False)
class MeasurementSet:
    """The trials of one case and what its case.toml says about them.

    `sensors` holds the numbers of [sensors], `tolerances` the relative standard deviations of [tolerances] by
    parameter, `variables` maps a column to a model variable where the names differ. `notes` lists what was assumed.
    `content_hash` is the sha256 of case.toml and all data files, in hex: equal hashes mean equal data. `interpolation`
    maps a column to "linear" or "hold" (default: linear). `frame` names what the columns' joints belong to, "" where
    nobody said, and `units_certain` says that the units are beyond doubt.
    """

    path: Path
    trials: tuple[Trial, ...]
    sensors: Mapping[str, float]
    variables: Mapping[str, str]
    initial_conditions_given: bool
    notes: tuple[str, ...]
    content_hash: str
    tolerances: Mapping[str, float] = field(default_factory=dict)
    interpolation: Mapping[str, str] = field(default_factory=dict)
    frame: str = ""
    units_certain: bool = False

    @property
    def mended(self) -> tuple[str, ...]:
        """What data checks changed in the columns as recorded."""
        return tuple(note.removeprefix(MENDED) for note in self.notes if note.startswith(MENDED))

    def with_tolerances(self, tolerances: Mapping[str, float]) -> "MeasurementSet":
        """Return the same set with further tolerances, which go before those of its file."""
        return replace(self, tolerances={**self.tolerances, **tolerances})

    @property
    def learning(self) -> tuple[Trial, ...]:
        """The trials a fit may use."""
        return tuple(trial for trial in self.trials if trial.subset == "learning")

    @property
    def held_out(self) -> tuple[Trial, ...]:
        """The trials that only the final score may use."""
        return tuple(trial for trial in self.trials if trial.subset == "held_out")

"""A result in memory: time, columns with units, and where it comes from."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from difflib import get_close_matches
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fmus.errors import MisfitError
from fmus.units import conversion
from orchestrator.results.column import Column
from orchestrator.results.formats import Content, format_of
from orchestrator.shown import Shown, drawing_of


@dataclass(frozen=True, eq=False)
class Result:
    """What a run recorded: `time` (n,) in s, and one array (n,) for each of the `columns`, in the column's unit.

    `provenance` is what `Simulation` wrote at the start (components with hashes, versions, settings, seed); `failure`
    says why a run ended early, "" if it did not; `complete` is False for a run that is still going on or was killed.
    """

    time: NDArray[np.float64]
    columns: tuple[Column, ...]
    arrays: Mapping[str, NDArray[Any]]
    provenance: Mapping[str, Any] = field(default_factory=dict)
    failure: str = ""
    complete: bool = True

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the columns, without time."""
        return tuple(column.name for column in self.columns)

    def __contains__(self, name: str) -> bool:
        return name in self.arrays

    def __getitem__(self, name: str) -> NDArray[Any]:
        """Values of a column, (n,), in its unit.

        Raises:
            MisfitError: if there is no such column; names similar ones.
        """
        if name not in self.arrays:
            near = get_close_matches(name, self.names, n=3) or list(self.names[:5])
            raise MisfitError(f"the result has no column {name!r}; there are, for example, {', '.join(near)}")
        return self.arrays[name]

    def column(self, name: str) -> Column:
        """Unit, type and description of a column.

        Raises:
            MisfitError: if there is no such column.
        """
        self[name]
        return next(column for column in self.columns if column.name == name)

    def plot(self, *names: str) -> Shown:
        """Curves of columns over time, for a notebook; of the first few without names.

        Raises:
            MisfitError: if there is no such column, or nothing was recorded.
        """
        return drawing_of("result").plot(self, names)

    def _repr_html_(self) -> str:
        return drawing_of("result").html(self)

    def values_in(self, name: str, unit: str) -> NDArray[np.float64]:
        """Values of a column in another unit.

        Args:
            name: of the column, `COMPONENT.VARIABLE`.
            unit: such as `mm` or `deg`; of the same dimension as the column's own.

        Returns:
            One value for each row, (n,).

        Raises:
            MisfitError: if there is no such column, or its dimension differs.
        """
        return np.asarray(self[name], dtype=float) * conversion(self.column(name).unit, unit)


def read_columns(path: Path, wanted: Sequence[str] | None = None) -> tuple[Content, bool]:
    """Numeric columns of a file, and whether it is complete; also of one that a run is writing or left when it was killed.

    Raises:
        MisfitError: if the file cannot be read; says what to do.
    """
    chosen = format_of(path)
    unfinished = path.with_name(path.name + ".unfinished")
    if unfinished.exists():
        from orchestrator.results.file_recorder import finish_abandoned
        from orchestrator.results.journal import read_journal

        finish_abandoned(path)
        try:
            with unfinished.open("rb") as file:
                return read_journal(file, path, wanted), False
        except FileNotFoundError:
            pass  # it has just been finished
    if not path.exists():
        raise MisfitError(f"{path} does not exist; expected a file of results")
    return chosen.read(path, wanted), True


def read_result(path: str | Path, columns: Sequence[str] | None = None) -> Result:
    """Read a result that `misfit run` wrote, or any table with a column `time` in s.

    Args:
        path: .parquet, .csv, .h5 or .mf4. If the run that writes it goes on, what is there is read; if it was killed,
            its side file is made into a proper file first.
        columns: names to read; all if None.

    Raises:
        MisfitError: if there is no such file, or it holds no column `time`.
    """
    path = Path(path)
    content, complete = read_columns(path, None if columns is None else ["time", *columns])
    arrays = dict(content.arrays)
    time = arrays.pop("time", None)
    if time is None:
        raise MisfitError(f"{path} has no column 'time'; columns are {', '.join(list(arrays)[:8])}")
    header = content.header
    kept = tuple(column for column in header.columns if column.name != "time")
    time = np.asarray(time, dtype=float)
    return Result(time, kept, arrays, header.provenance, header.failure, complete and not header.failure)

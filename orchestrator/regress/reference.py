"""What the results of a case are compared with, and the tables that hold it."""

import xml.etree.ElementTree as ET
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING
from urllib.parse import unquote

import numpy as np

from fmus.errors import MisfitError
from orchestrator.measurements.record import time_column
from orchestrator.measurements.wording import listed
from orchestrator.regress.case import Case, Reference
from orchestrator.regress.comparison import Signal, Tolerance

if TYPE_CHECKING:
    from fmus.reference_files import Replay


@dataclass(frozen=True, eq=False)
class Table:
    """Columns (n,) over `time` (n,) in s, just as the file has them; units where the file says them."""

    time: np.ndarray
    columns: Mapping[str, np.ndarray]
    units: Mapping[str, str]


def read_table(path: Path) -> Table:
    """Read a .csv, .parquet, .mf4 or .h5 file with a column time, t or time_s in s.

    Times that fall, repeat or are not finite stay as they are: who compares says what is wrong with them.

    Raises:
        MisfitError: if there is no such file, it cannot be read, or it has no time.
    """
    from orchestrator.results.result import read_columns

    content, _ = read_columns(path)
    arrays = {name.strip(): np.asarray(values, dtype=float) for name, values in content.arrays.items()}
    name = time_column(tuple(arrays), {})
    if name is None:
        raise MisfitError(f"{path} has no column time, t or time_s of numbers; its columns are {listed(arrays)}")
    units = {column.name.strip(): column.unit for column in content.header.columns}
    time = arrays.pop(name)
    return Table(time, arrays, units)


@dataclass(frozen=True)
class Expected:
    """Reference signals by name; tolerances that the reference itself brings; where it is from, in words."""

    signals: Mapping[str, Signal]
    where: str
    tolerances: Mapping[str, Tolerance] = field(default_factory=dict)


def expected_of_table(table: Table, columns: Mapping[str, str], where: str) -> Expected:
    """Signals of a table; a file says nothing about how to interpolate, so that is taken from the result later.

    Args:
        table: the table.
        columns: column of each signal; all columns under their own names if it is empty.
        where: where the reference comes from, in words.
    """
    names = columns or {name: name for name in table.columns}
    found = {}
    for name, column in names.items():
        if column in table.columns:
            found[name] = Signal(name, table.time, table.columns[column], table.units.get(column, ""))
    return Expected(found, where)


def expected_from_file(case: Case, reference: Reference) -> Expected:
    """The reference in a file.

    Raises:
        MisfitError: if it cannot be read.
    """
    path = case.folder / reference.source
    if not path.is_file():
        raise MisfitError(
            f"{path} does not exist; misfit regress --update writes it once the result is as it should be"
        )
    return expected_of_table(read_table(path), reference.columns, str(path))


def expected_of_fmu(path: Path) -> Expected:
    """The results that the manifest of an FMU names (fmi-ls-ref), or in the older way `Model_ref.csv` beside it.

    Raises:
        MisfitError: if there are none.
    """
    replay = replay_of(path)
    if replay is not None:
        results = replay.results
        signals = {n: Signal(n, results.times, results.values[:, k]) for k, n in enumerate(results.names)}
        limits = {n: Tolerance(absolute=limit, relative=0.0) for n, limit in replay.tolerances.items()}
        return Expected(signals, f"{path} (its own results)", limits)
    named = named_results(path)
    if named is not None:
        return expected_of_table(read_table(named), {}, f"{path}, {named.name}")
    beside = path.with_name(f"{path.stem}_ref.csv")
    if beside.is_file():
        return expected_of_table(read_table(beside), {}, str(beside))
    raise MisfitError(f"{path} brings no results: no manifest of fmi-ls-ref names any, and there is no {beside.name}")


def replay_of(path: Path) -> "Replay | None":
    """The experiment with results and tolerances that an FMU built by misfit brings along; None where there is none."""
    from fmus.reference_files import read_replay
    from orchestrator.cosim.fmu import read_description
    from orchestrator.cosim.fmu.unpacked import unpacked

    return read_replay(unpacked(read_description(path)))


def named_results(path: Path) -> Path | None:
    """The first result file that an FMU's manifest labels as such."""
    from fmus.archive import check_xml
    from fmus.reference_files import MANIFEST
    from orchestrator.cosim.fmu import read_description
    from orchestrator.cosim.fmu.unpacked import unpacked

    folder = unpacked(read_description(path)).resolve()
    manifest = folder / MANIFEST
    if not manifest.is_file():
        return None
    check_xml(manifest.read_bytes(), MANIFEST)
    for element in ET.fromstring(manifest.read_bytes()).iterfind("Related"):
        source = (manifest.parent / unquote(str(element.get("source")))).resolve()
        if element.get("role") == "result" and source.is_relative_to(folder) and source.suffix in (".csv", ".parquet"):
            return source
    return None


def like(reference: Signal, result: Signal) -> Signal:
    """The reference in the unit of the result and interpolated as it is, since files rarely say.

    Raises:
        MisfitError: if the dimensions of the units differ.
    """
    values, unit = reference.values, result.unit
    if reference.unit and result.unit and reference.unit != result.unit:
        from fmus.units import conversion

        values = np.asarray(values, dtype=float) * conversion(reference.unit, result.unit)
    return replace(reference, values=values, unit=unit, interpolation=result.interpolation, nominal=result.nominal)


def at_points(result: Signal, reference: Signal) -> Signal:
    """The samples of a result that are nearest to those of a coarse reference, each at the reference's time.

    A result that ends early stays short, so that it is told.
    """
    if not len(result.time) or not len(reference.time):
        return result
    step = float(np.median(np.diff(result.time))) if len(result.time) > 1 else 0.0
    inside = reference.time[reference.time <= result.time[-1] + 0.5 * step]
    after = np.clip(np.searchsorted(result.time, inside), 1, max(len(result.time) - 1, 1))
    before = after - 1
    after = np.minimum(after, len(result.time) - 1)
    nearer = np.where(inside - result.time[before] < result.time[after] - inside, before, after)
    return replace(result, time=inside, values=result.values[nearer])

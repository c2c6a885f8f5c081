"""A Parquet, MF4 or HDF5 file as numbers under column names, with the units that it states."""

from pathlib import Path

import numpy as np

from fmus.errors import MisfitError
from orchestrator.measurements.table import Table, require_finite
from orchestrator.results.reading import read_columns


def read_typed_table(path: Path, *, holes: bool = False) -> Table:
    """Read all numeric columns; columns of text are left out. A row's line is its number, counted from 1.

    With `holes`, cells that are not finite become NaN instead of an error.

    Raises:
        MisfitError: if the file is damaged, holds no numbers, columns of different length, or a cell that is not finite.
    """
    content, _ = read_columns(path)
    arrays = content.arrays
    if not arrays:
        raise MisfitError(f"{path}: no column of numbers; expected time and signals")
    rows = {len(values) for values in arrays.values()}
    if len(rows) > 1:
        raise MisfitError(f"{path}: columns have {min(rows)} to {max(rows)} rows; expected one length")
    if rows == {0}:
        raise MisfitError(f"{path}: column names but no rows; record the trial again or remove the file")
    names, values = tuple(arrays), np.column_stack([np.asarray(part, dtype=float) for part in arrays.values()])
    lines = tuple(range(1, len(values) + 1))
    if holes:
        values[~np.isfinite(values)] = np.nan
    else:
        require_finite(path, names, lines, values)
    units = {column.name: column.unit for column in content.header.columns if column.unit}
    said = content.header.provenance
    return Table(path, names, values, lines, units, frame=str(said.get("frame", "")) if isinstance(said, dict) else "")

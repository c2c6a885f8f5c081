"""Tables over time from files of any format: references and inputs."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fmus.errors import MisfitError
from orchestrator.measurements.record import time_column
from orchestrator.measurements.wording import listed


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
    from orchestrator.results.reading import read_columns

    content, _ = read_columns(path)
    arrays = {name.strip(): np.asarray(values, dtype=float) for name, values in content.arrays.items()}
    name = time_column(tuple(arrays), {})
    if name is None:
        raise MisfitError(f"{path} has no column time, t or time_s of numbers; its columns are {listed(arrays)}")
    units = {column.name.strip(): column.unit for column in content.header.columns}
    time = arrays.pop(name)
    return Table(time, arrays, units)

"""File formats of results by the ending of the file's name; each module has `write` and `read`."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from numpy.typing import NDArray

from fmus.errors import MisfitError
from orchestrator.results.column import Column

if TYPE_CHECKING:
    import pyarrow as pa

FORMATS = {".parquet": "parquet", ".csv": "csv_file", ".h5": "hdf5", ".hdf5": "hdf5", ".mf4": "mf4", ".mdf": "mf4"}
PACKAGES = {"h5py": "h5py", "asammdf": "'misfit-fmu[mf4]'"}


@dataclass(frozen=True)
class Header:
    """What a file says beside its numbers."""

    columns: tuple[Column, ...]
    provenance: Mapping[str, Any] = field(default_factory=dict)
    failure: str = ""


@dataclass(frozen=True, eq=False)
class Content:
    """Numeric columns of a file by name, time among them where there is one, each (n,)."""

    header: Header
    arrays: Mapping[str, NDArray[Any]]


class Format(Protocol):
    """A module of this folder."""

    def write(self, path: Path, header: Header, batches: "Iterator[pa.RecordBatch]") -> None:
        """Write a whole file; the first column of every batch is time in s."""

    def read(self, path: Path, wanted: Sequence[str] | None) -> Content:
        """Read columns, all without `wanted`; names that the file lacks are left out."""


def format_of(path: Path) -> Format:
    """The format of a file by its ending.

    Raises:
        MisfitError: if no format has that ending, or the package for it is not installed.
    """
    name = FORMATS.get(path.suffix.lower())
    if name is None:
        raise MisfitError(f"{path}: ending {path.suffix!r} is no format of results; use {', '.join(FORMATS)}")
    try:
        return import_module(f"orchestrator.results.formats.{name}")
    except ImportError as error:
        package = (error.name or "").partition(".")[0]
        install = PACKAGES.get(package, package)
        raise MisfitError(f"{path}: {path.suffix} files need the package {package}; pip install {install}") from error


def as_numbers(values: NDArray[Any]) -> NDArray[Any] | None:
    """Values as float64, int64 or bool, whichever holds them; None if they are no numbers, one for each row."""
    if values.ndim != 1 or values.dtype.kind not in "biuf":
        return None
    kind = {"b": np.bool_, "f": np.float64}.get(values.dtype.kind, np.int64)
    return np.asarray(values, dtype=kind)


def kind_of(values: NDArray[Any]) -> str:
    """Name of the type in FMI 3, for files that do not say it."""
    return {"b": "Boolean", "i": "Int64"}.get(values.dtype.kind, "Float64")

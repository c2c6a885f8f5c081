"""HDF5: a data set for each column, its unit as an attribute, provenance as attribute `misfit` of the file."""

import json
from collections.abc import Iterator, Sequence
from pathlib import Path

import h5py
import numpy as np
import pyarrow as pa

from fmus.errors import MisfitError
from orchestrator.results.arrow import document, grouped, numpy_of
from orchestrator.results.column import Column
from orchestrator.results.formats import Content, Header, as_numbers, kind_of

ROWS_PER_CHUNK = 16_384


def write(path: Path, header: Header, batches: Iterator[pa.RecordBatch]) -> None:
    """Write data sets `time` and one for each column; `/` in a name, which would make folders, becomes `|`.

    Args:
        path: the file.
        header: columns, provenance and failure.
        batches: rows, the first column of each time in s.
    """
    with h5py.File(path, "w", track_order=True) as file:
        file.attrs["misfit"] = document(header)
        described = [Column("time", "s"), *header.columns]
        sets = [_new(file, column) for column in described]
        end = 0
        for group in grouped(batches, ROWS_PER_CHUNK):
            table = pa.Table.from_batches(group)
            for data, column in zip(sets, table.columns, strict=True):
                data.resize((end + len(table),))
                data[end:] = numpy_of(column)
            end += len(table)


def _new(file: h5py.File, column: Column) -> h5py.Dataset:
    name = column.name.replace("/", "|")
    options = {"maxshape": (None,), "chunks": (ROWS_PER_CHUNK,), "compression": "lzf", "shuffle": True}
    data = file.create_dataset(name, (0,), dtype=column.stored_as, **options)
    data.attrs.update(
        {"name": column.name, "unit": column.unit, "kind": column.kind, "description": column.description}
    )
    return data


def read(path: Path, wanted: Sequence[str] | None) -> Content:
    """Read the numeric one-dimensional data sets at the top of a file.

    Raises:
        MisfitError: if the file is none.
    """
    try:
        with h5py.File(path, "r") as file:
            said = json.loads(file.attrs.get("misfit", "{}"))
            columns, arrays = [], {}
            for key, data in file.items():
                if not isinstance(data, h5py.Dataset):
                    continue
                notes = {name: str(data.attrs.get(name, "")) for name in ("name", "unit", "kind", "description")}
                name = notes["name"] or key
                values = as_numbers(np.asarray(data)) if wanted is None or name in wanted else None
                if values is not None:
                    arrays[name] = values
                    columns.append(Column(name, notes["unit"], notes["kind"] or kind_of(values), notes["description"]))
    except (OSError, ValueError) as error:
        raise MisfitError(f"{path} cannot be read as HDF5: {error}") from error
    return Content(Header(tuple(columns), said.get("provenance", {}), said.get("failure", "")), arrays)

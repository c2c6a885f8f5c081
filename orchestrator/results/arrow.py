"""Results as Arrow schemas and batches: names, types, units and provenance."""

import json
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from orchestrator.results.column import Column
from orchestrator.results.formats import Header, kind_of

KEY = b"misfit"
SCHEMA = "misfit.result/1"
_TYPES = {"float64": pa.float64(), "int64": pa.int64(), "bool": pa.bool_()}
_LARGEST = np.nextafter(2.0**63, 0.0)  # the next one, 2^63, would become negative


def schema_of(header: Header) -> pa.Schema:
    """Schema with time in s first; unit, type and description of a column are metadata of its field."""
    fields = [pa.field("time", pa.float64(), False, {"unit": "s"})]
    for column in header.columns:
        notes = {"unit": column.unit, "kind": column.kind, "description": column.description}
        fields.append(pa.field(column.name, _TYPES[column.stored_as], False, {k: v for k, v in notes.items() if v}))
    return pa.schema(fields, {KEY: document(header)})


def document(header: Header) -> str:
    """What a file says about itself, as JSON."""
    kinds = {column.name: column.kind for column in header.columns if column.kind != "Float64"}
    said = {"schema": SCHEMA, "kinds": kinds, "provenance": header.provenance, "failure": header.failure}
    return json.dumps(said, default=str)


def header_of(schema: pa.Schema, arrays: Mapping[str, NDArray[Any]]) -> Header:
    """Header of a file that was written here or by anybody else, for those of its columns that were read."""
    said = json.loads((schema.metadata or {}).get(KEY, b"{}"))
    columns = []
    for name, values in arrays.items():
        notes = {
            k.decode(): v.decode() for k, v in (schema.field(name).metadata or {}).items() if k != b"PARQUET:field_id"
        }
        kind = notes.get("kind", kind_of(values))
        columns.append(Column(name, notes.get("unit", ""), kind, notes.get("description", "")))
    return Header(tuple(columns), said.get("provenance", {}), said.get("failure", ""))


def batch_of(
    schema: pa.Schema, columns: Sequence[Column], times: NDArray[np.float64], values: NDArray[np.float64]
) -> pa.RecordBatch:
    """One batch of rows: times (n,), values (n, k).

    Args:
        schema: of the file.
        columns: what each column is and how it is stored.
        times: in s.
        values: (n, k), in the columns' units.
    """
    turned = np.ascontiguousarray(values.T)
    arrays = [_array(np.ascontiguousarray(times), "float64")]
    arrays += [_array(part, column.stored_as) for column, part in zip(columns, turned, strict=True)]
    return pa.record_batch(arrays, schema=schema)


def _array(values: NDArray[np.float64], kind: str) -> pa.Array:
    """Arrow array over the memory of NumPy; `pa.array` would import pandas first, where it is installed (0.3 s)."""
    if kind == "int64":
        values = np.minimum(values, _LARGEST)
    data = np.packbits(values != 0.0, bitorder="little") if kind == "bool" else values.astype(kind, copy=False)
    return pa.Array.from_buffers(_TYPES[kind], len(values), [None, pa.py_buffer(data)])


def grouped(batches: Iterator[pa.RecordBatch], rows: int) -> Iterator[list[pa.RecordBatch]]:
    """Batches in lists of at least so many rows, but for the last; memory holds one list at a time."""
    waiting: list[pa.RecordBatch] = []
    count = 0
    for batch in batches:
        waiting.append(batch)
        count += batch.num_rows
        if count >= rows:
            yield waiting
            waiting, count = [], 0
    if waiting:
        yield waiting


def numpy_of(column: pa.ChunkedArray) -> NDArray[Any]:
    """Values of a column; without pandas, which `to_numpy` imports, for numbers that are all there."""
    simple = pa.types.is_floating(column.type) or pa.types.is_integer(column.type)
    if not simple or column.null_count or pa.types.is_float16(column.type):
        return column.to_numpy()
    parts = [np.from_dlpack(chunk) for chunk in column.chunks if len(chunk)]
    return np.concatenate(parts) if parts else np.zeros(0)

"""CSV with one header line; units and provenance in `NAME.csv-metadata.json`, as W3C's "CSV on the Web" places them."""

import csv
import io
import json
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.csv as pc
from numpy.typing import NDArray

from fmus.errors import MisfitError
from orchestrator.results.arrow import SCHEMA, numpy_of
from orchestrator.results.column import Column
from orchestrator.results.formats import Content, Header, as_numbers, kind_of

ENDING = "-metadata.json"
# Columns from which a table is read another way.
WIDE = 2000


def write(path: Path, header: Header, batches: Iterator[pa.RecordBatch]) -> None:
    """Write numbers so that they read back as the same bits; Booleans as 0 and 1.

    Args:
        path: the file.
        header: columns, provenance and failure.
        batches: rows, the first column of each time in s.
    """
    line = io.StringIO()
    csv.writer(line, lineterminator="\n").writerow(["time", *(column.name for column in header.columns)])
    options = pc.WriteOptions(include_header=False)
    with path.open("wb") as file:
        file.write(line.getvalue().encode())
        for batch in batches:
            pc.write_csv(
                pa.record_batch([_plain(part) for part in batch.columns], names=batch.schema.names), file, options
            )
    _write_notes(path, header)


def _plain(values: pa.Array) -> pa.Array:
    return values.cast(pa.int8()) if pa.types.is_boolean(values.type) else values


def _write_notes(path: Path, header: Header) -> None:
    columns: list[dict[str, Any]] = [{"titles": "time", "datatype": "double", "unit": "s"}]
    types = {"float64": "double", "int64": "integer", "bool": "boolean"}
    for column in header.columns:
        notes = {"unit": column.unit, "kind": column.kind, "dc:description": column.description}
        notes = {key: value for key, value in notes.items() if value}
        columns.append({"titles": column.name, "datatype": types[column.stored_as], **notes})
    document = {
        "@context": "http://www.w3.org/ns/csvw",
        "url": path.name,
        "tableSchema": {"columns": columns},
        "misfit": {"schema": SCHEMA, "provenance": header.provenance, "failure": header.failure},
    }
    path.with_name(path.name + ENDING).write_text(json.dumps(document, indent=1, default=str))


def read(path: Path, wanted: Sequence[str] | None) -> Content:
    """Read the numeric columns, with what the side file says where there is one.

    Raises:
        MisfitError: if the file is no CSV.
    """
    names, columns_of = _read_wide(path) or _read_table(path)
    if len(set(names)) != len(names):
        twice = next(name for name, count in Counter(names).items() if count > 1)
        raise MisfitError(f"{path} has several columns called {twice!r}; give each its own name")
    arrays = {}
    for name, given in zip(names, columns_of, strict=True):
        values = as_numbers(given) if wanted is None or name in wanted else None
        if values is not None:
            arrays[name] = values
    said = _notes(path)
    known = {part.get("titles"): part for part in said.get("tableSchema", {}).get("columns", [])}
    columns = []
    for name, values in arrays.items():
        note = known.get(name, {})
        column = Column(name, note.get("unit", ""), note.get("kind", kind_of(values)), note.get("dc:description", ""))
        arrays[name] = values.astype(column.stored_as) if name in known and name != "time" else values
        columns.append(column)
    own = said.get("misfit", {})
    return Content(Header(tuple(columns), own.get("provenance", {}), own.get("failure", "")), arrays)


def _read_table(path: Path) -> tuple[list[str], Iterable[NDArray[Any]]]:
    """Names and columns of a table of any types."""
    try:
        table = pc.read_csv(path)
    except (pa.ArrowException, OSError) as error:
        raise MisfitError(f"{path} cannot be read as CSV: {' '.join(str(error).split())}") from error
    return table.schema.names, (numpy_of(column) for column in table.itercolumns())


def _read_wide(path: Path) -> tuple[list[str], Iterable[NDArray[Any]]] | None:
    """Names and columns of a table of numbers with very many columns, for which Arrow takes half a minute; None for others."""
    try:
        with path.open(newline="", encoding="utf-8-sig") as file:
            names = next(csv.reader(file), [])
            if len(names) <= WIDE:
                return None
            values = np.loadtxt(file, delimiter=",", ndmin=2, comments=None)
    except (OSError, ValueError, csv.Error):
        return None
    return (names, iter(np.ascontiguousarray(values.T))) if values.shape[1] == len(names) else None


def _notes(path: Path) -> dict[str, Any]:
    try:
        said = json.loads(path.with_name(path.name + ENDING).read_text())
    except (OSError, ValueError):
        return {}
    return said if isinstance(said, dict) else {}

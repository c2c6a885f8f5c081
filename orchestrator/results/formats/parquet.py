"""Parquet: units and provenance in the metadata of the schema."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from fmus.errors import MisfitError
from orchestrator.results.arrow import grouped, header_of, numpy_of, schema_of
from orchestrator.results.formats import Content, Header, as_numbers

ROWS_PER_GROUP = 131_072


def write(path: Path, header: Header, batches: Iterator[pa.RecordBatch]) -> None:
    """Write groups of rows, so that memory stays bounded.

    Args:
        path: the file.
        header: columns, provenance and failure.
        batches: rows, the first column of each time in s.
    """
    schema = schema_of(header)
    # Dictionaries cost twenty times the rest for numbers that hardly repeat; bytes by their place pack well.
    floats = [field.name for field in schema if pa.types.is_floating(field.type)]
    options: dict[str, Any] = {"compression": "lz4", "use_dictionary": False, "use_byte_stream_split": floats}
    with pq.ParquetWriter(path, schema, **options) as writer:
        for group in grouped(batches, ROWS_PER_GROUP):
            writer.write_table(pa.Table.from_batches(group, schema=schema), row_group_size=ROWS_PER_GROUP)


def read(path: Path, wanted: Sequence[str] | None) -> Content:
    """Read the numeric columns of any Parquet file.

    Raises:
        MisfitError: if the file is none.
    """
    try:
        with pq.ParquetFile(path) as file:
            schema = file.schema_arrow
            names = [name for name in schema.names if wanted is None or name in wanted]
            table = file.read(columns=names)
    except (pa.ArrowException, OSError) as error:
        raise MisfitError(f"{path} cannot be read as Parquet: {error}") from error
    arrays = {}
    for name, column in zip(table.schema.names, table.itercolumns(), strict=True):
        values = as_numbers(numpy_of(column))
        if values is not None:
            arrays[name] = values
    return Content(header_of(schema, arrays), arrays)

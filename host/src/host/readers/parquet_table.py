"""Parquet by its own schema: rows and widths are asked for before anything is read.

What pandas wrote besides the columns (its index, its types) is a text of whoever made the file, and
is not followed.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from host.errors import IdentificationError
from host.extras import install_hint
from host.readers.expanded_size import check_size

if TYPE_CHECKING:
    import pandas as pd

_NUMBER_BYTES = 8
_TEXT_BYTES = 64  # of a cell: a number or an instant in words
_NAMELESS_INDEX = "__index_level_0__"  # pandas' own name, of an index that has none
_MOST_COLUMNS = 4000


def read_parquet(source: Path) -> pd.DataFrame:
    """Return the columns that hold numbers, instants or short texts.

    Raises
    ------
    IdentificationError
        If it is no Parquet file, or would become larger than its size is worth.
    """
    try:
        from pyarrow import parquet
    except ImportError as error:
        raise IdentificationError(
            f"{source}: Parquet needs pyarrow: {install_hint('pyarrow')}"
        ) from error
    try:
        with parquet.ParquetFile(source) as file:
            schema, rows = file.schema_arrow, file.metadata.num_rows
            if len(schema) > _MOST_COLUMNS:
                raise IdentificationError(f"{source}: {len(schema)} columns, at most 4000")
            texts = [one.name for one in schema if _is_text(one.type)]
            check_size(
                source,
                max(rows * (_NUMBER_BYTES * len(schema) + _TEXT_BYTES * len(texts)),
                    _claimed_bytes(file.metadata)),
                f"{rows} rows of {len(schema)} columns",
            )  # fmt: skip
        # A text that stands in every row is held once, and looked at before it is spread.
        with parquet.ParquetFile(source, read_dictionary=texts) as file:
            wanted = [one.name for one in schema if _is_text(one.type) or _is_number(one.type)]
            table = file.read(columns=wanted, use_threads=False)
        table = table.replace_schema_metadata(None).combine_chunks()
        long = [name for name in texts if _longest(table, name) > _TEXT_BYTES]
        frame = table.drop_columns(long).to_pandas(ignore_metadata=True)
        for one in schema:
            if one.name not in frame:
                frame[one.name] = "long" if one.name in long else str(one.type)[:_TEXT_BYTES]
    except IdentificationError:
        raise
    except Exception as error:  # pyarrow names no common ancestor of what damaged files raise
        said = " ".join(str(error).split())[:120]
        raise IdentificationError(f"{source}: not a Parquet file: {said}") from error
    return _renamed(frame)


def _is_text(kind: Any) -> bool:
    from pyarrow import types

    return bool(types.is_string(kind) or types.is_large_string(kind))


def _is_number(kind: Any) -> bool:
    from pyarrow import types

    return bool(types.is_primitive(kind) or types.is_null(kind))


def _claimed_bytes(metadata: Any) -> int:
    groups = range(metadata.num_row_groups)
    return sum(max(0, metadata.row_group(k).total_byte_size) for k in groups)


def _longest(table: Any, name: str) -> int:
    """Return the bytes of the longest text of a column."""
    from pyarrow import compute

    found = [
        compute.max(compute.binary_length(chunk.dictionary)).as_py() or 0
        for chunk in table.column(name).chunks
    ]
    return max(found, default=0)


def _renamed(frame: pd.DataFrame) -> pd.DataFrame:
    """Call an index without a name `index`, as pandas does."""
    return frame.rename(columns={_NAMELESS_INDEX: "index"})

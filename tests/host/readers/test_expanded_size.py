"""What a table expands to is asked before it is made; what pandas wrote besides is not read."""

from __future__ import annotations

import json
import time
import tracemalloc
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow as pa
import pytest
from host.errors import IdentificationError
from host.readers.foreign_tables import read_foreign
from pyarrow import parquet


def written(path: Path, table: pa.Table, **how: object) -> Path:
    parquet.write_table(table, path, **how)
    return path


def refused(path: Path, says: str) -> None:
    tracemalloc.start()
    began_s = time.process_time()
    with pytest.raises(IdentificationError, match=says):
        read_foreign(path)
    took_s = time.process_time() - began_s
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert took_s < 2.0
    assert peak < 40e6


def test_rows_of_little_parquet_are_asked_for(tmp_path: Path) -> None:
    """It took 1.9 GB of memory, and said that --to parquet would help."""
    ones = pa.chunked_array([pa.array(np.zeros(1_000_000))] * 60)
    path = written(tmp_path / "bomb.parquet", pa.table({"a": ones}), compression="zstd")
    assert path.stat().st_size < 1_000_000
    refused(path, "60000000 rows of 1 columns, .* MB or more where at most")


def test_a_long_text_in_every_row_is_no_column(tmp_path: Path) -> None:
    text = pa.DictionaryArray.from_arrays(pa.array(np.zeros(50_000, "i4")), ["x" * 100_000])
    table = pa.table({"a": np.arange(50_000.0), "text": text})
    path = written(tmp_path / "text.parquet", table, store_schema=False)
    found = read_foreign(path)
    assert list(found.columns) == ["a"]
    assert "text" in found.unusable


@pytest.mark.parametrize(
    "forged",
    [
        {"index_columns": ["nowhere"], "columns": [], "column_indexes": []},
        {"index_columns": [{"kind": "range"}], "columns": 3},
        {"columns": [{"name": "a", "pandas_type": "x"}]},
        "[" * 100_000,
        {},
    ],
)
def test_forged_metadata_of_pandas_is_not_read(forged: object, tmp_path: Path) -> None:
    """They were a KeyError and a RecursionError."""
    text = forged if isinstance(forged, str) else json.dumps(forged)
    table = pa.table({"a": [1.0, 2.0]}).replace_schema_metadata({"pandas": text})
    path = written(tmp_path / "forged.parquet", table)
    np.testing.assert_array_equal(read_foreign(path).columns["a"], [1.0, 2.0])


def test_what_pandas_writes_is_read_as_before(tmp_path: Path) -> None:
    frame = pd.DataFrame(
        {
            "a": [1.0, np.nan], "b": [1, 2], "on": [True, False], "said": ["1.5", "2"],
            "at": pd.to_datetime(["2024-01-01 00:00:00", "2024-01-01 00:00:02"]),
        },
        index=[3.0, 4.0],
    )  # fmt: skip
    frame.to_parquet(tmp_path / "own.parquet")
    found = read_foreign(tmp_path / "own.parquet")
    assert set(found.columns) == {"a", "b", "on", "said", "at", "index"}
    np.testing.assert_array_equal(found.columns["said"], [1.5, 2.0])
    np.testing.assert_array_equal(found.columns["at"], [0.0, 2.0])
    np.testing.assert_array_equal(found.columns["index"], [3.0, 4.0])

"""CSV: the unit is the end of the column's name; through pyarrow where it is installed.

pyarrow wrote 9 MB/s of log where pandas wrote 2.6 MB/s (reference measurement, 41 columns).
"""

from __future__ import annotations

import importlib.util
import io
import os
import sys
from pathlib import Path
from typing import BinaryIO

import numpy as np

from host.export.writer import Columns, Meta, TableWriter

STDOUT = Path("-")


def open_target(path: Path) -> BinaryIO:
    """Open a file to write, or the process's stdout for `STDOUT`."""
    if path == STDOUT:
        return os.fdopen(os.dup(sys.stdout.fileno()), "wb")
    return path.open("wb")


def make_csv_writer(path: Path, meta: Meta) -> TableWriter:
    """Return the fastest CSV writer that is installed."""
    if importlib.util.find_spec("pyarrow") is not None:
        return ArrowCsvWriter(path, meta)
    return PandasCsvWriter(path, meta)


class PandasCsvWriter:
    """CSV with pandas alone."""

    def __init__(self, path: Path, meta: Meta) -> None:
        del meta  # the format has no place for it
        self._file = io.TextIOWrapper(open_target(path), encoding="utf-8", newline="")
        self._header = True

    def write(self, columns: Columns) -> None:
        """Append rows."""
        import pandas as pd

        table = pd.DataFrame(dict(columns))
        table.to_csv(self._file, index=False, header=self._header)
        self._header = False

    def close(self) -> None:
        """Finish the file."""
        self._file.close()


class ArrowCsvWriter:
    """CSV through pyarrow; a missing value is an empty field, as pandas writes it."""

    def __init__(self, path: Path, meta: Meta) -> None:
        del meta
        self._file = open_target(path)
        self._header = True

    def write(self, columns: Columns) -> None:
        """Append rows."""
        import pyarrow as pa
        from pyarrow import csv

        arrays = [
            pa.array(value, from_pandas=value.dtype.kind == "f") for value in columns.values()
        ]
        table = pa.Table.from_arrays(arrays, names=list(columns))
        options = csv.WriteOptions(include_header=self._header, quoting_style="needed")
        if self._header:
            # pyarrow quotes every name; a header without quotes reads the same everywhere
            self._file.write((",".join(columns) + "\n").encode())
            options = csv.WriteOptions(include_header=False, quoting_style="needed")
            self._header = False
        csv.write_csv(table, self._file, options)

    def close(self) -> None:
        """Finish the file."""
        self._file.close()


def printable(columns: Columns) -> Columns:
    """Return columns whose texts are str, so that every format can hold them."""
    return {
        name: np.char.decode(value, "ascii", "replace") if value.dtype.kind == "S" else value
        for name, value in columns.items()
    }

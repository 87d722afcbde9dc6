"""CSV: the unit is the end of the column's name; through pyarrow where it is installed.

pyarrow wrote 9 MB/s of log where pandas wrote 2.6 MB/s (reference measurement, 41 columns).
"""

from __future__ import annotations

import csv
import importlib.util
import io
import os
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from host.export.writer import Columns, Meta, TableWriter
from host.text import shown

STDOUT = Path("-")
# Decimals by unit: a hundredth of a step of the finest sensor or less (gyro 1 mrad/s, accelerometer
# 1.2 mm/s2, vane 1.3 mrad, clock 1 us, GPS 1e-7 deg); further digits are of the arithmetic alone.
DECIMALS = {
    "s": 6, "us": 2, "rad": 6, "rad/s": 6, "deg": 8, "m/s2": 5, "m/s": 5, "m": 4, "Pa": 3, "K": 4,
    "kg/m3": 6, "": 6,
}  # fmt: skip
_FORMULA = ("=", "+", "-", "@")  # a spreadsheet runs a text cell that begins so


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
        self._units = meta.units
        self._file = io.TextIOWrapper(open_target(path), encoding="utf-8", newline="")
        self._header = True

    def write(self, columns: Columns) -> None:
        """Append rows."""
        import pandas as pd

        table = pd.DataFrame(_cells(rounded(columns, self._units)))
        table.to_csv(self._file, index=False, header=self._header)
        self._header = False

    def close(self) -> None:
        """Finish the file."""
        self._file.close()


class ArrowCsvWriter:
    """CSV through pyarrow; a missing value is an empty field, as pandas writes it."""

    def __init__(self, path: Path, meta: Meta) -> None:
        self._units = meta.units
        self._file = open_target(path)
        self._header = True

    def write(self, columns: Columns) -> None:
        """Append rows."""
        import pyarrow as pa
        from pyarrow import csv as arrow_csv

        cells = _cells(rounded(columns, self._units))
        arrays = [pa.array(value, from_pandas=value.dtype.kind == "f") for value in cells.values()]
        table = pa.Table.from_arrays(arrays, names=list(cells))
        if self._header:
            # pyarrow quotes every name; a header with quotes only where needed reads the same
            text = io.StringIO()
            csv.writer(text, lineterminator="\n").writerow(cells)
            self._file.write(text.getvalue().encode())
            self._header = False
        options = arrow_csv.WriteOptions(include_header=False, quoting_style="needed")
        arrow_csv.write_csv(table, self._file, options)

    def close(self) -> None:
        """Finish the file."""
        self._file.close()


def rounded(columns: Columns, units: Mapping[str, str]) -> Columns:
    """Return columns with the decimals that their sensors have; others as they are."""
    return {
        name: _rounded(value, DECIMALS[units[name]])
        if value.dtype.kind == "f" and units.get(name) in DECIMALS
        else value
        for name, value in columns.items()
    }


def _rounded(values: NDArray[Any], decimals: int) -> NDArray[Any]:
    # A value of a damaged log may be so large that its product with 10^decimals is infinite: it has
    # no decimals. Or it is a signalling NaN.
    with np.errstate(over="ignore", invalid="ignore"):
        near = np.round(values, decimals)
    return np.where(np.isfinite(near), near, values)


def printable(columns: Columns) -> Columns:
    """Return columns whose texts are str without control codes, so that every format holds them."""
    return {
        name: _texts(value) if value.dtype.kind == "S" else value for name, value in columns.items()
    }


def _texts(value: NDArray[Any]) -> NDArray[np.str_]:
    different, where = np.unique(value, return_inverse=True)
    return np.array([shown(one) for one in different.tolist()], np.str_)[where]


def _cells(columns: Columns) -> dict[str, NDArray[Any]]:
    """Return columns whose names and texts no spreadsheet takes for a formula."""
    return {
        _cell(name): np.array([_cell(one) for one in value.tolist()], np.str_)
        if value.dtype.kind == "U"
        else value
        for name, value in columns.items()
    }


def _cell(text: str) -> str:
    return f"'{text}" if text.startswith(_FORMULA) else text

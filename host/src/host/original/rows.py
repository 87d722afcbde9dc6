"""The original logger's ASCII rows -> numbers; a damaged field is NaN, never a number.

Three variants were printed (27, 23 and 26 readings), with separators as irregular as they come.
No row carries a time, a number or a checksum.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from host.errors import NotALogError

Array = NDArray[np.float64]

_IMU = ("AN0", "AN1", "AN2", "AN3", "AN4", "AN5")
_END = ("fix", "numsat", "elevs", "ails")
VARIANTS: dict[str, tuple[str, ...]] = {
    "27 readings": (
        *("RLL", "PCH", "YAW", "altitude", "velocity", "elev", "ail", "rdr", "alpha", "beta"),
        *_IMU,
        *("lat", "lon", "gpsalt", "gpsgc", "gpsgs", *_END, "ruds", "throts"),
    ),
    "23 readings": (
        *("RLL", "PCH", "YAW", "altitude", "velocity", "alpha", "beta", *_IMU),
        *("lat", "lon", "gpsgc", "gpsgs", *_END, "rdrs", "throts"),
    ),
    "26 readings": (
        *("RLL", "PCH", "YAW", "altitude", "velocitya", "velocityb"),
        *("alphaa", "alphab", "betaa", "betab", *_IMU),
        *("lat", "lon", "gpsgc", "gpsgs", *_END, "rdrs", "throts"),
    ),
}
# Descriptions of the variants for people.
LAYOUTS = {
    "27 readings": "single sensors and surface pots, the first flight's",
    "23 readings": "single sensors, the first flight's",
    "26 readings": "paired sensors, the second flight's",
}
_LABELS = sorted({label for labels in VARIANTS.values() for label in labels}, key=len, reverse=True)
# "gpsgc0.00" and "gpsalt:17.00 " are both as printed
_FIELD = re.compile(rf"({'|'.join(_LABELS)})\s*(?::\s*)?(-?\d{{1,7}}(?:\.(\d{{1,7}}))?)")
# Rows are 150 to 250 bytes long. A number here costs 8 bytes and the table has 51 columns: shorter
# rows than these would take more than eight times the file's size in memory.
_LEAST_ROW_BYTES = 48
_BARE_ROLL = re.compile(r"(-?\d{1,3}\.(\d\d))")  # variant 26: the station strips "RLL:"
_SIGNATURE = re.compile(rb"PCH\s*:\s*-?\d+\.\d+\s*,\s*YAW\s*:")
_RANGES = {
    **dict.fromkeys(("RLL", "PCH", "YAW"), (-360.0, 360.0)),
    **dict.fromkeys(_IMU, (-32768.0, 32768.0)),
    **dict.fromkeys(("velocity", "velocitya", "velocityb"), (0.0, 210.0)),  # km/h at 2 kPa
    **dict.fromkeys(("lat",), (-90.0, 90.0)),
    **dict.fromkeys(("lon",), (-180.0, 180.0)),
    "gpsgc": (-360.0, 360.0),
    "gpsgs": (0.0, 200.0),
    "numsat": (0.0, 40.0),
}


@dataclass(frozen=True, slots=True)
class OriginalRows:
    """Rows as printed.

    Parameters
    ----------
    variant : str
        A key of `VARIANTS`.
    values : dict of str to Array, shape (n,)
        By label, in the printed unit; NaN where the field is missing or damaged.
    offset, length : NDArray[np.int64], shape (n,)
        Byte position and length of each row in the file.
    damaged : NDArray[np.int64], shape (n,)
        Fields of each row that are missing or damaged.
    """

    variant: str
    values: dict[str, Array]
    offset: NDArray[np.int64]
    length: NDArray[np.int64]
    damaged: NDArray[np.int64]

    def __len__(self) -> int:
        return len(self.offset)


def looks_like_rows(head: bytes) -> bool:
    """Tell whether the head of a file holds original ASCII rows."""
    return _SIGNATURE.search(head) is not None


def read_rows(path: Path) -> OriginalRows:
    """Parse a file of original rows.

    Parameters
    ----------
    path : Path

    Returns
    -------
    OriginalRows

    Raises
    ------
    NotALogError
        If no row is found, or the rows are hardly more than fragments.
    """
    return parse_rows(path.read_bytes(), str(path))


def parse_rows(data: bytes, name: str = "rows") -> OriginalRows:
    """Parse original rows; see `read_rows`."""
    # Two passes: the first finds what all rows have in common, so that the second keeps only
    # numbers.
    count, seen = 0, Counter[str]()
    digits_of: dict[str, Counter[int]] = {}
    for row in _rows(data):
        count += 1
        seen.update(row.fields.keys())
        for label, (_, digits) in row.fields.items():
            digits_of.setdefault(label, Counter[int]())[digits] += 1
    if not count:
        raise NotALogError(f"{name}: no row of the original logger (RLL:...,PCH:...,YAW:...)")
    if len(data) < _LEAST_ROW_BYTES * count:
        raise NotALogError(
            f"{name}: {count} rows of {len(data) / count:.0f} bytes on average, where the original"
            f" logger prints 150 to 250: at least {_LEAST_ROW_BYTES} are needed; keep the rows that"
            " are whole and try again"
        )
    variant = _variant(seen)
    # Fewer or more decimals than usual are a damaged number.
    decimals = {label: digits.most_common(1)[0][0] for label, digits in digits_of.items()}
    values = {label: np.full(count, np.nan) for label in VARIANTS[variant]}
    offset, length = np.zeros(count, np.int64), np.zeros(count, np.int64)
    for at, row in enumerate(_rows(data)):
        offset[at], length[at] = row.offset, row.length
        for label, (text, digits) in row.fields.items():
            if label in values and digits == decimals[label]:
                values[label][at] = _in_range(label, float(text))
    damaged = np.zeros(count, np.int64)
    for column in values.values():
        damaged += np.isnan(column)
    return OriginalRows(variant, values, offset, length, damaged)


@dataclass(slots=True)
class _Row:
    offset: int
    length: int
    fields: dict[str, tuple[str, int]]


def _rows(data: bytes) -> Iterator[_Row]:
    """Yield the rows: two of a line where the end of the first was lost."""
    for line in re.finditer(rb"[^\r\n]+", data):
        yield from (row for row in _rows_of_line(line) if len(row.fields) >= 2)


def _rows_of_line(line: re.Match[bytes]) -> Iterator[_Row]:
    row: _Row | None = None
    order = -1
    at_byte = line.start()
    last: str | None = None
    for part in re.finditer(rb"[^,]*(?:,|$)", line.group()):
        token = part.group().rstrip(b",").decode("ascii", "replace").strip()
        match = _FIELD.fullmatch(token)
        roll = _BARE_ROLL.fullmatch(token) if row is None and match is None else None
        if match is not None or roll is not None:
            label = match.group(1) if match is not None else "RLL"
            if row is None or _PLACE[label] <= order:
                if row is not None:
                    yield _without_cut(row, last)
                row = _Row(at_byte, 0, {})
            order = _PLACE[label]
            number = match.group(2) if match is not None else token
            row.fields[label] = (number, len(number.partition(".")[2]))
            last = label
        elif row is not None and token.strip("0 ."):
            last = None  # what was cut is this token, not the field before it
        at_byte = line.start() + part.end()
        if row is not None:
            row.length = at_byte - row.offset
    if row is not None:
        yield _without_cut(row, last)


def _without_cut(row: _Row, last: str | None) -> _Row:
    """Drop the last field of a row that ends early: its number may be cut in the middle."""
    if last is not None and last != "throts":
        row.fields.pop(last, None)
    return row


# One order that all variants keep: a label that steps back in it begins a new row.
_ORDER = (
    *("RLL", "PCH", "YAW", "altitude", "velocity", "velocitya", "velocityb", "elev", "ail", "rdr"),
    *("alpha", "alphaa", "alphab", "beta", "betaa", "betab"),
    *_IMU,
    *("lat", "lon", "gpsalt", "gpsgc", "gpsgs", *_END, "ruds", "rdrs", "throts"),
)


_PLACE = {label: at for at, label in enumerate(_ORDER)}


def _variant(seen: Counter[str]) -> str:
    if seen["velocitya"] or seen["alphaa"] or seen["betab"]:
        return "26 readings"
    if seen["elev"] or seen["ail"] or seen["gpsalt"] or seen["ruds"]:
        return "27 readings"
    return "23 readings"


def _in_range(label: str, value: float) -> float:
    lowest, highest = _RANGES.get(label, (-1e5, 1e5))
    return value if lowest <= value <= highest else float("nan")

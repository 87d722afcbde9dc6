"""Tables that others wrote: CSV in its dialects, Parquet, MAT; all that is numbers, by name."""

from __future__ import annotations

import csv
import re
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from host.compiled import Array
from host.sysid.errors import IdentificationError

if TYPE_CHECKING:
    import pandas as pd

TEXT_KINDS = (".csv", ".tsv", ".txt", ".dat")
HEAD_BYTES = 65536  # a dialect is told from these
HEAD_LINES = 60
DELIMITERS = ",;\t|"
DECIMAL_COMMA = re.compile(r"-?\d+,\d+(e-?\d+)?", re.IGNORECASE)


@dataclass(slots=True)
class Foreign:
    """Columns of numbers, why others are none, and what was left out of a column."""

    columns: dict[str, Array] = field(default_factory=dict)
    unusable: dict[str, str] = field(default_factory=dict)
    remarks: dict[str, str] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)


def read_foreign(source: Path) -> Foreign:
    """Read a text table, Parquet or MAT file by its ending.

    Raises
    ------
    IdentificationError
        If it is not what its ending says, or holds no row.
    """
    try:
        with source.open("rb") as file:
            head = file.read(HEAD_BYTES)
    except OSError as error:
        raise IdentificationError(f"{source}: cannot be read: {error.strerror}") from error
    if not head.strip():
        raise IdentificationError(f"{source}: the file is empty")
    kind = source.suffix.lower()
    if kind == ".mat":
        return _mat(source, head)
    if kind == ".parquet":
        return from_frame(_parquet(source))
    frame, notes = _text(source, head)
    found = from_frame(frame)
    found.notes = notes
    return found


def _text(source: Path, head: bytes) -> tuple[pd.DataFrame, list[str]]:
    import pandas as pd

    encoding = _encoding(source, head)
    text = head.decode(encoding, errors="ignore")
    lines = text.splitlines()[:HEAD_LINES]
    if len(head) == HEAD_BYTES and len(lines) > 1:
        lines = lines[:-1]  # cut within
    delimiter, first, fields = _dialect(lines)
    if not fields or all(_number(f) for f in fields):
        raise IdentificationError(f"{source}: not a CSV table: no line of column names")
    rows = [next(csv.reader([line], delimiter=delimiter), []) for line in lines[first + 1 :]]
    decimal = "."
    if delimiter != "," and any(DECIMAL_COMMA.fullmatch(f.strip()) for row in rows for f in row):
        decimal = ","
    notes = [f"the first {first} lines hold no names and were left out"] if first else []
    for attempt in (encoding, "cp1252", "latin-1"):
        try:
            frame = pd.read_csv(
                source,
                sep=delimiter,
                decimal=decimal,
                encoding=attempt,
                skiprows=first,
                comment="#",
                skipinitialspace=True,
                index_col=False,
                low_memory=False,
            )
        except UnicodeDecodeError:
            continue
        except (ValueError, OverflowError) as error:
            reason = str(error).strip().splitlines()[0]
            raise IdentificationError(f"{source}: not a CSV table: {reason}") from error
        if frame.empty:
            raise IdentificationError(f"{source}: column names and no row below them")
        return frame, notes
    raise IdentificationError(f"{source}: not a CSV table: no text of a known encoding")


def _encoding(source: Path, head: bytes) -> str:
    if head.startswith((b"\xff\xfe", b"\xfe\xff")):
        return "utf-16"
    if b"\0" in head:
        even, odd = head[0::2].count(0), head[1::2].count(0)
        if max(even, odd) > 0.3 * len(head) / 2 and min(even, odd) == 0:
            return "utf-16-le" if odd else "utf-16-be"
        raise IdentificationError(f"{source}: not a CSV table: the file is binary")
    return "utf-8-sig"


def _dialect(lines: list[str]) -> tuple[str, int, list[str]]:
    """Return the delimiter, which line holds the names, and the names."""
    best: tuple[float, int, str, int, list[str]] = (0.0, 0, ",", 0, [])
    for delimiter in DELIMITERS:
        split = [
            (number, next(csv.reader([line], delimiter=delimiter), []))
            for number, line in enumerate(lines)
            if line.strip() and not line.startswith("#")
        ]
        widths = Counter(len(fields) for _, fields in split)
        if not widths:
            continue
        width, count = max(widths.items(), key=lambda w: (w[1] if w[0] > 1 else 0, w[0]))
        number, fields = next((n, f) for n, f in split if len(f) == width)
        score = count / len(split) if width > 1 else 0.0
        best = max(best, (score, width, delimiter, number, fields), key=lambda b: b[:2])
    _, _, delimiter, number, fields = best
    return delimiter, number, [f.strip() for f in fields]


def _number(text: str) -> bool:
    try:
        float(text.replace(",", "."))
    except ValueError:
        return not text.strip()
    return True


def _parquet(source: Path) -> pd.DataFrame:
    import pandas as pd

    try:
        frame = pd.read_parquet(source)
    except ImportError as error:
        raise IdentificationError(
            f"{source}: Parquet needs the extra: pip install './host[parquet]'"
        ) from error
    except (ValueError, OSError) as error:
        raise IdentificationError(f"{source}: not a Parquet file: {error}") from error
    return frame.reset_index() if any(frame.index.names) else frame


def from_frame(frame: pd.DataFrame) -> Foreign:
    """Return the columns of a table that are numbers, or text that says numbers or instants."""
    found = Foreign()
    for label in frame.columns:
        name, values = str(label).strip(), frame[label]
        if values.dtype.kind in "fiub":
            found.columns[name] = values.to_numpy(dtype=np.float64, na_value=np.nan)
        elif values.dtype.kind == "M":
            found.columns[name] = _seconds(values)
        elif values.dtype.kind == "m":
            found.columns[name] = values.dt.total_seconds().to_numpy(dtype=np.float64)
        else:
            _from_text(found, name, values)
    return found


def _from_text(found: Foreign, name: str, values: pd.Series[Any]) -> None:
    import pandas as pd

    text = values.astype("string").str.strip()
    numbers = pd.to_numeric(text, errors="coerce").to_numpy(dtype=np.float64, na_value=np.nan)
    odd = np.flatnonzero(np.isnan(numbers) & (text.fillna("") != "").to_numpy(dtype=bool))
    if len(odd) < 0.5 * len(text):
        found.columns[name] = numbers
        if len(odd) > 1 or (len(odd) == 1 and odd[0] > 0):
            found.remarks[name] = (
                f"{len(odd)} of {len(text)} cells are text and count as missing"
                f" (the first is '{text.iloc[odd[0]]}' in row {odd[0] + 1})"
            )
        return
    example = str(text.iloc[odd[0]])
    instants = pd.to_datetime(text, errors="coerce") if ":" in example else None
    if instants is not None and instants.notna().mean() > 0.5:
        found.columns[name] = _seconds(instants)
    else:
        found.unusable[name] = f"text (e.g. '{example[:30]}'), not numbers"


def _seconds(instants: pd.Series[Any]) -> Array:
    """Return instants as seconds since the first of them."""
    since = instants - instants.min()
    return np.asarray(since.dt.total_seconds().to_numpy(dtype=np.float64, na_value=np.nan))


def _mat(source: Path, head: bytes) -> Foreign:
    from scipy import io

    if head.startswith(b"MATLAB 7.3") or b"\x89HDF\r\n" in head[:1024]:
        raise IdentificationError(
            f"{source}: a MAT file of version 7.3 (HDF5); in MATLAB: save(name, '-struct', 'data',"
            " '-v7')"
        )
    try:
        content = io.loadmat(source, squeeze_me=True, struct_as_record=True)
    except Exception as error:  # scipy names no common ancestor of what damaged files raise
        raise IdentificationError(f"{source}: not a MAT file of version 4 to 7: {error}") from error
    found = Foreign()
    leaves = [
        leaf
        for name, value in content.items()
        if not name.startswith("__")
        for leaf in _leaves(name, value)
    ]
    short = Counter(name.rsplit(".", 1)[-1] for name, _ in leaves)
    for name, value in leaves:
        last = name.rsplit(".", 1)[-1]
        for label in {name, last} if short[last] == 1 else {name}:
            why = _no_column(value)
            if why:
                found.unusable[label] = why
            elif value.size > 1:
                found.columns[label] = value.astype(np.float64)
    return found


def _leaves(name: str, value: object) -> Iterator[tuple[str, Any]]:
    """Walk through structs; a field of many structs is one array."""
    array = np.asarray(value)
    if array.dtype.names and "_TypeSystem" not in array.dtype.names:
        for part in array.dtype.names:
            inner = array[part]
            if inner.shape == ():
                yield from _leaves(f"{name}.{part}", inner.item())
            else:
                try:
                    yield f"{name}.{part}", inner.astype(np.float64)
                except (ValueError, TypeError):
                    yield f"{name}.{part}", inner
    else:
        yield name, array


def _no_column(array: Any) -> str:
    if array.dtype.names or array.dtype.kind == "V":
        return "a MATLAB object (table, timeseries): save table2struct(T, 'ToScalar', true)"
    if array.dtype.kind == "O":
        return "a cell array or a MATLAB object, not numbers"
    if array.dtype.kind not in "fiub":
        return "text" if array.dtype.kind in "US" else "not of real numbers"
    return f"a {' x '.join(map(str, array.shape))} array, not one column" if array.ndim > 1 else ""


def same_length(columns: Mapping[str, Array], source: Path) -> None:
    """Refuse columns of different lengths.

    Raises
    ------
    IdentificationError
        If one is not as long as the time.
    """
    rows = len(columns["t_s"])
    for name, values in columns.items():
        if len(values) != rows:
            raise IdentificationError(
                f"{source}: {name} has {len(values)} values, t_s {rows}: bring all columns to one"
                " rate first"
            )

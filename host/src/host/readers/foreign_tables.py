"""Tables that others wrote: CSV in its dialects, Parquet, MAT; all that is numbers, by name."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from host.arrays import Array
from host.errors import IdentificationError
from host.physical.calibration import Calibration
from host.physical.recording import Recording
from host.readers.mat_arrays import CELL, MatError, Struct, read_arrays
from host.readers.parquet_table import read_parquet
from host.readers.text_table import HEAD_BYTES, read_text

if TYPE_CHECKING:
    import pandas as pd

    from host.log.flown_inputs import FlownInput
    from host.readers.autotune_model import TunedModel

TEXT_KINDS = (".csv", ".tsv", ".txt", ".dat")
MOST_UNIT_ROWS = 2
LARGEST = 1e20  # nanoseconds since 1970 are 2e18; a response that diverges is no measurement


@dataclass(slots=True)
class Foreign:
    """Columns of numbers, why others are none, and what was left out of a column.

    `twice` are names that several columns have; `recording` is what the source shows of itself,
    `calibration` what made the columns of a log; of an autopilot's log `shares` are the surfaces in
    shares of full travel, `slow_outputs` those whose output was logged more slowly than servos get
    it, Hz, `tuned` what its autotune identified; `inputs` are those that our logger flew itself.
    """

    columns: dict[str, Array] = field(default_factory=dict)
    unusable: dict[str, str] = field(default_factory=dict)
    remarks: dict[str, str] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)
    twice: frozenset[str] = frozenset()
    recording: Recording = field(default_factory=Recording)
    calibration: Calibration | None = None
    shares: tuple[str, ...] = ()
    slow_outputs: dict[str, float] = field(default_factory=dict)
    inputs: Sequence[FlownInput] = ()
    tuned: tuple[TunedModel, ...] = ()


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
        return _mat(source)
    if kind == ".parquet":
        return from_frame(read_parquet(source))
    text = read_text(source, head)
    found = from_frame(text.frame)
    found.notes, found.twice = text.notes, text.twice
    return found


def is_text(source: Path) -> bool:
    """Return whether a file begins with lines of characters."""
    with source.open("rb") as file:
        head = file.read(HEAD_BYTES)
    return b"\0" not in head and head.count(b"\n") + head.count(b"\r") > 1


def from_frame(frame: pd.DataFrame) -> Foreign:
    """Return the columns of a table that are numbers, or text that says numbers or instants."""
    again = frame.columns.duplicated()
    found = Foreign(twice=frozenset(str(label).strip() for label in frame.columns[again]))
    frame = frame.loc[:, ~again]
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


def leave_infinities_out(found: Foreign) -> None:
    """Take what is infinite in a column, or as good as, for missing, and say so."""
    for name, values in found.columns.items():
        infinite = np.abs(values) > LARGEST
        if infinite.any():
            found.columns[name] = np.where(infinite, np.nan, values)
            line = f"{np.sum(infinite)} of {len(values)} values are infinite and count as missing"
            before = found.remarks.get(name)
            found.remarks[name] = f"{before}; {line}" if before else line


def _from_text(found: Foreign, name: str, values: pd.Series[Any]) -> None:
    import pandas as pd

    text = values.astype("string").str.strip()
    numbers = pd.to_numeric(text, errors="coerce").to_numpy(dtype=np.float64, na_value=np.nan)
    odd = np.flatnonzero(np.isnan(numbers) & (text.fillna("") != "").to_numpy(dtype=bool))
    if not len(odd) or len(odd) < 0.5 * len(text):
        found.columns[name] = numbers
        above = int(np.sum(odd == np.arange(len(odd))))  # units and types below the names
        odd = odd[above:] if above <= MOST_UNIT_ROWS else odd
        if len(odd):
            found.remarks[name] = (
                f"{len(odd)} of {len(text)} cells are text and count as missing"
                f" (the first is '{text.iloc[odd[0]]}' in row {odd[0] + 1})"
            )
        return
    example = str(text.iloc[odd[0]])
    instants = pd.to_datetime(text, errors="coerce", format="mixed") if ":" in example else None
    if instants is not None and instants.notna().mean() > 0.5:
        found.columns[name] = _seconds(instants)
    else:
        found.unusable[name] = f"text (e.g. '{example[:30]}'), not numbers"


def _seconds(instants: pd.Series[Any]) -> Array:
    """Return instants as seconds since the first of them."""
    since = instants - instants.min()
    return np.asarray(since.dt.total_seconds().to_numpy(dtype=np.float64, na_value=np.nan))


def _mat(source: Path) -> Foreign:
    try:
        leaves = [
            leaf
            for name, value in read_arrays(source)
            if not name.startswith("__")
            for leaf in _leaves(name, value)
        ]
    except MatError as error:
        raise IdentificationError(f"{source}: not a MAT file of version 4 to 7: {error}") from error
    found = Foreign()
    short = Counter(name.rsplit(".", 1)[-1] for name, _ in leaves)
    for name, value in leaves:
        last = name.rsplit(".", 1)[-1]
        for label in {name, last} if short[last] == 1 else {name}:
            if isinstance(value, str):
                found.unusable[label] = value
            elif value.ndim > 1:
                found.unusable[label] = _no_column(value)
                if value.ndim == 2:
                    found.columns |= _of_matrix(label, value)
            elif value.size > 1:
                found.columns[label] = value
    return found


def _leaves(name: str, value: Any) -> Iterator[tuple[str, Any]]:
    """Walk through structs; a field of many structs is one array."""
    if isinstance(value, Struct):
        for part, values in value.fields.items():
            if len(values) == 1:
                yield from _leaves(f"{name}.{part}", values[0])
            elif all(isinstance(one, np.ndarray) and one.size == 1 for one in values):
                yield f"{name}.{part}", np.array([float(one.item()) for one in values])
            else:
                yield f"{name}.{part}", CELL
    elif isinstance(value, np.ndarray) and value.ndim <= 2:
        yield name, value.astype(np.float64, copy=False)
    else:
        yield name, value


def _of_matrix(label: str, values: Any) -> dict[str, Array]:
    """Return the columns of a matrix, or the rows of a wide one, under the names MATLAB has."""
    if values.shape[0] >= values.shape[1]:
        return {f"{label}(:,{k})": column for k, column in enumerate(values.T, start=1)}
    return {f"{label}({k},:)": row for k, row in enumerate(values, start=1)}


def _no_column(array: Any) -> str:
    size = " x ".join(map(str, array.shape))
    if array.ndim == 2:
        return f"a {size} array: name one of its columns, as (:,2), or rows, as (2,:)"
    return f"a {size} array, not one column"


def same_length(columns: Mapping[str, Array], source: str) -> None:
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

"""Held positions from a CSV table, and the empty table to fill in.

Columns: `channel` (may be missing where one is meant), `repeat` (1 without it), `position` (in the
unit of the tool), and `counts`, or one column per channel that was read at the same time. A
pressure that was held to see a leak has `counts_after` and `seconds`.
"""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Sequence
from pathlib import Path

from host.bench_calibration.bench_plan import Subject
from host.bench_calibration.held_position import Held
from host.errors import UsageError
from host.files.user_text import read_text, shown

_KNOWN = ("channel", "repeat", "position", "counts", "counts_after", "seconds")
_MOST_ROWS = 100_000


def rows_of(path: Path, wanted: Sequence[str]) -> list[dict[str, str]]:
    """Return the rows of a CSV table by the names of its head.

    Raises
    ------
    UsageError
        If it is no table, or lacks a column.
    """
    text = read_text(path, UsageError, "a CSV table")
    lines = [line for line in text.splitlines() if line.strip() and not line.startswith("#")]
    reader = csv.DictReader(io.StringIO("\n".join(lines)), strict=True)
    try:
        head = [(name or "").strip() for name in reader.fieldnames or []]
        missing = [name for name in wanted if name not in head]
        if missing:
            raise UsageError(
                f"{path}: no column {missing[0]}; expected a CSV table headed"
                f" {','.join(wanted)} or a log"
            )
        reader.fieldnames = head
        found = [dict(row) for row in reader]
    except csv.Error as error:
        raise UsageError(f"{path}: not a CSV table: {error}") from None
    if not found or len(found) > _MOST_ROWS:
        raise UsageError(f"{path}: {len(found)} rows, expected 1 to {_MOST_ROWS}")
    return found


def number_of(path: Path, row: dict[str, str], column: str, index: int) -> float:
    """Return a number of a row; NaN where the cell is empty.

    Raises
    ------
    UsageError
        If it is something else.
    """
    cell = (row.get(column) or "").strip()
    try:
        value = float(cell) if cell else math.nan
    except ValueError:
        value = math.inf
    if math.isinf(value) or abs(value) > 1e9:
        raise UsageError(
            f"{path}: row {index} {column} is {shown(cell)}, expected a number with a point"
        )
    return value


class TableSource:
    """Held positions that somebody wrote down.

    Parameters
    ----------
    path : Path
    subject : Subject
    channel : str
        The channel that is meant where the table has no such column; empty: it must have one.
    first_repeat : int
        Added to the repeats of the table, less one.
    """

    def __init__(self, path: Path, subject: Subject, channel: str, first_repeat: int = 1) -> None:
        self._path, self._subject = path, subject
        self._channel, self._first = channel, first_repeat

    def held(self) -> list[Held]:
        """Return the rows that have a reading.

        Raises
        ------
        UsageError
            If a column or a number is missing, or a channel is unknown.
        """
        rows = rows_of(self._path, ["position"] + ([] if self._channel else ["channel"]))
        found = [self._held(row, index) for index, row in enumerate(rows, start=2)]
        kept = [one for one in found if one is not None]
        if not kept:
            raise UsageError(f"{self._path}: no row has counts; fill in the column counts")
        return [one for one in kept if not self._channel or one.moved == self._channel]

    def _held(self, row: dict[str, str], index: int) -> Held | None:
        moved = (row.get("channel") or "").strip() or self._channel
        if moved not in self._subject.channels:
            raise UsageError(
                f"{self._path}: row {index} channel is {shown(moved)}, expected one of"
                f" {', '.join(self._subject.channels)}"
            )
        named = {c: c for c in self._subject.channels if c in row} | {moved: "counts"}
        if moved in row:
            named[moved] = moved
        every = {c: number_of(self._path, row, column, index) for c, column in named.items()}
        readings = {c: v for c, v in every.items() if not math.isnan(v)}
        position = number_of(self._path, row, "position", index)
        if moved not in readings or math.isnan(position):
            return None
        number = number_of(self._path, row, "repeat", index)
        seconds = number_of(self._path, row, "seconds", index)
        after = number_of(self._path, row, "counts_after", index)
        change = {}
        if seconds > 0.0 and not math.isnan(after):
            change[moved] = (after - readings[moved]) / seconds
        repeat = 1 if math.isnan(number) else round(number)
        return Held(
            moved, repeat + self._first - 1, position, readings, change=change, duration_s=seconds
        )


def empty_table(subject: Subject, channel: str = "") -> str:
    """Return the table of a subject with its positions, to be filled in."""
    if not subject.positions or subject.table == "imu":
        return _EMPTY[subject.name]
    leak = "leak" in subject.limits
    lines = ["channel,repeat,position,counts" + (",counts_after,seconds" if leak else "")]
    for one in [channel] if channel else subject.channels:
        for repeat in range(1, subject.repeats + 1):
            if leak and repeat == 1:
                lines.append(f"{one},1,40,,,60")
            lines += [f"{one},{repeat},{p}," + (",," if leak else "") for p in subject.positions]
    return "\n".join(lines) + "\n"


_EMPTY = {
    "accelerometers": "repeat,up,ax,ay,az\n"
    + "".join(f"{r},{face},,,\n" for r in (1, 2) for face in ("+x", "-x", "+y", "-y", "+z", "-z")),
    "gyros": "repeat,kind,axis,angle_deg,seconds,p_degps,q_degps,r_degps\n"
    + "".join(
        f"{r},rest,,,,,,\n{r},turn,{axis},3600,,,,\n{r},rest,,,,,,\n{r},turn,{axis},-3600,,,,\n"
        for r in (1, 2)
        for axis in "xyz"
    ),
    "magnetometer": "mx,my,mz\n",
    "inertia": "axis,distance_m,length_m,period_s\n"
    + "".join(f"{axis},,,\n" for axis in ("xx", "yy", "zz") for _ in range(3)),
    "supply": "shown_v,meter_v\n,\n,\n,\n",
}

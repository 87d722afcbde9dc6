"""Rows of the original logger as columns to identify from; refused where their time is unknown."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from host.constants import NORMAL_95
from host.errors import IdentificationError
from host.original.row_table import NOTES, make_table
from host.original.rows import LAYOUTS, looks_like_rows, read_rows
from host.physical.calibration import load_calibration
from host.physical.recording import SURFACES, Recording
from host.readers.foreign_tables import Foreign

_HEAD_BYTES = 4096


def is_original(source: Path) -> bool:
    """Return whether a file begins with rows of the original logger."""
    if not source.is_file():
        return False
    with source.open("rb") as file:
        return looks_like_rows(file.read(_HEAD_BYTES))


def original_table(source: Path, calibration: Path | None, rate_hz: float | None) -> Foreign:
    """Return the columns of original rows: surfaces are commands, the clock is that of the rate.

    Parameters
    ----------
    source : Path
    calibration : Path, optional
    rate_hz : float, optional
        Rows per second; estimated from GPS without it.

    Raises
    ------
    IdentificationError
        If nobody knows the rate.
    """
    rows = read_rows(source)
    known = load_calibration(calibration)
    table = make_table(rows, known, rate_hz)
    rate = table.rate
    if not rate.known:
        raise IdentificationError(
            f"{source}: {rows.variant} of the original logger carry no time, and GPS saw no way to"
            " tell their rate from; give argument row_rate_hz (the thesis flew at 10 and 20, our"
            " recorder prints such rows at 5)"
        )
    share = rate.half_width_hz / rate.rate_hz / NORMAL_95
    notes = [f"original rows, {LAYOUTS[rows.variant]}", *NOTES]
    return Foreign(
        {
            name: values
            for name, values in table.columns.items()
            if values.dtype.kind == "f" and np.isfinite(values).any()
        },
        notes=[note.format(rate=rate.text) for note in notes],
        recording=Recording(SURFACES, share),
        calibration=known,
    )

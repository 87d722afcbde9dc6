"""Columns of a log of ours, and what is lost, uncalibrated or only commanded of them."""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from host.arrays import Array
from host.errors import IdentificationError
from host.log.ledger import LOST
from host.readers.even_grid import USED
from host.readers.foreign_tables import Foreign, is_text
from host.readers.recorded import recording_of_log
from host.terminal import command_line

if TYPE_CHECKING:
    from host.log import FlightLog


def recorded_log(
    source: Path,
    calibration: Path | None,
    wanted: Collection[str],
    session: int | None,
    *,
    maybe_table: bool,
) -> Foreign | None:
    """Return the columns of a log; None if it is none but may be a table of text."""
    from host.errors import NotALogError

    try:
        return _log(source, calibration, wanted, session)
    except NotALogError:
        if maybe_table and source.is_file() and is_text(source):
            return None
        raise


def _log(
    source: Path, calibration: Path | None, wanted: Collection[str], session: int | None
) -> Foreign:
    from host.log import read_log
    from host.log.source import find_flights, newest

    notes: list[str] = []
    if source.is_dir():
        flights = find_flights(source)
        source = newest(source, flights).path
        if len(flights) > 1:
            notes.append(f"{source.name} is the newest of {len(flights)} logs in the folder")
    log = read_log(source, session=session, calibration=calibration)
    raw, found = columns_of(log, wanted)
    lost = 0 if log.complete == "complete" else 1  # what is lost is said first
    notes = [*found[:lost], *notes, *found[lost:]]
    return of_log(log, raw, notes)


def of_log(log: FlightLog, columns: dict[str, Array], notes: list[str]) -> Foreign:
    """Return the columns of a log with how they were recorded."""
    from host.log.flown_inputs import flown_inputs

    inputs = flown_inputs(log)
    held = sorted({one.row + 1 for one in inputs if one.held})
    if held:
        rows = ", ".join(map(str, held))
        notes = [*notes, f"rows {rows} of the card held bank and pitch: feedback, not input"]
    return Foreign(
        columns,
        notes=notes,
        recording=recording_of_log(log),
        calibration=log.calibration,
        inputs=inputs,
    )


def columns_of(log: FlightLog, wanted: Collection[str]) -> tuple[dict[str, Array], list[str]]:
    """Return the columns of a log, and what is lost, uncalibrated or only commanded of them."""
    from host.log.calibration_note import calibration_note

    notes: list[str] = []
    raw: dict[str, Array] = {
        k: np.asarray(v, dtype=np.float64) for k, v in log.columns().items() if k in wanted
    }
    if not len(raw.get("t_s", ())):
        look = command_line("host", "info", log.path)
        raise IdentificationError(
            f"{log.path}: nothing was recorded in it; `{look}` says what it is"
        )
    if log.complete != "complete":
        loss = log.loss
        lost = f"{loss.seconds:.2f} s and {loss.lost_bytes} bytes lost" if loss.any else ""
        said = "; ".join(filter(None, (lost, loss.ending)))
        notes.append(f"{LOST} {log.complete}: {said} (`host decode` names every place)")
    poor_columns = [c for c in calibration_note(log)["default_columns"] if c in USED]
    if poor_columns:
        notes.append(
            f"{len(poor_columns)} columns have the default calibration (host calibrate); intervals"
            f" are those of sensors out of the box: {', '.join(poor_columns)}"
        )
    poor = [f"{name} {how}" for name, how in log.inputs.items() if how != "measured"]
    if poor:
        notes.append(f"control inputs: {', '.join(poor)}")
    return raw, notes

"""Read a flight into an even SI table: log, text table, Parquet or MAT.

Foreign names, units and signs come in through a map (`column_map`).
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from host.arrays import Array
from host.errors import IdentificationError
from host.files.regular import file_or_folder
from host.physical.calibration import Calibration, load_calibration
from host.physical.recording import Recording
from host.readers.autopilot_flight import is_autopilot_log
from host.readers.autopilot_table import autopilot_table
from host.readers.column_map import Line, listed, mapped, missing_lines, read_map
from host.readers.derived_columns import derived_columns
from host.readers.even_grid import FITTED, USED, even_grid
from host.readers.flight_choice import file_and_flight
from host.readers.foreign_tables import (
    TEXT_KINDS,
    Foreign,
    from_frame,
    leave_infinities_out,
    read_foreign,
    same_length,
)
from host.readers.original_table import is_original, original_table
from host.readers.readable_file import readable_file
from host.readers.recorded import commanded_by_map, recording_of_table
from host.readers.shipped_maps import maps_for
from host.sysid.checks.data_finding import Finding
from host.sysid.checks.unit_sign_checks import SURFACES
from host.sysid.flight.log_columns import columns_of, of_log, recorded_log
from host.sysid.maneuvers.logged_inputs import input_columns

if TYPE_CHECKING:
    import pandas as pd

    from host.log import FlightLog
    from host.readers.autotune_model import TunedModel

SENSORS = tuple(name for name in FITTED if name not in SURFACES)  # a command may well stand still
READ = (*TEXT_KINDS, ".parquet", ".mat")


@dataclass(frozen=True, slots=True)
class FlightColumns:
    """Columns of a flight in SI on an even grid, and what is known of them.

    Notes say what was done to them, findings what checks found. `resolution` is the step of the
    numbers of each quantised one; of a log there is the calibration that made them. `tuned` is what
    an autopilot's autotune identified.
    """

    columns: dict[str, Array]
    notes: list[str]
    recording: Recording
    calibration: Calibration | None
    findings: list[Finding] = field(default_factory=list)
    resolution: dict[str, float] = field(default_factory=dict)
    shares: tuple[str, ...] = ()
    tuned: tuple[TunedModel, ...] = ()


def read_columns(
    source: Path | FlightLog | pd.DataFrame,
    mapping: Path | None = None,
    *,
    calibration: Path | None = None,
    also: Collection[str] = (),
    sensors: Mapping[str, int | str] | None = None,
    row_rate_hz: float | None = None,
) -> tuple[dict[str, Array], list[str]]:
    """Return columns and notes of `read_flight_columns`, whose arguments these are; its findings
    stand behind the notes."""
    found = read_flight_columns(
        source, mapping, calibration=calibration, also=also, sensors=sensors,
        row_rate_hz=row_rate_hz,
    )  # fmt: skip
    notes = [*found.notes, *(finding.line for finding in found.findings)]
    if found.shares:
        notes.append(
            f"{', '.join(found.shares)}: the log has shares of full travel, no angles; here"
            " 57.3 deg stand for full travel"
        )
    return found.columns, notes


def read_flight_columns(
    source: Path | FlightLog | pd.DataFrame,
    mapping: Path | None = None,
    *,
    calibration: Path | None = None,
    also: Collection[str] = (),
    equations: Collection[str] = (),
    accept: Collection[str] = (),
    sensors: Mapping[str, int | str] | None = None,
    row_rate_hz: float | None = None,
) -> FlightColumns:
    """Return the columns identification uses, notes about them, and how they were recorded.

    Parameters
    ----------
    source : Path, FlightLog or DataFrame
        ``.bin`` log, ``.csv``, ``.parquet`` or ``.mat``, a log of PX4 or ArduPilot; a folder is
        read as a log. What `host.read_log` returns, its table, or any table of SI columns.
    mapping : Path, optional
        TOML map of foreign names, units and signs, or the name of a shipped one.
    calibration : Path, optional
        Calibration of a log; the default one without.
    also : collection of str
        Signals of a model of one's own, besides those that are always looked for.
    equations : collection of str
        Columns that a model reads: what others miss divides no maneuver. Empty: it may be any.
    accept : collection of str
        Checks whose findings change nothing: the columns are used as they are.
    sensors : mapping of str to int, optional
        Instance to use of a message in an autopilot's log, or the surface that an output moves.
    row_rate_hz : float, optional
        Rows a second of original rows; estimated from GPS without it.

    Raises
    ------
    IdentificationError
        If the file or the map cannot be used.
    """
    wanted = ("t_s", *USED, *(name for name in also if name not in USED))
    lines = read_map(mapping, wanted) if mapping is not None else {}
    found, recorded = _read(
        source,
        mapping,
        calibration,
        (*wanted, *(c for line in lines.values() for c in line.needed)),
        sensors,
        row_rate_hz,
    )
    leave_infinities_out(found)
    raw, notes = found.columns, found.notes
    if mapping is not None:
        raw = _by_map(found, lines, mapping, ours=recorded)
        wanted = (*wanted, *(name for name in lines if name not in wanted))
    used = {k: raw[k] for k in wanted if k in raw}
    theirs = {name: line.foreign for name, line in lines.items()}
    called = source_name(source)
    _refuse_unusable(used, found, theirs, called)
    notes += _remarks(used, found.remarks, theirs)
    if recorded:
        columns = even_grid(used, notes)
        columns |= input_columns(columns["t_s"], found.inputs)
        columns |= derived_columns(columns, wanted)
        return FlightColumns(columns, notes, found.recording, found.calibration)
    from host.sysid.flight.table_columns import table_columns  # checks that our log needs not

    found.columns = raw = {}  # what is used of them is known
    columns, findings, resolution = table_columns(used, found, source, called, accept, equations)
    return FlightColumns(
        columns | derived_columns(columns, wanted),
        notes,
        found.recording,
        found.calibration,
        findings,
        resolution,
        tuple(s for s in found.shares if f"{s}_rad" not in lines),
        found.tuned,
    )


def _by_map(
    found: Foreign, lines: Mapping[str, Line], mapping: Path, *, ours: bool
) -> dict[str, Array]:
    """Return the columns of a table by our names; its notes and its recording know of the map."""
    # A column of a log is ours; one of a table that happens to have our name need not be.
    own = found.columns if ours or found.shares else {}
    shown = own or {k: v for k, v in found.columns.items() if k == "t_s"}
    found.notes += missing_lines(lines, found.columns)
    found.recording = commanded_by_map(found.recording, lines)
    return shown | mapped(found.columns, found.unusable, lines, mapping, found.twice)


def _remarks(
    used: Collection[str], said: Mapping[str, str], theirs: Mapping[str, str]
) -> list[str]:
    """Return what a reader says of the columns that are used."""
    remarks = {name: said.get(theirs.get(name, name)) for name in used}
    return [f"{name}: {remark}" for name, remark in remarks.items() if remark]


def _refuse_unusable(
    used: Mapping[str, Array], found: Foreign, theirs: Mapping[str, str], called: str
) -> None:
    """Refuse a table without time, with two columns of one name, or of several lengths."""
    if "t_s" not in used:
        fitting = [
            f"argument mapping {name} has these columns; " for name in maps_for(found.columns)
        ]
        raise IdentificationError(
            f"{called}: no column t_s; {''.join(fitting)}name it in a map (--map; in Python"
            ' mapping=), such as `t_s = { from = "TimeUS", unit = "us" }` below a line [columns]; '
            + listed(found.columns, found.unusable)
        )
    both = [k for k in used if k in found.twice and k not in theirs]
    if both:
        raise IdentificationError(f"{called}: several columns '{both[0]}': rename them")
    same_length(used, called)


def source_name(source: str | Path | FlightLog | pd.DataFrame) -> str:
    """Return the name of a source in an answer: where it was read from, or ``table``."""
    if isinstance(source, str | Path):
        return str(source)
    return str(getattr(source, "path", "table"))


def _read(
    source: Path | FlightLog | pd.DataFrame,
    mapping: Path | None,
    calibration: Path | None,
    wanted: Collection[str],
    sensors: Mapping[str, int | str] | None,
    row_rate_hz: float | None = None,
) -> tuple[Foreign, bool]:
    """Return the columns of a source, and whether our logger recorded them."""
    from host.log import FlightLog

    if isinstance(source, FlightLog):
        columns, notes = columns_of(source, wanted)
        return of_log(source, columns, notes), True
    if not isinstance(source, Path):
        found = from_frame(_with_its_index(source))
        found.recording = recording_of_table(found.columns, source.attrs)
        if "calibration" in source.attrs:  # of `FlightLog.table`
            default = load_calibration()
            found.calibration = default if source.attrs["calibration"] == default.name else None
            return found, True
    else:
        source, flight = file_and_flight(source)
        source = readable_file(file_or_folder(source, IdentificationError))
        if is_autopilot_log(source):
            return autopilot_table(source, sensors, flight), False
        if is_original(source):
            return original_table(source, calibration, row_rate_hz), False
        kind = source.suffix.lower()
        if kind not in READ or (kind in TEXT_KINDS[1:] and mapping is None):  # original rows
            log = recorded_log(source, calibration, wanted, flight, maybe_table=kind != ".bin")
            if log is not None:
                return log, True
        found = read_foreign(source)
        found.recording = recording_of_table(found.columns, {})
    if calibration is not None:
        found.notes.append("a calibration is for logs: here only its standard deviations count")
    return found, False


def _with_its_index(table: pd.DataFrame) -> pd.DataFrame:
    """Return a table with its index as a column, unless that only counts rows."""
    import pandas as pd

    return table if isinstance(table.index, pd.RangeIndex) else table.reset_index()

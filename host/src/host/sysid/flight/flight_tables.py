"""Read a flight into an even SI table: log, text table, Parquet or MAT.

Foreign names, units and signs come in through a map (`column_map`).
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from host.arrays import Array, BoolArray, IntArray
from host.files.regular import file_or_folder
from host.instrument.recording import Recording
from host.physical.calibration import Calibration, load_calibration
from host.readers.autopilot_flight import is_autopilot_log
from host.sysid.flight.autopilot_table import autopilot_table
from host.sysid.flight.column_map import listed, mapped, missing_lines, read_map
from host.sysid.flight.column_sampling import Sampling, sampled_name
from host.sysid.flight.data_finding import Finding
from host.sysid.flight.derived_columns import derived_columns
from host.sysid.flight.finding_consequences import checked
from host.sysid.flight.foreign_tables import (
    TEXT_KINDS,
    Foreign,
    from_frame,
    is_text,
    read_foreign,
    refuse_other,
    same_length,
)
from host.sysid.flight.measured import Measured, measured
from host.sysid.flight.original_table import is_original, original_table
from host.sysid.flight.recorded import commanded_by_map, recording_of_log, recording_of_table
from host.sysid.flight.unit_sign_checks import SURFACES
from host.sysid.identification_error import IdentificationError
from host.terminal import command_line

if TYPE_CHECKING:
    import pandas as pd

    from host.log import FlightLog

ANGLES = ("alpha_rad", "beta_rad", "phi_rad", "theta_rad", "psi_rad")
USED = (
    "airspeed_mps", "alpha_rad", "beta_rad", "p_radps", "q_radps", "r_radps",
    "ax_mps2", "ay_mps2", "az_mps2", "phi_rad", "theta_rad", "psi_rad",
    "elevator_rad", "aileron_rad", "rudder_rad", "throttle",
    "qbar_pa", "static_pa", "density_kgpm3", "altitude_m",
    "v_north_mps", "v_east_mps", "v_down_mps",
)  # fmt: skip
WANTED = frozenset(("t_s", *USED))
# Missing for longer, one of these makes a maneuver useless; others are only looked at.
FITTED = (
    "airspeed_mps", "alpha_rad", "beta_rad", "p_radps", "q_radps", "r_radps",
    "ax_mps2", "ay_mps2", "az_mps2", "phi_rad", "theta_rad",
    "elevator_rad", "aileron_rad", "rudder_rad",
)  # fmt: skip
SENSORS = tuple(name for name in FITTED if name not in SURFACES)  # a command may well stand still
READ = (*TEXT_KINDS, ".parquet", ".mat")
BRIDGED = "bridged"  # column of the table: not zero where a line was drawn over a long gap
LONGEST_GAP_S = 0.25
FEWEST = 30  # 1.5 s at 20 Hz
SLOWEST_S, FASTEST_S = 0.5, 1e-4  # between rows: beyond, the unit of time is wrong
BACKWARD_S = 1.0  # rows may swap places; a step back over more is another recording
MOST_JUMP_RAD = 2.0 * np.pi + 0.5
FEW_ROWS = 500_000  # of an even grid: 80 minutes at 100 Hz, however few were recorded
MOST_EMPTY = 20  # rows of the even grid for each row that was recorded


@dataclass(frozen=True, slots=True)
class FlightColumns:
    """SI columns on an even grid, notes about what was done to them, how they were recorded, of a
    log the calibration that made them, what checks found in them, the step of the numbers of each
    quantised one, and of which surfaces the columns are shares of full travel."""

    columns: dict[str, Array]
    notes: list[str]
    recording: Recording
    calibration: Calibration | None
    findings: list[Finding] = field(default_factory=list)
    resolution: dict[str, float] = field(default_factory=dict)
    shares: tuple[str, ...] = ()


def read_columns(
    source: Path | FlightLog | pd.DataFrame,
    mapping: Path | None = None,
    *,
    calibration: Path | None = None,
    also: Collection[str] = (),
    sensors: Mapping[str, int] | None = None,
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
            f"{', '.join(found.shares)}: shares of full travel, of which 57.3 deg stand for all"
        )
    return found.columns, notes


def read_flight_columns(
    source: Path | FlightLog | pd.DataFrame,
    mapping: Path | None = None,
    *,
    calibration: Path | None = None,
    also: Collection[str] = (),
    accept: Collection[str] = (),
    sensors: Mapping[str, int] | None = None,
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
        Signals of a model of one's own, beside those that are always looked for.
    accept : collection of str
        Checks whose findings change nothing: the columns are used as they are.
    sensors : mapping of str to int, optional
        Of an autopilot's log, the instance to use of a message.
    row_rate_hz : float, optional
        Of original rows, how many a second; estimated from GPS without it.

    Raises
    ------
    IdentificationError
        If the file or the map cannot be used.
    """
    wanted = ("t_s", *USED, *(name for name in also if name not in USED))
    lines = read_map(mapping, wanted) if mapping is not None else {}
    theirs = {name: line.foreign for name, line in lines.items()}
    found, recorded = _read(
        source,
        mapping,
        calibration,
        (*wanted, *(c for line in lines.values() for c in line.needed)),
        sensors,
        row_rate_hz,
    )
    called = source_name(source)
    raw, notes = dict(found.columns), found.notes
    if mapping is not None:
        # A column of a log is ours; one of a table that happens to have our name need not be.
        shown = raw if recorded or found.shares else {k: v for k, v in raw.items() if k == "t_s"}
        raw = shown | mapped(found.columns, found.unusable, lines, mapping, found.twice)
        notes += missing_lines(lines, found.columns)
        wanted = (*wanted, *(name for name in lines if name not in wanted))
        found.recording = commanded_by_map(found.recording, lines)
    if "t_s" not in raw:
        raise IdentificationError(
            f"{called}: no column t_s; name it in a map (argument mapping); "
            + listed(found.columns, found.unusable)
        )
    used = {k: raw[k] for k in wanted if k in raw}
    both = [k for k in used if k in found.twice and k not in theirs]
    if both:
        raise IdentificationError(f"{called}: several columns '{both[0]}': rename them")
    for name in used:
        remark = found.remarks.get(theirs.get(name, name))
        notes += [f"{name}: {remark}"] if remark else []
    same_length(used, called)
    if recorded:
        columns = _even(used, notes)
        columns |= derived_columns(columns, wanted)
        return FlightColumns(columns, notes, found.recording, found.calibration)
    seen = _measured(used, notes, accept)
    even = _even(seen.columns, notes)
    columns, findings = checked(even, accept)
    columns = columns | derived_columns(columns, wanted)
    return FlightColumns(
        columns,
        notes,
        found.recording,
        found.calibration,
        [*found.findings, *seen.findings, *findings],
        _resolutions(seen.sampling, even, columns),
        tuple(s for s in found.shares if f"{s}_rad" not in lines),
    )


def _measured(columns: dict[str, Array], notes: list[str], accept: Collection[str]) -> Measured:
    """Return the rows that are used, in order, what was not measured as missing, and findings."""
    index = _rows(columns["t_s"], notes)
    found = measured({k: v[index] for k, v in columns.items()}, SENSORS, LONGEST_GAP_S, accept)
    notes += found.notes
    return found


def _resolutions(
    sampling: Mapping[str, Sampling], even: Mapping[str, Array], used: Mapping[str, Array]
) -> dict[str, float]:
    """Return the step of each quantised column, in the unit in which the column is used."""
    found = {}
    for name, own in sampling.items():
        if own.step > 0.0 and name in used:
            span = float(np.ptp(even[name]))
            found[name] = own.step * float(np.ptp(used[name])) / span if span else own.step
    return found


def source_name(source: str | Path | FlightLog | pd.DataFrame) -> str:
    """Return what a source is called in an answer: where it was read from, or ``table``."""
    if isinstance(source, str | Path):
        return str(source)
    return str(getattr(source, "path", "table"))


def _read(
    source: Path | FlightLog | pd.DataFrame,
    mapping: Path | None,
    calibration: Path | None,
    wanted: Collection[str],
    sensors: Mapping[str, int] | None,
    row_rate_hz: float | None = None,
) -> tuple[Foreign, bool]:
    """Return the columns of a source, and whether our logger recorded them."""
    from host.log import FlightLog

    if isinstance(source, FlightLog):
        columns, notes = _columns_of(source, wanted)
        return _of_log(source, columns, notes), True
    if not isinstance(source, Path):
        found = from_frame(_with_its_index(source))
        found.recording = recording_of_table(found.columns, source.attrs)
        if "calibration" in source.attrs:  # of `FlightLog.table`
            default = load_calibration()
            found.calibration = default if source.attrs["calibration"] == default.name else None
            return found, True
    else:
        file_or_folder(source, IdentificationError)
        if is_autopilot_log(source):
            return autopilot_table(source, sensors), False
        if is_original(source):
            return original_table(source, calibration, row_rate_hz), False
        kind = source.suffix.lower()
        if kind not in READ or (kind in TEXT_KINDS[1:] and mapping is None):  # original rows
            log = _recorded(source, calibration, wanted, maybe_table=kind != ".bin")
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


def _recorded(
    source: Path, calibration: Path | None, wanted: Collection[str], *, maybe_table: bool
) -> Foreign | None:
    """Return the columns of a log; None if it is none but may be a table of text."""
    from host.errors import NotALogError

    if source.is_file():
        refuse_other(source)
    try:
        return _log(source, calibration, wanted)
    except NotALogError:
        if maybe_table and source.is_file() and is_text(source):
            return None
        raise


def _log(source: Path, calibration: Path | None, wanted: Collection[str]) -> Foreign:
    from host.log import read_log
    from host.log.source import find_flights, newest

    notes: list[str] = []
    if source.is_dir():
        flights = find_flights(source)
        source = newest(source, flights).path
        if len(flights) > 1:
            notes.append(f"{source.name} is the newest of {len(flights)} logs in the folder")
    log = read_log(source, calibration=calibration)
    raw, found = _columns_of(log, wanted)
    lost = 0 if log.complete == "complete" else 1  # what is lost is said first
    notes = [*found[:lost], *notes, *found[lost:]]
    return _of_log(log, raw, notes)


def _of_log(log: FlightLog, columns: dict[str, Array], notes: list[str]) -> Foreign:
    recording = recording_of_log(log)
    return Foreign(columns, notes=notes, recording=recording, calibration=log.calibration)


def _columns_of(log: FlightLog, wanted: Collection[str]) -> tuple[dict[str, Array], list[str]]:
    """Return the columns of a log, and what is lost, uncalibrated or only commanded of them."""
    from host.decode.log_summary import calibration_note

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
        notes.append(f"the log is {log.complete}: {said} (`host decode` names every place)")
    poor_columns = [c for c in calibration_note(log)["default_columns"] if c in USED]
    if poor_columns:
        notes.append(
            "default calibration, not this instrument's own, under: "
            + ", ".join(poor_columns)
            + "; its deviations are those of sensors out of the box, and so are the intervals"
        )
    poor = [f"{name} {how}" for name, how in log.inputs.items() if how != "measured"]
    if poor:
        notes.append(f"control inputs: {', '.join(poor)}")
    return raw, notes


def even_columns(table: pd.DataFrame) -> tuple[dict[str, Array], list[str]]:
    """Return the columns identification uses of a decoded table, on an even grid, and notes.

    Raises
    ------
    IdentificationError
        If there is no time in it, or too little of it.
    """
    return even_arrays(from_frame(table).columns)


def even_arrays(columns: Mapping[str, Array]) -> tuple[dict[str, Array], list[str]]:
    """Return the same of columns that are arrays already.

    Raises
    ------
    IdentificationError
        If there is no time in them, or too little of it.
    """
    raw = {k: v for k, v in columns.items() if k in WANTED}
    if "t_s" not in raw:
        raise IdentificationError("no column t_s in the table")
    notes: list[str] = []
    return _even(raw, notes), notes


def _rows(t: Array, notes: list[str]) -> IntArray:
    """Return which rows are used, in order of time.

    Raises
    ------
    IdentificationError
        If they are too few or from two recordings.
    """
    index = np.flatnonzero(np.isfinite(t))
    steps = np.diff(t[index])
    if len(index) < FEWEST:
        raise IdentificationError(f"{len(index)} samples with a time, at least {FEWEST} are needed")
    if steps.min() < -BACKWARD_S:
        k = int(np.argmin(steps))
        raise IdentificationError(
            f"time jumps back from {t[index[k]]:.6g} to {t[index[k + 1]]:.6g} s in row"
            f" {index[k + 1] + 1}: more than one recording; cut the file there"
        )
    if steps.min() > 0.0:
        return index
    swapped = int(np.sum(steps < 0.0))
    order = index[np.argsort(t[index], kind="stable")]
    kept: IntArray = order[np.concatenate([[True], np.diff(t[order]) > 0.0])]
    if len(kept) < FEWEST:
        raise IdentificationError(
            f"{len(kept)} different instants, at least {FEWEST} are needed: time stands still"
        )
    if swapped:
        notes.append(f"{swapped} rows came before their time and were sorted in")
    if len(kept) < len(index):
        few = ": t_s is written with too few digits" if len(kept) < 0.6 * len(index) else ""
        notes.append(
            f"{len(index) - len(kept)} of {len(index)} rows repeat an instant and were left out"
            + few
        )
    return kept


class _Instants:
    """The instants at which some column was measured; columns of one sensor share them."""

    def __init__(self, t: Array) -> None:
        self.t = t
        self.gaps = np.diff(t)
        usual_s = float(np.median(self.gaps)) if len(t) > 1 else 0.0
        self.step_s = usual_s if len(t) >= FEWEST else 0.0
        self.long_s = max(LONGEST_GAP_S, 3.0 * usual_s) if len(t) > 1 else 0.0


def _instants(t: Array, columns: Mapping[str, Array]) -> dict[str, _Instants]:
    """Return the instants of each column; medians over an hour are taken once a sensor."""
    by_pattern: dict[bytes, _Instants] = {}
    found: dict[str, _Instants] = {}
    for name, values in columns.items():
        seen = np.isfinite(values)
        pattern = np.packbits(seen).tobytes()
        if pattern not in by_pattern:
            by_pattern[pattern] = _Instants(t[seen])
        found[name] = by_pattern[pattern]
    return found


def _recorded_s(rows: _Instants) -> float:
    """Return the time of all rows without their gaps."""
    return float(np.sum(rows.gaps[rows.gaps <= rows.long_s]))  # a gap of all is nobody's


def _covered(own: _Instants, recorded_s: float) -> float:
    """Return the share of the time that the instants seen follow each other as they usually do."""
    if len(own.t) < FEWEST or own.long_s > max(LONGEST_GAP_S, 3.0 * SLOWEST_S):
        return 0.0
    return float(np.sum(own.gaps[own.gaps <= own.long_s])) / max(recorded_s, 1e-9)


def _grid(rows: _Instants, dt_s: float, notes: list[str]) -> Array:
    """Return even instants at the rate of the fastest sensor."""
    t, gaps = rows.t, rows.gaps
    if not FASTEST_S <= dt_s <= SLOWEST_S:
        raise IdentificationError(
            f"a row every {dt_s:.3g} s: {FASTEST_S:g} to {SLOWEST_S:g} s can be used; is the unit"
            " of t_s right?"
        )
    count = int((t[-1] - t[0]) / dt_s) + 1
    if count > max(MOST_EMPTY * len(t), FEW_ROWS):
        k = int(np.argmax(gaps))
        raise IdentificationError(
            f"time jumps from {t[k]:.6g} to {t[k + 1]:.6g} s: cut the file there"
        )
    if float(gaps.max()) > rows.long_s:
        many = int((gaps > rows.long_s).sum())
        notes.append(
            f"{many} gap{'s' if many > 1 else ''}, the longest {gaps.max():.2f} s;"
            " a maneuver over one is divided"
        )
    return np.asarray(t[0] + dt_s * np.arange(count))


def _even(columns: dict[str, Array], notes: list[str]) -> dict[str, Array]:
    """Bring the table to an even grid, unwrap angles once, draw lines over gaps."""
    index = _rows(columns["t_s"], notes)
    if not np.array_equal(index, np.arange(len(columns["t_s"]))):
        columns = {name: values[index] for name, values in columns.items()}
    instants = _instants(columns["t_s"], columns)
    rows = instants["t_s"]
    steps = {name: own.step_s for name, own in instants.items() if name in FITTED}
    dt_s = min((step for step in steps.values() if step > 0.0), default=rows.step_s)
    grid = _grid(rows, dt_s, notes)
    result: dict[str, Array] = {"t_s": grid}
    bridged, recorded_s = _over(grid, rows), _recorded_s(rows)
    longest_step_s = float(rows.gaps.max())
    missing: list[tuple[float, float, str]] = []
    slower: list[str] = []
    for name, values in columns.items():
        if name == "t_s":
            continue
        own = instants[name]
        covered = _covered(own, recorded_s)
        if covered < 0.5:
            notes.append(f"{name}: {100.0 * (1.0 - covered):.0f} % missing, not used")
            continue
        if steps.get(name, 0.0) > 1.5 * dt_s:
            slower.append(f"{name} {steps[name]:.3g} s")
        series = values[np.isfinite(values)]
        if name in ANGLES:
            series = _unwrapped(name, series, notes)
        result[name] = np.interp(grid, own.t, series)
        if steps.get(name, 0.0) > 1.5 * dt_s:
            result[sampled_name(name)] = _at_instants(grid, own.t)
        if name in FITTED and len(own.t) < len(rows.t):
            bridged |= _over(grid, own)
            longest = int(np.argmax(own.gaps))
            if own.gaps[longest] > max(own.long_s, 1.01 * longest_step_s):
                missing.append((float(own.gaps[longest]), float(own.t[longest]), name))
    if slower:
        notes.append(
            f"slower than the {dt_s:.3g} s of others, drawn between: {', '.join(slower)}; output"
            " error compares at their own instants, all else takes the lines for measurements"
        )
    if missing:
        length_s, at_s, _ = max(missing)
        names = ", ".join(name for _, _, name in missing)
        notes.append(
            f"missing within the flight, for {length_s:.2f} s from {at_s:.2f} s: {names};"
            " a maneuver over a gap is divided"
        )
    if bridged.any():
        result[BRIDGED] = bridged.astype(np.float64)
    return result


def _unwrapped(name: str, series: Array, notes: list[str]) -> Array:
    """Return an angle without its jumps by a turn: of 360 where it is in degrees."""
    largest = float(np.max(np.abs(np.diff(series)), initial=0.0))
    if largest <= MOST_JUMP_RAD:
        return np.asarray(np.unwrap(series))
    notes.append(f"{name} jumps by {largest:.3g} rad from one row to the next: turns of 360 there")
    return np.asarray(np.unwrap(series, period=360.0))


def _at_instants(grid: Array, t: Array) -> Array:
    """Return one at the grid's instants that are nearest to some of t, zero at all others."""
    found = np.zeros(len(grid))
    step_s = float(grid[1] - grid[0])
    nearest = np.clip(np.round((t - grid[0]) / step_s), 0, len(grid) - 1).astype(np.int64)
    found[nearest] = 1.0
    return found


def _over(grid: Array, own: _Instants) -> BoolArray:
    """Return where the grid lies within a long gap between instants."""
    t, long_s = own.t, own.long_s
    over = np.zeros(len(grid), dtype=bool)
    for last in np.flatnonzero(own.gaps > long_s):
        over[np.searchsorted(grid, t[last], "right") : np.searchsorted(grid, t[last + 1])] = True
    if t[0] - grid[0] > long_s:
        over[: np.searchsorted(grid, t[0])] = True
    if grid[-1] - t[-1] > long_s:
        over[np.searchsorted(grid, t[-1], "right") :] = True
    return over

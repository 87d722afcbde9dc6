"""A flight as its columns: read from a source, or at hand in a program."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from host.arrays import Array
from host.errors import IdentificationError
from host.instrument.instrument_errors import InstrumentErrors
from host.physical.recording import Recording
from host.sysid.flight.flight_tables import FlightColumns, read_flight_columns, source_name
from host.sysid.maneuvers.maneuver_detection import DetectedManeuver
from host.sysid.pipeline.known_aircraft import AircraftData, aircraft_data
from host.sysid.pipeline.reading_options import ReadingOptions

if TYPE_CHECKING:
    import pandas as pd

    from host.log import FlightLog

    Source = str | Path | FlightLog | pd.DataFrame


@dataclass(frozen=True, slots=True)
class FlightAtHand:
    """One flight as arrays, and what is known besides them.

    Attributes
    ----------
    read : FlightColumns
        Columns on an even grid, as reading makes them.
    source : str
        What an answer calls it.
    how : ReadingOptions
        Only what is asked of the columns counts: maneuvers, stretches, corrections, delays,
        accepted findings, the calibration's deviations.
    known : AircraftData or None
    windows : tuple of DetectedManeuver or None
        Maneuvers to use in place of those that would be found.
    errors : InstrumentErrors or None
        Errors of the sensors of an aircraft without a file, in place of what is usual of their
        maker.
    """

    read: FlightColumns
    source: str = "columns"
    how: ReadingOptions = field(default_factory=ReadingOptions)
    known: AircraftData | None = None
    windows: tuple[DetectedManeuver, ...] | None = None
    errors: InstrumentErrors | None = None


def at_hand(
    columns: Mapping[str, Array],
    *,
    aircraft: str | Path | AircraftData | None = None,
    recording: Recording | None = None,
    windows: Sequence[DetectedManeuver] | None = None,
    errors: InstrumentErrors | None = None,
    corrections: bool = True,
    delays: bool = True,
) -> FlightAtHand:
    """Return columns of a program's own as a flight.

    Parameters
    ----------
    columns : mapping of (n,) Array
        SI columns on an even grid, named as `FlightLog.table` names them.
    aircraft : str, Path or AircraftData, optional
    recording : Recording, optional
        Who recorded them and how; our logger, everything measured, without.
    windows : sequence of DetectedManeuver, optional
        Maneuvers to use in place of those that would be found.
    errors : InstrumentErrors, optional
        Errors of the sensors, without an aircraft file.
    corrections, delays : bool
        As in `host.identify`.

    Raises
    ------
    host.errors.UsageError
        If there is no such aircraft.
    """
    if isinstance(aircraft, str | Path):
        aircraft = aircraft_data(aircraft)
    return FlightAtHand(
        FlightColumns(dict(columns), [], recording or Recording(), None),
        how=ReadingOptions(corrections=corrections, delays=delays),
        known=aircraft,
        windows=None if windows is None else tuple(windows),
        errors=errors,
    )


def read_flight(source: Source, how: ReadingOptions, known: AircraftData | None) -> FlightAtHand:
    """Read a flight.

    Raises
    ------
    host.errors.HostError
        If it cannot be read.
    """
    read = read_flight_columns(
        Path(source) if isinstance(source, str) else source,
        how.mapping,
        calibration=how.calibration,
        also=how.also,
        equations=how.equations,
        accept=how.accept,
        sensors=dict(how.sensors),
        row_rate_hz=how.row_rate_hz,
    )
    return FlightAtHand(read, source_name(source), how, known)


def listed_flights(flights: Source | Sequence[Source]) -> list[Source]:
    """Return the flights as a list; a path, a log or a table is one flight.

    Raises
    ------
    IdentificationError
        If there is none, or one is something else.
    """
    from host.log import FlightLog

    listed: list[Any] = list(flights) if isinstance(flights, list | tuple) else [flights]
    if not listed:
        raise IdentificationError("no flight given; name a log, a table, or several")
    for number, one in enumerate(listed, start=1):
        if not isinstance(one, str | Path | FlightLog) and not _is_table(one):
            raise IdentificationError(
                f"flight {number} is of type {type(one).__name__}, expected a path, what"
                " host.read_log returns, or a table (DataFrame)"
            )
    return listed


def _is_table(one: object) -> bool:
    """Return whether it is a DataFrame: who has one has loaded pandas, a log needs none (0.5 s)."""
    pandas = sys.modules.get("pandas")
    return pandas is not None and isinstance(one, pandas.DataFrame)

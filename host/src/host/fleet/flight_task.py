"""The task of identifying one flight, as plain values that go from process to process."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

IDENTIFY = "host.fleet.tasks.flight_identification:flight_row"
ROWS = 4  # version of a row; raised when its content changes, so that flights are done again
DEFAULT_MODELS = ("coefficients",)  # of a flight without vanes its linear models
IDENTIFIED, SET_ASIDE = "identified", "set aside"


@dataclass(frozen=True, slots=True)
class FlightTask:
    """One flight to be identified.

    Attributes
    ----------
    key : str
        Hash of everything that the answer depends on.
    source : str
        Path, or an address that fsspec reads.
    log_id : str
        Hash of the log, or of an address the identifier that its store gives instead.
    type, aircraft : str
        Whose flight it is.
    aircraft_file : str
        Name or path.
    aircraft_id, calibration_id : str
        Hashes of the aircraft file and of the calibration; the latter empty without one.
    calibration, mapping : str
        Paths; empty without.
    models : tuple of str
    accept : tuple of str
        As of `host identify`.
    date : str
        ``2026-11-23``, or empty if the date is to come from the log.
    version : str
        Version of this package and of its rows.
    """

    key: str
    source: str
    log_id: str
    type: str
    aircraft: str
    aircraft_file: str
    aircraft_id: str
    calibration: str
    calibration_id: str
    mapping: str
    models: tuple[str, ...]
    accept: tuple[str, ...]
    date: str
    version: str

    def values(self) -> dict[str, Any]:
        """Return the task as a dictionary."""
        return asdict(self)


@dataclass(frozen=True, slots=True)
class TaskLimits:
    """Limits beyond which a flight is set aside.

    Attributes
    ----------
    processor_s : float
        Processor time, which a busy computer does not change.
    memory_mb : float
        Resident memory.
    waiting_s : float
        Time by the clock, for a flight that hangs without using the processor.
    """

    processor_s: float = 300.0
    memory_mb: float = 3000.0
    waiting_s: float = 1800.0


def set_aside(values: dict[str, Any], reason: str) -> dict[str, Any]:
    """Return the row of a flight that gave no answer, with the reason."""
    return {**described(values), "state": SET_ASIDE, "reason": reason}


def described(values: dict[str, Any]) -> dict[str, Any]:
    """Return the columns that a row has whether or not its flight was identified."""
    date = values.get("date") or ""
    return {
        "key": values["key"],
        "source": values["source"],
        "log_id": values["log_id"],
        "type": values["type"],
        "aircraft": values["aircraft"],
        "aircraft_file": values["aircraft_file"],
        "aircraft_id": values["aircraft_id"],
        "calibration_id": values["calibration_id"],
        "date": date,
        "month": date[:7] or "undated",
        "models": list(values["models"]),
        "version": values["version"],
    }

"""Aircraft file and calibration, read once for every stage."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from host.aircraft.file import load_measured
from host.aircraft.mass_properties import AirframeData, airframe_data
from host.aircraft.powerplant import NoPropulsionError, Powerplant, powerplant
from host.instrument.deviations import SensorErrorModel, sensor_error_model
from host.physical.calibration import Calibration, load_calibration
from host.physical.recording import OWN
from host.sysid.flight.flight_tables import FlightColumns


@dataclass(frozen=True, slots=True)
class AircraftData:
    """Knowledge of an aircraft and its sensors before the flight.

    Attributes
    ----------
    source : str
        Name or file of the aircraft.
    airframe : AirframeData
    instrument : SensorErrorModel
    powerplant : Powerplant or None
        None if the file does not describe a propeller.
    doubts : tuple of str
        Numbers of the file that no known aircraft has, one line each.
    calibration : Calibration or None
        Calibration of the instrument, if the user gave one.
    """

    source: str
    airframe: AirframeData
    instrument: SensorErrorModel
    powerplant: Powerplant | None
    doubts: tuple[str, ...]
    calibration: Calibration | None = None

    def flown(self, flight: FlightColumns) -> SensorErrorModel:
        """Return the instrument as it was on a flight: its servos, its clock, and where a
        calibration made the columns, what that says of sensors nobody measured. Sensors that are
        not our logger's are wrong by more, but for what a calibration says."""
        made_by, instrument = flight.calibration, self.instrument
        if made_by is not None and made_by.defaults():
            instrument = sensor_error_model(self.source, made_by, defaults=True)
        elif flight.recording.maker != OWN:
            maker = flight.recording.maker
            instrument = sensor_error_model(self.source, self.calibration, maker=maker)
        return instrument.recorded(flight.recording)


def aircraft_data(source: str | Path, calibration: str | Path | None = None) -> AircraftData:
    """Read an aircraft by name or file, and its instrument's calibration.

    Raises
    ------
    host.errors.UsageError
        If there is no such file, or a value in one is impossible.
    """
    name = str(source)
    airframe = airframe_data(name)
    measured = load_calibration(Path(calibration)) if calibration is not None else None
    try:
        rotor = powerplant(name)
    except NoPropulsionError:
        rotor = None
    return AircraftData(
        name,
        airframe,
        sensor_error_model(name, measured),
        rotor,
        tuple(load_measured(name).doubts),
        measured,
    )

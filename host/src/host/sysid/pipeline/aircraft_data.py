"""What the aircraft file and the calibration say, read once for every stage."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from host.aircraft.file import load_measured
from host.aircraft.mass_properties import AirframeData, airframe_data
from host.aircraft.powerplant import NoPropulsionError, Powerplant, powerplant
from host.instrument.deviations import SensorErrorModel, sensor_error_model
from host.physical.calibration import load_calibration


@dataclass(frozen=True, slots=True)
class AircraftKnown:
    """Mass and sizes, sensors with their errors, and the propeller where the file describes it."""

    source: str
    airframe: AirframeData
    instrument: SensorErrorModel
    powerplant: Powerplant | None
    doubts: tuple[str, ...]


def aircraft_known(source: str | Path, calibration: str | Path | None = None) -> AircraftKnown:
    """Read an aircraft by name or file, and its instrument's calibration.

    Raises
    ------
    host.errors.UsageError
        If there is no such file, or something in one cannot be.
    """
    name = str(source)
    airframe = airframe_data(name)
    said = load_calibration(Path(calibration)) if calibration is not None else None
    try:
        rotor = powerplant(name)
    except NoPropulsionError:
        rotor = None
    return AircraftKnown(
        name, airframe, sensor_error_model(name, said), rotor, tuple(load_measured(name).doubts)
    )

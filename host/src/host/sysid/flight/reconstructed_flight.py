"""A flight as estimation takes it: columns as recorded and as the air met the CG, its maneuvers.

The columns of linear fits are corrected here, once for every model and method: what the aircraft
file says of places and dynamics of the sensors, and what the reconstruction tells of their errors.
Coefficients take the columns as recorded, for they estimate those errors themselves.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from host.physical.recording import OWN
from host.sysid.flight.column_change import Record, change_of
from host.sysid.reconstruction.position_correction import transfer_to_cg
from host.sysid.reconstruction.sensor_corrections import (
    advance_delayed,
    correct_columns,
    corrections,
    pressure_share,
)
from host.sysid.reconstruction.sensor_dynamics import columns_at_cg, without_expected_errors

if TYPE_CHECKING:
    from host.aircraft.mass_properties import AirframeData
    from host.arrays import Array
    from host.instrument.deviations import SensorErrorModel
    from host.instrument.instrument_errors import InstrumentErrors
    from host.instrument.servo_prior import ServoPrior
    from host.readers.autotune_model import TunedModel
    from host.sysid.checks.data_finding import Finding
    from host.sysid.maneuvers.maneuver_detection import DetectedManeuver
    from host.sysid.reconstruction.flow_angles import FlowAngles
    from host.sysid.reconstruction.reconstruction import Compatibility

# Noise of our IMU's attitude: it takes acceleration for gravity and is 0.7 to 1.1 deg off, for one
# or two seconds. A filter would take it for a sensor without noise, which makes Cm_q of the card
# `demo` 2 % smaller.
OWN_ATTITUDE_RAD = 0.017


@dataclass(frozen=True, slots=True, eq=False)
class ReconstructedFlight:
    """One flight after its reconstruction.

    Attributes
    ----------
    source : str
        What it was read from.
    recorded, corrected : mapping of (n,) Array
        SI columns on an even grid: as decoded, and as perfect sensors at the CG had written them.
    maneuvers : tuple of Found
    compatibility : Compatibility or None
        What was taken out of `corrected`, and what stays open of it.
    delays_open : bool
        Whether delays and places of the sensors are left for a fit to estimate.
    instrument : SensorErrorModel or None
        As it was on this flight: with the servos and the clock of its recording.
    findings : tuple of Finding
        What checks found in its columns.
    resolution : mapping
        Step of the numbers of each quantised column.
    commands : mapping of (n,) Array
        Surfaces that no pot measured, as commanded; their columns are behind usual servos.
    servo : ServoPrior or None
        Prior of the servos of these; None: not to be estimated.
    angles : FlowAngles or None
        Those that no vane measured, reconstructed: for products with airspeed and rates only.
    maker : str
        Who recorded it, as `Recording.maker` says: our logger, an autopilot, or others.
    errors : InstrumentErrors or None
        Errors of its sensors, where a calibration says better than what is usual of the maker's.
    calibration_alone : Compatibility or None
        Check of sensors that came to no agreement: all that their calibration leaves open.
    by_default : Compatibility or None
        Check without an aircraft file: all that is open of sensors of which nothing is known.
    record : tuple of ColumnChange
        What was done to `corrected`, and why.
    tuned : tuple of TunedModel
        What the autopilot's autotune identified in it.
    """

    source: str
    recorded: Mapping[str, Array]
    corrected: Mapping[str, Array]
    maneuvers: tuple[DetectedManeuver, ...]
    compatibility: Compatibility | None
    delays_open: bool
    instrument: SensorErrorModel | None = None
    findings: tuple[Finding, ...] = ()
    resolution: Mapping[str, float] = field(default_factory=dict)
    commands: Mapping[str, Array] = field(default_factory=dict)
    servo: ServoPrior | None = None
    angles: FlowAngles | None = None
    maker: str = OWN
    errors: InstrumentErrors | None = None
    calibration_alone: Compatibility | None = None
    by_default: Compatibility | None = None
    record: Record = ()
    tuned: tuple[TunedModel, ...] = ()

    @property
    def least_noise(self) -> dict[str, float]:
        """Least deviation of the noise of columns whose error lasts from sample to sample.

        It has that of our own instrument where that is known: a delay of the vanes that is
        estimated with the gust depends on pitch, and is lost without it (18 ms found as 0).
        """
        known = self.compatibility is not None and self.compatibility.instrument is not None
        return {"theta_rad": OWN_ATTITUDE_RAD} if known and self.maker == OWN else {}


def reconstruct_flight(
    columns: Mapping[str, Array],
    maneuvers: Sequence[DetectedManeuver],
    *,
    source: str = "",
    airframe: AirframeData | None = None,
    compatibility: Compatibility | None = None,
    by_default: Compatibility | None = None,
    instrument: SensorErrorModel | None = None,
    findings: Sequence[Finding] = (),
    resolution: Mapping[str, float] | None = None,
    maker: str = OWN,
) -> ReconstructedFlight:
    """Return a flight with its columns corrected by all that is known.

    Parameters
    ----------
    columns : mapping of (n,) Array
        SI columns on an even grid, as decoded.
    maneuvers : sequence of Found
    source : str
        What it was read from.
    airframe : AirframeData, optional
        Gives places of the sensors.
    compatibility : Compatibility, optional
        Data-compatibility check; the sensor errors that it estimates are removed.
    by_default : Compatibility, optional
        The same in place of none.
    instrument : SensorErrorModel, optional
        As it was on this flight.
    findings : sequence of Finding
        What checks found in its columns.
    resolution : mapping, optional
        Step of the numbers of each quantised column.
    maker : str
        Who recorded it.
    """
    standing = compatibility or by_default
    sensor_errors = {c.name: c.value for c in corrections(standing)} if standing else {}
    delays_open = True
    if airframe is not None and compatibility is not None and compatibility.instrument is not None:
        at_cg = columns_at_cg(columns, airframe, compatibility)
        delays_open = False
    else:
        at_cg = advance_delayed(columns, sensor_errors)
        if airframe is not None:
            at_cg = transfer_to_cg(at_cg, airframe)
        elif by_default is not None and by_default.instrument is not None:
            at_cg = without_expected_errors(at_cg, by_default.instrument.errors)
    corrected = at_cg
    if standing is not None:
        corrected = correct_columns(at_cg, sensor_errors, pressure_share(standing))
    by = "the aircraft file" if airframe is not None else "what is usual of vanes without a file"
    record = (
        *change_of(columns, at_cg, "as sensors without delay at the CG", by),
        *change_of(at_cg, corrected, "sensor errors removed", "the reconstruction estimates them"),
    )
    return ReconstructedFlight(
        source,
        columns,
        corrected,
        tuple(maneuvers),
        compatibility,
        delays_open,
        instrument,
        tuple(findings),
        resolution or {},
        maker=maker,
        by_default=by_default,
        record=record,
    )


def maneuver_name(item: DetectedManeuver) -> str:
    """Return the name of a maneuver in an answer."""
    if item.given:
        first, last = item.fit_window()
        return f"stretch from {first:.1f} to {last:.1f} s"
    return f"{item.kind} on {item.axis.split('_')[0]} at {item.start_s:.1f} s"

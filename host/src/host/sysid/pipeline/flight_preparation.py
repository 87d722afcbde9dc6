"""The first stages, one flight at a time: maneuvers, checks, reconstruction."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from host.arrays import Array
from host.errors import IdentificationError
from host.instrument.deviations import SensorErrorModel, unknown_sensors
from host.instrument.recording_notes import recording_notes
from host.instrument.servo_prior import servo_prior
from host.physical.calibration import Calibration, load_calibration
from host.sysid.aerodynamics.measured_thrust import with_thrust
from host.sysid.checks.agreement_findings import calibration_findings
from host.sysid.checks.data_finding import Finding
from host.sysid.checks.feedback_findings import feedback_findings
from host.sysid.checks.finding_consequences import blamed
from host.sysid.checks.hidden_angles import no_instrument_errors_finding, no_vanes_finding
from host.sysid.checks.small_inputs import whole_flight
from host.sysid.flight.column_change import change_of
from host.sysid.flight.reconstructed_flight import ReconstructedFlight, reconstruct_flight
from host.sysid.maneuvers.maneuver_detection import DetectedManeuver
from host.sysid.maneuvers.maneuver_selection import overlap_notes, select_maneuvers
from host.sysid.pipeline.flight_at_hand import FlightAtHand
from host.sysid.pipeline.known_aircraft import AircraftData
from host.sysid.pipeline.surface_travel import with_surface_angles
from host.sysid.reconstruction.calibration_consistency import inconsistent_groups, widened_to_flight
from host.sysid.reconstruction.ground_attitude import update_by_standstill
from host.sysid.reconstruction.reconstruction import (
    Compatibility,
    NoAgreementError,
    by_calibration_alone,
    reconstruct,
)
from host.sysid.reconstruction.sensor_corrections import without_estimated_delays
from host.sysid.reconstruction.servo_response import commands_of, surface_positions

if TYPE_CHECKING:
    from host.sysid.reconstruction.flow_angles import FlowAngles


@dataclass(frozen=True, slots=True)
class PreparedFlight:
    """A flight ready for estimation, notes, and its sensors' agreement or why none was sought."""

    flight: ReconstructedFlight
    agreement: Compatibility | None
    notes: tuple[str, ...]
    unchecked: tuple[str, ...] = ()

    @property
    def findings(self) -> tuple[Finding, ...]:
        """What checks found in the columns of the flight."""
        return self.flight.findings


@dataclass(frozen=True, slots=True)
class _Agreement:
    """Reconstruction of a flight, or what calibration alone leaves open of its sensors.

    `sensors` are as wrong as the flight shows, where a file claims less.
    """

    sensors: SensorErrorModel
    found: Compatibility | None = None
    by_calibration: Compatibility | None = None
    findings: tuple[Finding, ...] = ()
    notes: tuple[str, ...] = ()
    unchecked: tuple[str, ...] = ()


def prepare(given: FlightAtHand) -> PreparedFlight:
    """Find the maneuvers of a flight once, and reconstruct it.

    Raises
    ------
    host.errors.HostError
        If what was asked for is not in it.
    """
    read, how, known = given.read, given.how, given.known
    instrument = known.flown(read) if known else None
    sensors = _sensors(given, instrument)
    in_rad, travel = with_surface_angles(read.columns, read.shares, known)
    commands = commands_of(in_rad, sensors)
    columns = surface_positions(in_rad, sensors)
    open_notes = recording_notes(sensors) if instrument is not None or commands else []
    found, small = _maneuvers(given, columns)
    # A law is seen in commands: a servo moves the surface later and slower.
    fed_back = feedback_findings({**columns, **commands}, found)
    agreed = _agreement(given, columns, instrument, sensors)
    sensors = agreed.sensors
    flight = _reconstructed(given, columns, found, agreed)
    corrected = with_thrust(flight.corrected, known.powerplant if known else None)
    angles, line = _hidden_angles(flight.corrected, agreed.found, known)
    reconstructed = agreed.found is not None and known is not None
    findings = [
        *read.findings,
        *small,
        *fed_back,
        *agreed.findings,
        *no_vanes_finding(columns, reconstructed=reconstructed),
    ]
    findings, unused = blamed(findings, how.equations)
    flight = replace(
        flight,
        corrected=corrected,
        findings=tuple(f.accepted_if(how.accept) for f in findings),
        delays_open=flight.delays_open and how.delays,
        commands=commands,
        servo=servo_prior(sensors) if commands and how.delays else None,
        angles=angles,
        errors=sensors.errors,
        calibration_alone=agreed.by_calibration,
        tuned=read.tuned,
        record=(
            *change_of(read.columns, in_rad, "shares of travel made angles", "the aircraft file"),
            *change_of(in_rad, columns, "commands brought behind usual servos", "no pot is there"),
            *flight.record,
            *change_of(flight.corrected, corrected, "thrust added", "measured, or of the power"),
        ),
    )
    given_twice = overlap_notes(how.stretches)
    said = (*read.notes, *travel, *open_notes, *given_twice, *agreed.notes, *line, *unused)
    return PreparedFlight(flight, agreed.found, said, agreed.unchecked)


def _reconstructed(
    given: FlightAtHand,
    columns: Mapping[str, Array],
    maneuvers: Sequence[DetectedManeuver],
    agreed: _Agreement,
) -> ReconstructedFlight:
    """Correct the columns by the aircraft file and what the sensors say, else by calibration."""
    read, known = given.read, given.known
    corrections = agreed.found if given.how.corrections else None
    unplaced = agreed.sensors.recorded(read.recording)
    return reconstruct_flight(
        columns,
        maneuvers,
        source=given.source,
        airframe=known.airframe if known else None,
        # Without sensor positions a vane ahead of the CG looks like a delayed one.
        compatibility=corrections if known else None,
        by_default=None if known else by_calibration_alone(unplaced, corrections),
        instrument=agreed.sensors if known else None,
        resolution=read.resolution,
        maker=read.recording.maker,
    )


def _sensors(given: FlightAtHand, instrument: SensorErrorModel | None) -> SensorErrorModel:
    """Return the instrument of a flight, or what is usual of its maker's; what is known better."""
    sensors = instrument or unknown_sensors(given.read.recording, _calibration(given))
    errors = sensors.errors if given.errors is None else given.errors
    if given.how.equations or not given.how.corrections:  # columns stay as they are
        errors = errors.about_none()
    return replace(sensors, errors=errors)


def _calibration(given: FlightAtHand) -> Calibration | None:
    """Return the calibration that a user gave, else the one that made the columns."""
    calibration = given.how.calibration
    return load_calibration(calibration) if calibration is not None else given.read.calibration


def _maneuvers(
    given: FlightAtHand, columns: Mapping[str, Array]
) -> tuple[Sequence[DetectedManeuver], Sequence[Finding]]:
    """Return the maneuvers given or found; without any the whole flight, and why."""
    found: Sequence[DetectedManeuver]
    if given.windows is not None:
        found = given.windows
    else:
        how = given.how
        found = select_maneuvers(columns, stretches=how.stretches, numbers=how.maneuvers)
    return (found, ()) if found else whole_flight(columns)


def _agreement(
    given: FlightAtHand,
    columns: Mapping[str, Array],
    instrument: SensorErrorModel | None,
    sensors: SensorErrorModel,
) -> _Agreement:
    """Compare the sensors of a flight with each other."""
    known, how = given.known, given.how
    airframe = known.airframe if known else None
    notes: tuple[str, ...] = ()
    findings: list[Finding] = []
    try:
        found = reconstruct(columns, airframe, instrument, sensors)
        # What is usual of sensors that nobody calibrated is no claim.
        claims = instrument, _calibration(given), given.errors
        if any(c is not None for c in claims) and inconsistent_groups(found.calibration_tests):
            tests, findings = found.calibration_tests, calibration_findings(found)
            sensors = widened_to_flight(sensors, tests)
            instrument = sensors if known else None
            found = reconstruct(columns, airframe, instrument, sensors)
            found = replace(found, calibration_tests=tests)
    except NoAgreementError as error:
        alone = by_calibration_alone(instrument) if instrument and how.corrections else None
        return _Agreement(sensors, None, alone, tuple(findings), unchecked=(str(error),))
    except IdentificationError as error:
        unknown = (no_instrument_errors_finding(columns),) if given.read.shares else ()
        return _Agreement(sensors, findings=unknown, unchecked=(str(error),))
    found = found if how.delays else without_estimated_delays(found)
    if known is not None:
        found, notes = update_by_standstill(found, columns, known.airframe)
    return _Agreement(sensors, found, None, tuple(findings), notes)


def _hidden_angles(
    corrected: Mapping[str, Array], agreement: Compatibility | None, known: AircraftData | None
) -> tuple[FlowAngles | None, tuple[str, ...]]:
    """Return the flow angles that no vane measured, as far as estimated, and a line of them."""
    if agreement is None or agreement.vanes or known is None:
        return None, ()
    from host.sysid.reconstruction.flow_angles import reconstruct_flow_angles

    try:
        angles = reconstruct_flow_angles(corrected, agreement, known.airframe)
    except IdentificationError as error:
        return None, (str(error),)
    return angles, (angles.line(),)


def distinct_flights(flights: Sequence[ReconstructedFlight]) -> list[ReconstructedFlight]:
    """Return the flights if all differ: the same samples counted twice would halve a variance.

    Raises
    ------
    IdentificationError
        If two are the same.
    """
    for number, one in enumerate(flights, start=1):
        for before, other in enumerate(flights[: number - 1], start=1):
            if one.recorded.keys() == other.recorded.keys() and all(
                np.array_equal(values, other.recorded[name], equal_nan=True)
                for name, values in one.recorded.items()
            ):
                raise IdentificationError(
                    f"flights {before} and {number} are the same samples ({other.source},"
                    f" {one.source}); give each flight once, or with stretches each time"
                )
    return list(flights)


def collected_notes(
    flights: Sequence[PreparedFlight], doubts: Collection[str], *, unchecked: bool = True
) -> list[str]:
    """Return all notes; with several flights each begins with the source of its flight.

    Why sensors were not held against each other is no reason for a refusal: left out with
    `unchecked` false.
    """
    named = len(flights) > 1
    own = [
        f"{f.flight.source}: {note}" if named else note
        for f in flights
        for note in (*f.notes, *(f.unchecked if unchecked else ()))
    ]
    return [*own, *doubts]


def collected_findings(flights: Sequence[PreparedFlight]) -> tuple[Finding, ...]:
    """Return all findings; with several flights each names the source of its flight."""
    if len(flights) == 1:
        return flights[0].findings
    return tuple(replace(x, flight=f.flight.source) for f in flights for x in f.findings)

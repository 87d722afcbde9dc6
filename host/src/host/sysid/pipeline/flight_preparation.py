"""The first stages, one flight at a time: maneuvers, checks, reconstruction."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np

from host.errors import IdentificationError
from host.instrument.deviations import unknown_sensors
from host.instrument.error_labels import recording_notes
from host.instrument.servo_prior import servo_prior
from host.physical.calibration import load_calibration
from host.sysid.checks.agreement_findings import calibration_findings, disagreement
from host.sysid.checks.airspeed_scale import airspeed_scale_findings
from host.sysid.checks.data_finding import Finding
from host.sysid.checks.feedback_findings import feedback_findings
from host.sysid.checks.hidden_angles import no_instrument_errors_finding, no_vanes_finding
from host.sysid.checks.small_inputs import whole_flight
from host.sysid.flight.reconstructed_flight import ReconstructedFlight, reconstruct_flight
from host.sysid.maneuvers.maneuver_detection import DetectedManeuver
from host.sysid.maneuvers.maneuver_selection import overlap_notes, select_maneuvers
from host.sysid.pipeline.flight_at_hand import FlightAtHand
from host.sysid.pipeline.surface_travel import with_surface_angles
from host.sysid.reconstruction.flow_angles import reconstruct_flow_angles
from host.sysid.reconstruction.ground_attitude import update_by_standstill
from host.sysid.reconstruction.reconstruction import (
    Compatibility,
    NoAgreementError,
    by_calibration_alone,
    reconstruct,
)
from host.sysid.reconstruction.sensor_corrections import without_estimated_delays
from host.sysid.reconstruction.servo_response import commands_of, surface_positions


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


def prepare(given: FlightAtHand) -> PreparedFlight:
    """Find the maneuvers of a flight once, and reconstruct it.

    Raises
    ------
    host.errors.HostError
        If what was asked for is not in it.
    """
    read, how, known = given.read, given.how, given.known
    columns, travel = with_surface_angles(read.columns, read.shares, known)
    notes, findings = [*read.notes, *travel], [*read.findings]
    instrument = known.flown(read) if known else None
    better = load_calibration(how.calibration) if how.calibration is not None else None
    sensors = instrument or unknown_sensors(read.recording, better)
    if given.errors is not None:
        sensors = replace(sensors, errors=given.errors)
    commands = commands_of(columns, sensors)
    columns = surface_positions(columns, sensors)
    if instrument is not None or commands:
        notes += recording_notes(sensors)
    found: Sequence[DetectedManeuver]
    if given.windows is None:
        found = select_maneuvers(columns, stretches=how.stretches, numbers=how.maneuvers)
    else:
        found = given.windows
    notes += overlap_notes(how.stretches)
    if not found:
        found, small = whole_flight(columns)
        findings += small
    # A law is seen in commands: a servo moves the surface later and slower.
    findings += feedback_findings({**columns, **commands}, found)
    agreement = calibration_alone = None
    unchecked: tuple[str, ...] = ()
    try:
        agreement = reconstruct(columns, known.airframe if known else None, instrument, sensors)
        agreement = agreement if how.delays else without_estimated_delays(agreement)
        if known is not None:
            agreement, standing = update_by_standstill(agreement, columns, known.airframe)
            notes += standing
        findings += calibration_findings(agreement)
    except NoAgreementError as error:
        findings.append(disagreement(error, columns))
        if instrument is not None and how.corrections:
            calibration_alone = by_calibration_alone(instrument)
    except IdentificationError as error:
        unchecked = (str(error),)
        findings += [no_instrument_errors_finding(columns)] if read.shares else []
    reconstructed = agreement is not None and known is not None
    findings += no_vanes_finding(columns, reconstructed=reconstructed)
    flight = reconstruct_flight(
        columns,
        found,
        source=given.source,
        airframe=known.airframe if known else None,
        # Without sensor positions a vane ahead of the CG looks like a delayed one.
        compatibility=agreement if known is not None and how.corrections else None,
        instrument=instrument,
        resolution=read.resolution,
        maker=read.recording.maker,
    )
    if instrument is not None:
        findings += airspeed_scale_findings(flight.corrected, instrument)
    angles = None
    if agreement is not None and not agreement.vanes and known is not None:
        try:
            angles = reconstruct_flow_angles(flight.corrected, agreement, known.airframe)
            notes.append(angles.line())
        except IdentificationError as error:
            notes.append(str(error))
    findings = [f.accept() if f.check in how.accept and not f.accepted else f for f in findings]
    flight = replace(
        flight,
        findings=tuple(findings),
        delays_open=flight.delays_open and how.delays,
        commands=commands,
        servo=servo_prior(sensors) if commands and how.delays else None,
        angles=angles,
        errors=sensors.errors,
        calibration_alone=calibration_alone,
    )
    return PreparedFlight(flight, agreement, tuple(notes), unchecked)


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

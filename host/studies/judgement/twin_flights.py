"""Flights of the twin through the recorder, analysed with a file and without one."""

from __future__ import annotations

import functools
import tempfile
from dataclasses import replace
from pathlib import Path

from host.aircraft.file import load_measured
from host.export.toml import dumps
from host.instrument.instrument_errors import (
    InstrumentErrors,
    errors_without_file,
    instrument_errors,
    standard_errors,
)
from host.physical.calibration import load_calibration
from host.physical.recording import OWN
from host.readers.even_grid import even_columns
from host.sysid.pipeline import Identification, at_hand, identify_columns
from host.twin.flight.fly import fly
from host.twin.outcome.autopilot_logs import write_autopilot_log
from host.twin.outcome.truth_files import maneuvers
from host.twin.sensors.local_flow import air_data
from host.twin.testcard.cards import load
from host.twin.virtual import VirtualFlight, virtual_flight

import host
from studies.judgement.judged_rows import Flown, Truth
from studies.no_vanes import of_an_autopilot

CARD, AIRCRAFT = "demo", "ultrastick25e"
DIRECT = "coefficients"


def with_file(seed: int, models: str | None = None) -> Flown:
    """Return a flight with the tolerances that its aircraft file and its calibration state."""
    return _flown(_calibrated(seed), AIRCRAFT, models)


def without_file(seed: int) -> Flown:
    """Return a flight of an instrument out of the box, of which nothing is known."""
    errors = zeroed_pitots(errors_without_file(OWN))
    return _flown(virtual_flight(CARD, seed, errors=out_of_the_box()), None, known=errors)


def calibrated_without_file(seed: int) -> Flown:
    """Return the same flight as README's line takes it: calibrated, and no aircraft file."""
    return _flown(_calibrated(seed), None)


def imported(seed: int) -> Flown:
    """Return a flight as a PX4 plane logs it, without vanes, with an aircraft file."""
    card = load(CARD)
    card = replace(card, sensors=replace(card.sensors, servo_tolerance=True))
    record = fly(card, seed=seed, errors=of_an_autopilot())
    data = air_data(record)
    truth: Truth = {"first_row_s": 0.0, "maneuver": maneuvers(record, data)}

    def identify() -> Identification:
        with tempfile.TemporaryDirectory() as folder:
            stem, true = Path(folder) / "flight", Path(folder) / "truth.toml"
            path = write_autopilot_log("ulog", record, data, stem, airframe="conventional")
            true.write_text(dumps(truth), encoding="utf-8")
            return host.identify(path, aircraft=AIRCRAFT, truth=true)

    return Flown(truth, identify)


@functools.lru_cache(maxsize=1)
def _calibrated(seed: int) -> VirtualFlight:
    return virtual_flight(CARD, seed)


@functools.lru_cache(maxsize=1)
def out_of_the_box() -> InstrumentErrors:
    """Return the errors of the default calibration, pitots zeroed at rest.

    One that is not is off by 250 Pa, more than the dynamic pressure: no airspeed is measured then.
    """
    return zeroed_pitots(
        instrument_errors(load_measured(AIRCRAFT), load_calibration(), defaults=True)
    )


def zeroed_pitots(errors: InstrumentErrors) -> InstrumentErrors:
    """Return errors of an instrument whose pitots were zeroed at rest."""
    return InstrumentErrors({**errors.named, "pitot_zero_pa": standard_errors()["pitot_zero_pa"]})


def _flown(
    flight: VirtualFlight,
    aircraft: str | None,
    models: str | None = None,
    known: InstrumentErrors | None = None,
) -> Flown:
    truth: Truth = {"first_row_s": 0.0, "maneuver": list(flight.maneuvers)}
    columns, _notes = even_columns(flight.table)

    def identify() -> Identification:
        flight = at_hand(columns, aircraft=aircraft, errors=known)
        return identify_columns(flight, models=models, truth=truth)

    return Flown(truth, identify)

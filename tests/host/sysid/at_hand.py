"""Answers of the one door to columns that a test has at hand."""

from collections.abc import Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import replace
from unittest.mock import patch

import numpy as np
from host.aircraft.mass_properties import AirframeData
from host.aircraft.powerplant import Powerplant
from host.instrument.deviations import SensorErrorModel
from host.instrument.instrument_errors import InstrumentErrors
from host.physical.recording import OWN, Recording
from host.sysid.coefficients import CoefficientAnswer
from host.sysid.linear import Answer
from host.sysid.maneuvers import DetectedManeuver
from host.sysid.models import LinearModel
from host.sysid.pipeline import aircraft_data, at_hand, flight_preparation, identify_columns
from host.sysid.reconstruction import Compatibility

KNOWN = aircraft_data("ultrastick25e")


def identify(
    columns: Mapping[str, np.ndarray],
    *,
    names: Sequence[str] = (),
    method: str | None = None,
    airframe: AirframeData | None = None,
    powerplant: Powerplant | None = KNOWN.powerplant,
    compatibility: Compatibility | None = None,
    windows: Sequence[DetectedManeuver] | None = None,
    user_model: LinearModel | None = None,
    with_delays: bool = True,
    maker: str = OWN,
    errors: InstrumentErrors | None = None,
) -> list[Answer]:
    """Return the linear answers of `identify_columns`.

    Sensors are corrected only by `compatibility`, which stands for what reconstruction finds.
    """
    known = None
    if airframe is not None:
        known = replace(KNOWN, airframe=airframe, powerplant=powerplant)
    flight = at_hand(
        columns,
        aircraft=known,
        recording=Recording(maker=maker),
        windows=windows,
        errors=errors,
        corrections=compatibility is not None,
        delays=with_delays,
    )
    models = names if user_model is None else [user_model]
    stands_in: AbstractContextManager[object] = nullcontext()
    if compatibility is not None:
        stands_in = patch.object(flight_preparation, "reconstruct", return_value=compatibility)
    with stands_in:
        return list(identify_columns(flight, models=models, methods=method).linear)


def identify_coefficients(
    columns: Mapping[str, np.ndarray],
    aircraft: str,
    *,
    instrument: SensorErrorModel | None = None,
    windows: Sequence[DetectedManeuver] | None = None,
) -> CoefficientAnswer:
    """Return the coefficients that `identify_columns` fits directly."""
    known = aircraft_data(aircraft)
    recording = Recording()
    if instrument is not None:
        known, recording = replace(known, instrument=instrument), instrument.recording
    flight = at_hand(columns, aircraft=known, recording=recording, windows=windows)
    found = identify_columns(flight, models="coefficients").coefficients
    assert found is not None
    return found

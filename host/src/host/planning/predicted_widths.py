"""Half-widths that identification will state of a card: fly it some times, and identify.

Bounds of white noise in calm air promise 0.0 %. What a flight tells is limited by gusts, by
residuals with a memory and by the tolerances of instrument and aircraft; all of them are in the
answer of a virtual flight that has them, so the card is flown and identified as a real one
would be (Monte Carlo).
"""

from __future__ import annotations

import statistics
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd

from host.arrays import Array
from host.constants import NORMAL_95
from host.errors import IdentificationError
from host.instrument.deviations import SensorErrorModel, sensor_error_model
from host.readers.even_grid import even_arrays
from host.readers.foreign_tables import from_frame
from host.readers.recorded import recording_of_table
from host.sysid.coefficients import CoefficientFit
from host.sysid.coefficients.coefficient_intervals import CoefficientIntervals
from host.sysid.linear import Answer
from host.sysid.models.parameter_units import parameter_unit
from host.sysid.pipeline import identify
from host.twin.testcard.cards import Card
from host.twin.virtual import virtual_flight

FIRST_SEED = 970_001  # far from those that people fly
FLIGHTS = 3
LIGHT_GUSTS_MPS = 0.3  # of a card that names none: a calm morning

Progress = Callable[[float], None]
WidthsOf = Callable[[pd.DataFrame, str], "dict[str, FlightWidth]"]


@dataclass(frozen=True, slots=True)
class PredictedWidth:
    """The interval of one derivative that flights of a card will give.

    Attributes
    ----------
    name, unit : str
    value, half_width : float
        Medians over the flights that had it; 95 % interval, systematic errors in it.
    noise_share : float
        Median share of noise and gusts in the variance. The rest are tolerances of instrument and
        aircraft, which no flight makes smaller.
    flights : int
        Those flights.
    """

    name: str
    unit: str
    value: float
    half_width: float
    noise_share: float
    flights: int

    @property
    def percent(self) -> float:
        """Half-width in per cent of the value; infinite at zero."""
        return abs(100.0 * self.half_width / self.value) if self.value else float("inf")


@dataclass(frozen=True, slots=True)
class Prediction:
    """Predicted half-widths of a card.

    Attributes
    ----------
    gusts_mps : float
        Standard deviation of the vertical gust they were flown in.
    widths : tuple of PredictedWidth
    failures : tuple of str
        Why a flight gave no answer.
    """

    gusts_mps: float
    widths: tuple[PredictedWidth, ...]
    failures: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class FlightWidth:
    """The interval of one derivative from one flight."""

    unit: str
    value: float
    half_width: float
    noise_share: float


def predict_widths(
    card: Card,
    gusts_mps: float | None = None,
    *,
    flights: int = FLIGHTS,
    first_seed: int = FIRST_SEED,
    chain: str = "gps",
    widths_of: WidthsOf | None = None,
    progress: Progress | None = None,
) -> Prediction:
    """Fly a card virtually and say what identification will state.

    Parameters
    ----------
    card : Card
        With its pilot; sensors have all their tolerances.
    gusts_mps : float, optional
        Standard deviation of the vertical gust; the card's, or `LIGHT_GUSTS_MPS`.
    flights : int
    first_seed : int
    chain : str
        As `virtual_flight` takes it: ``sitl`` is the recorder, ``gps`` needs no compiler.
    widths_of : callable, optional
        Returns the intervals of one flight's table and an aircraft (name or file); without:
        `linear_widths`.
    progress : callable, optional
        Called with the share that is done.

    Returns
    -------
    Prediction

    Raises
    ------
    CardError, AircraftError, TrimError
        The card cannot be flown.
    """
    gusts = gusts_mps if gusts_mps is not None else card.air.turbulence_mps or LIGHT_GUSTS_MPS
    windy = replace(card, air=replace(card.air, turbulence_mps=gusts), faults=())
    found: dict[str, list[FlightWidth]] = {}
    failures: list[str] = []
    for number in range(flights):
        flight = virtual_flight(windy, first_seed + number, chain=chain)
        try:
            rows = (widths_of or linear_widths)(flight.table, windy.aircraft)
        except IdentificationError as error:
            failures.append(str(error))
            rows = {}
        for name, row in rows.items():
            found.setdefault(name, []).append(row)
        if progress is not None:
            progress((number + 1) / flights)
    widths = [
        PredictedWidth(
            name,
            each[0].unit,
            statistics.median(row.value for row in each),
            statistics.median(row.half_width for row in each),
            statistics.median(row.noise_share for row in each),
            len(each),
        )
        for name, each in found.items()
    ]
    return Prediction(gusts, tuple(widths), tuple(dict.fromkeys(failures)))


def linear_widths(table: pd.DataFrame, aircraft: str) -> dict[str, FlightWidth]:
    """Return the intervals of the default linear method for one flight, as of `host identify`.

    With GPS, as every log has it: without, vanes' delays stay as open as their calibration left
    them and the clock's scale too, and M_q of the demo card is promised to 14 % in place of 9.

    Raises
    ------
    IdentificationError
        It tells nothing.
    """
    answers = identify(table, aircraft=aircraft).linear
    return {name: row for answer in answers for name, row in _rows(answer).items()}


def coefficient_widths(fit: CoefficientFit | CoefficientIntervals) -> dict[str, FlightWidth]:
    """Return every coefficient of a fit, and how much of its variance more data take away."""
    found = {}
    count = len(fit.derivatives)
    errors = fit.covariance[count:, count:]
    for k, d in enumerate(fit.derivatives):
        by_errors = fit.covariance[k, count:]
        systematic = float(by_errors @ np.linalg.lstsq(errors, by_errors, rcond=None)[0])
        noise = 1.0 - systematic / max(float(fit.covariance[k, k]), 1e-300)
        found[d.name] = FlightWidth("1", d.value, d.half_width, max(noise, 0.0))
    return found


def flown_columns(table: pd.DataFrame, aircraft: str) -> tuple[dict[str, Array], SensorErrorModel]:
    """Return the table of a virtual flight on an even grid, and the errors of who recorded it."""
    found = from_frame(table)
    columns, _ = even_arrays(found.columns)
    recording = recording_of_table(found.columns, {})
    return columns, sensor_error_model(aircraft).recorded(recording)


def _rows(answer: Answer) -> dict[str, FlightWidth]:
    """Return every derivative and coefficient of an answer."""
    result, rows = answer.result, {}
    halves, variances = result.half_width(), result.standard_error**2
    noise = variances if answer.noise_covariance is None else np.diag(answer.noise_covariance)
    for name in (p.name for p in answer.model.parameters if p.name in result.names):
        k = result.index(name)
        share = float(noise[k] / variances[k]) if variances[k] > 0.0 else 1.0
        unit = parameter_unit(answer.model, name)
        rows[name] = FlightWidth(unit, result.value(name), float(halves[k]), share)
    for one in answer.coefficients:
        share = (NORMAL_95 * one.fit_error / one.half_width) ** 2 if one.half_width > 0.0 else 1.0
        rows[one.name] = FlightWidth("1", one.value, one.half_width, share)
    return rows

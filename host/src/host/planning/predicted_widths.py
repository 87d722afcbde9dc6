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

from host.aircraft.mass_properties import airframe_data
from host.aircraft.powerplant import powerplant
from host.instrument.deviations import sensor_error_model
from host.sysid.answer.parameter_units import parameter_unit
from host.sysid.compatibility.reconstruction import reconstruct
from host.sysid.flight.even_grid import even_columns
from host.sysid.flight.linear_answer import Answer
from host.sysid.flight.linear_estimator import identify
from host.sysid.identification_error import IdentificationError
from host.twin.testcard.cards import Card
from host.twin.virtual import virtual_flight

FIRST_SEED = 970_001  # far from those that people fly
FLIGHTS = 3
LIGHT_GUSTS_MPS = 0.3  # of a card that names none: a calm morning

Progress = Callable[[float], None]


@dataclass(frozen=True, slots=True)
class PredictedWidth:
    """What flights of a card will tell of one derivative.

    Attributes
    ----------
    name, unit : str
    value, half_width : float
        Medians over the flights that had it; 95 % interval, systematic errors in it.
    flights : int
        Those flights.
    """

    name: str
    unit: str
    value: float
    half_width: float
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


def predict_widths(
    card: Card,
    gusts_mps: float | None = None,
    *,
    flights: int = FLIGHTS,
    first_seed: int = FIRST_SEED,
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
    told: dict[str, list[tuple[str, float, float]]] = {}
    failures: list[str] = []
    for number in range(flights):
        try:
            answers = _identified(windy, first_seed + number)
        except IdentificationError as error:
            failures.append(str(error))
            answers = []
        for answer in answers:
            for name, row in _rows(answer).items():
                told.setdefault(name, []).append(row)
        if progress is not None:
            progress((number + 1) / flights)
    widths = [
        PredictedWidth(
            name,
            rows[0][0],
            statistics.median(value for _, value, _ in rows),
            statistics.median(half for _, _, half in rows),
            len(rows),
        )
        for name, rows in told.items()
    ]
    return Prediction(gusts, tuple(widths), tuple(dict.fromkeys(failures)))


def _identified(card: Card, seed: int) -> list[Answer]:
    """Return the linear answers of one flight, as `host identify` gives them."""
    columns, _ = even_columns(virtual_flight(card, seed, chain="none").table)
    airframe = airframe_data(card.aircraft)
    return identify(
        columns,
        airframe=airframe,
        compatibility=reconstruct(columns, airframe, sensor_error_model(card.aircraft)),
        powerplant=powerplant(card.aircraft),
    )


def _rows(answer: Answer) -> dict[str, tuple[str, float, float]]:
    """Return unit, value and half-width of every derivative and coefficient."""
    result = answer.result
    halves = result.half_width()
    rows = {}
    for name in (p.name for p in answer.model.parameters if p.name in result.names):
        half = float(halves[result.index(name)])
        rows[name] = parameter_unit(answer.model, name), result.value(name), half
    return rows | {c.name: ("1", c.value, c.half_width) for c in answer.coefficients}

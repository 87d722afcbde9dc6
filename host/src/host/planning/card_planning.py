"""Test points before they are flown: excursions of the aircraft and bounds of its derivatives.

Excursions come from flying the nominal aircraft in calm air with exact inputs. Bounds are
Cramer-Rao bounds of the whole card: sensitivities of output error on that flight and the sensors'
white noise, all longitudinal test points together, all lateral ones together.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd

from host.aircraft.airframe import Array
from host.aircraft.attitude import euler
from host.aircraft.file import Aircraft
from host.constants import GRAVITY_MPS2, NORMAL_95
from host.errors import IdentificationError
from host.sysid.estimators.start_values import start_values
from host.sysid.models import LinearModel, Maneuver
from host.sysid.models import Trim as Condition
from host.sysid.models.templates import lateral, longitudinal
from host.sysid.numerics import OutputProblem, covariance_of_free, minimise
from host.twin.flight.fly import FlightRecord, fly
from host.twin.flight.pilot import Window
from host.twin.outcome.ideal import true_table
from host.twin.sensors.local_flow import AirData, air_data
from host.twin.testcard.cards import Card, Pilot, Segment, Sensors, turns_home

# White noise of each output at 100 Hz: two vanes and two pitots averaged, four conversions each,
# MPU-6000 behind its filter; attitude as good as a filter makes it over one maneuver.
NOISE = {
    "airspeed_mps": 0.06,
    "alpha_rad": 0.0008,
    "beta_rad": 0.0008,
    "p_radps": 0.0008,
    "q_radps": 0.0008,
    "r_radps": 0.0008,
    "phi_rad": 0.003,
    "theta_rad": 0.003,
    "ax_mps2": 0.035,
    "ay_mps2": 0.035,
    "az_mps2": 0.035,
}
LONGITUDINAL_SHOWN = ("Z_alpha", "Z_de", "M_alpha", "M_q", "M_de", "D_V", "D_alpha")
LATERAL_SHOWN = (
    "Y_beta", "Y_dr", "L_beta", "L_p", "L_r", "L_da", "L_dr", "N_beta", "N_p", "N_r", "N_da",
    "N_dr",
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class Point:
    """One test point of a card, and the largest changes from trim to expect of it.

    Attributes
    ----------
    kind : str
        Input, as test cards name it.
    axes : tuple of str
    amplitudes : tuple of float
        One per axis, deg.
    width_s, duration_s : float
        Length of a step of the input, and of the test point.
    airspeed_mps, alpha_deg, beta_deg, bank_deg, pitch_deg : float
    roll_rate_degps, pitch_rate_degps, yaw_rate_degps : float
    load_factor : tuple of float
        Least and largest.
    """

    kind: str
    axes: tuple[str, ...]
    amplitudes: tuple[float, ...]
    width_s: float
    duration_s: float
    airspeed_mps: float
    alpha_deg: float
    beta_deg: float
    roll_rate_degps: float
    pitch_rate_degps: float
    yaw_rate_degps: float
    bank_deg: float
    pitch_deg: float
    load_factor: tuple[float, float]


@dataclass(frozen=True, slots=True)
class Bound:
    """Predicted value of a derivative and its 95 % half-width from the whole card.

    Attributes
    ----------
    name : str
    value, half_width : float
        In the units of the linear model.
    """

    name: str
    value: float
    half_width: float

    @property
    def percent(self) -> float:
        """Half-width in per cent of the value; infinite at zero."""
        return abs(100.0 * self.half_width / self.value) if self.value else math.inf


@dataclass(frozen=True, slots=True)
class Plan:
    """A judged card.

    Attributes
    ----------
    card, aircraft : Card, Aircraft
    points : list of Point
    bounds : list of Bound
    refused : list of str
        Why an axis has no bounds.
    """

    card: Card
    aircraft: Aircraft
    points: list[Point]
    bounds: list[Bound]
    refused: list[str]


def exact(card: Card) -> Card:
    """Return the card in calm air, without turns home, exact inputs, no faults, at 25 Hz or more.

    Parameters
    ----------
    card : Card
    """
    calm = replace(card.air, wind_north_mps=0.0, wind_east_mps=0.0, turbulence_mps=0.0)
    pilot = Pilot(
        timing_s=0.0, amplitude=0.0, drift=0.0, remnant=0.0, early=0.0,
        hands_off_s=card.pilot.hands_off_s,
    )  # fmt: skip
    rate = max(card.flight.rate_hz, 25.0)
    return replace(
        card, air=calm, pilot=pilot, sensors=Sensors(tolerances=False), faults=(),
        flight=replace(card.flight, rate_hz=rate),
        segments=tuple(s for s in card.segments if not turns_home(s)),
    )  # fmt: skip


def judge(card: Card) -> Plan:
    """Fly a card ideally and predict the bounds of its derivatives.

    Parameters
    ----------
    card : Card

    Returns
    -------
    Plan

    Raises
    ------
    CardError, AircraftError, TrimError
        The card cannot be flown.
    """
    record = fly(exact(card))
    segments = [s for s in card.segments if s.kind not in ("trim", "turn")]
    windows = record.schedule.windows
    data = air_data(record)
    points = [point_of(record, data, s, w) for s, w in zip(segments, windows, strict=True)]
    table = true_table(record, data)
    _, theta, _ = euler(record.trim.state[6:10])
    condition = Condition(record.trim.airspeed_mps, record.trim.alpha_rad, float(theta))
    bounds: list[Bound] = []
    refused: list[str] = []
    flown = {axis for s in segments for axis in s.axes}
    for axes, shown, name in (
        (("elevator",), LONGITUDINAL_SHOWN, "longitudinal"),
        (("aileron", "rudder"), LATERAL_SHOWN, "lateral"),
    ):
        missing = [axis for axis in axes if axis not in flown]
        if missing:
            refused.append(
                f"{name}: no input on {', '.join(missing)}, its derivatives stay unknown"
            )
            continue
        model = longitudinal(condition) if name == "longitudinal" else lateral(condition)
        chosen = [
            (w, times) for w, times in _distinct(segments, windows) if set(w.axes) & set(axes)
        ]
        try:
            bounds += _bounds(model, table, chosen, shown)
        except IdentificationError as error:
            refused.append(f"{name}: {error}")
    return Plan(card, record.aircraft, points, bounds, refused)


def _bounds(
    model: LinearModel,
    table: pd.DataFrame,
    windows: list[tuple[Window, int]],
    shown: tuple[str, ...],
) -> list[Bound]:
    """Return bounds from the information of the windows, a repeated one as often as it is flown.

    Raises
    ------
    IdentificationError
        The model's response grows without bound, or the fit fails.
    """
    cuts = [
        Maneuver.from_table(table, model, from_s=w.start_s - 0.3, to_s=w.end_s) for w, _ in windows
    ]
    problem = OutputProblem(model, cuts)
    variance = np.array([NOISE[name] ** 2 for name in model.outputs])
    best = minimise(problem, start_values(problem), variance=variance)
    responses = problem.respond(best.theta)
    if responses is None:
        raise IdentificationError("the prior model's response grows without bound")
    size = len(problem.names)
    information = np.diag(problem.prior_precision)
    for k, (response, (_, times)) in enumerate(zip(responses, windows, strict=True)):
        place = problem.columns(k)
        part = np.einsum(
            "jta,j,jtb->ab", response.sensitivities, 1.0 / variance, response.sensitivities
        )
        information[np.ix_(place, place)] += times * part
    covariance = covariance_of_free(information, np.ones(size, dtype=np.bool_))
    sigma = np.sqrt(np.diag(covariance))
    return [
        Bound(name, float(best.theta[k]), float(NORMAL_95 * sigma[k]))
        for k, name in enumerate(problem.names)
        if name in shown
    ]


def _distinct(segments: list[Segment], windows: list[Window]) -> list[tuple[Window, int]]:
    """Return one window of each different input and how often the card has it."""
    found: dict[Segment, tuple[Window, int]] = {}
    for s, w in zip(segments, windows, strict=True):
        first, times = found.get(s, (w, 0))
        found[s] = (first, times + 1)
    return list(found.values())


def point_of(record: FlightRecord, data: AirData, s: Segment, w: Window) -> Point:
    """Return a test point with its excursions on a flight.

    Parameters
    ----------
    record : FlightRecord
    data : AirData
        Air data of the record.
    s, w : Segment, Window
        What was asked for, and when it was flown.
    """
    inside = (record.t_s >= w.start_s) & (record.t_s < w.end_s)
    first = int(np.argmax(inside))

    def largest(x: Array) -> float:
        return float(np.abs(x[inside] - x[first]).max())

    phi, theta, _ = euler(record.states[:, 6:10])
    load = -record.specific_force_mps2[inside, 2] / GRAVITY_MPS2
    return Point(
        kind=s.kind,
        axes=s.axes,
        amplitudes=s.amplitudes,
        width_s=s.width_s,
        duration_s=w.end_s - w.start_s,
        airspeed_mps=largest(data.airspeed_mps),
        alpha_deg=math.degrees(largest(data.alpha_rad)),
        beta_deg=math.degrees(largest(data.beta_rad)),
        roll_rate_degps=math.degrees(largest(record.states[:, 3])),
        pitch_rate_degps=math.degrees(largest(record.states[:, 4])),
        yaw_rate_degps=math.degrees(largest(record.states[:, 5])),
        bank_deg=math.degrees(largest(phi)),
        pitch_deg=math.degrees(largest(theta)),
        load_factor=(float(load.min()), float(load.max())),
    )

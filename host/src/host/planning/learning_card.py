"""What the logger is given to learn an axis in flight: gains, delays, what stays unknown.

The logger's sums are of raw counts. What a ratio of counts is worth, how late each sensor is and
how far the instrument may be wrong is reckoned here, before the flight, for one airspeed.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from host.aircraft.air import atmosphere, density_kgpm3
from host.aircraft.file import load
from host.aircraft.linearisation import linearise
from host.aircraft.mass_properties import AirframeData, airframe_data
from host.aircraft.trim import solve
from host.arrays import Array
from host.constants import NORMAL_95
from host.instrument.deviations import SensorErrorModel, deviations, sensor_error_model
from host.physical.calibration import Calibration, load_calibration
from host.physical.channels import constant_delay_us
from host.planning.onboard_sums import (
    PITCH,
    ROLL,
    SAMPLE_HZ,
    SIGNALS,
    TURN_STEPS,
    YAW,
    AxisCard,
)
from host.planning.wanted_widths import OTHERS_PERCENT, WANTED_PERCENT
from host.twin.testcard.cards import Card
from host.wire.schema_text import packed_schema

# Evenly over the band that a 3-2-1-1 or a multisine of a small aircraft fills, 0.3 to 3.8 Hz.
TEN_HARMONICS = (3, 7, 11, 15, 19, 23, 27, 31, 35, 39)
SIX_HARMONICS = (4, 9, 14, 19, 24, 29)
NAMES: Mapping[str, tuple[str, ...]] = {
    axis: tuple(f"{row}_{signal}" for signal in SIGNALS[axis])
    for axis, row in ((PITCH, "Cm"), ("roll", "Cl"), (YAW, "Cn"))
}
TURNS = {"elevator": PITCH, "aileron": ROLL, "rudder": YAW}  # a surface and what it moves
DLPF_100_HZ = 3
PACKET_AGE_S = 0.5e-3  # of a sample of our own IMU firmware at the scan
# How far a pilot's airspeed is from the card's, and how far the friction's part of a delay.
SPEED_SHARE, FRICTION_SHARE = 0.015, 0.5
DENSITY_SHARE = 0.01
_POTS = {
    "de": (("pot_elevator", 1.0),),
    "da": (("pot_aileron_left", 0.5), ("pot_aileron_right", -0.5)),
    "dr": (("pot_rudder", 1.0),),
}


@dataclass(frozen=True, slots=True)
class LearningCondition:
    """Where and how an axis is flown.

    Attributes
    ----------
    airspeed_mps, density_kgpm3 : float
    harmonics : tuple of int
        Times 50/512 Hz.
    angle_rate_radps : float
        Rms of the angle's rate while the input is flown: dry friction of the vane is a delay in
        inverse proportion to it. 0: no friction.
    """

    airspeed_mps: float
    density_kgpm3: float = 1.225
    harmonics: tuple[int, ...] = TEN_HARMONICS
    angle_rate_radps: float = 0.2


def learning_card(
    aircraft: str, axis: str, at: LearningCondition, calibration: Calibration | None = None
) -> AxisCard:
    """Return the card with which the logger learns one axis.

    Parameters
    ----------
    aircraft : str
        Name or file; its coefficients are the prior of what tolerances do.
    axis : str
        ``pitch``, ``roll`` or ``yaw``.
    at : LearningCondition
    calibration : Calibration, optional
        Calibration of the instrument; the default one without.

    Returns
    -------
    AxisCard

    Raises
    ------
    host.errors.HostError
        If the aircraft cannot be read or not be trimmed there.
    """
    calibration = calibration or load_calibration()
    sensors = sensor_error_model(aircraft, calibration)
    airframe = airframe_data(aircraft)
    slopes = _per_count(axis, calibration, sensors)
    advances = [_advance(axis, signal, sensors, at) for signal in SIGNALS[axis] if signal in _LATE]
    gains = _gains(axis, airframe, at)
    rate = slopes[1]  # of one count; all gyros have the same
    arm_m = -sensors.vanes_m[0] if axis != PITCH else sensors.vanes_m[0]
    return AxisCard(
        axis=axis,
        harmonics=at.harmonics,
        advance_s=tuple(a.first_s for a in advances),
        curvature_s2=tuple(a.second_s2 for a in advances),
        lever=arm_m / at.airspeed_mps * rate / slopes[0],
        product=_product(axis, airframe),
        gain=tuple(g * rate / s for g, s in zip(gains, slopes, strict=True)),
        tolerance=tuple(_tolerances(aircraft, axis, airframe, sensors, at, gains).tolist()),
        wanted_percent=tuple(
            round(WANTED_PERCENT.get(name, OTHERS_PERCENT)) for name in NAMES[axis]
        ),
    )


def learned_axes(
    aircraft: str, card: Card, calibration: Calibration | None = None
) -> list[AxisCard]:
    """Return the cards with which the logger learns the axes that a flight card moves.

    Parameters
    ----------
    aircraft : str
        Name or file, with coefficients.
    card : Card
    calibration : Calibration, optional
        Calibration of the instrument; the default one without.
    """
    plane = load(aircraft)
    speed = card.flight.airspeed_mps or plane.scalar("trim.airspeed_mps")
    air = atmosphere(card.flight.field_pressure_pa, card.flight.field_temperature_degc)
    density = density_kgpm3(air, card.flight.height_m)
    moved = {TURNS[surface] for s in card.segments for surface in s.axes if surface in TURNS}
    return [
        learning_card(
            aircraft,
            axis,
            LearningCondition(speed, density, TEN_HARMONICS if axis == PITCH else SIX_HARMONICS),
            calibration,
        )
        for axis in (PITCH, ROLL, YAW)
        if axis in moved
    ]


def learning_parts(card: AxisCard) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return `card_axis` and `card_worth` of the flight card's file (wire/flight_card.py)."""

    def padded(values: Sequence[float], size: int) -> list[float]:
        return [*values, *[0] * (size - len(values))]

    axis = {
        "axis": (PITCH, ROLL, YAW).index(card.axis),
        "harmonic_count": len(card.harmonics),
        "harmonics": padded(card.harmonics, 10),
        "told": sum(1 << k for k, percent in enumerate(card.wanted_percent) if percent),
        "advance_s": padded(card.advance_s, 3),
        "curvature_s2": padded(card.curvature_s2, 3),
        "lever": card.lever,
        "product": card.product,
    }
    worth = {n: padded(getattr(card, n), 5) for n in ("gain", "tolerance", "wanted_percent")}
    return axis, worth


@dataclass(frozen=True, slots=True)
class _Delay:
    """A sensor as 1 / (1 + first s + second s^2)."""

    first_s: float
    second_s2: float

    def then(self, other: _Delay) -> _Delay:
        return _Delay(
            self.first_s + other.first_s,
            self.second_s2 + other.second_s2 + self.first_s * other.first_s,
        )

    def inverse(self) -> _Delay:
        return _Delay(-self.first_s, self.first_s**2 - self.second_s2)


_LATE = ("alpha", "beta", "de", "da", "dr")


def _pure(delay_s: float) -> _Delay:
    return _Delay(delay_s, 0.5 * delay_s**2)


def _advance(axis: str, signal: str, sensors: SensorErrorModel, at: LearningCondition) -> _Delay:
    """Return how much later than the gyro a signal is measured."""
    ident = packed_schema().by_name["ident"]

    def sampled(name: str) -> _Delay:
        return _pure(1e-6 * constant_delay_us(ident.field(name), DLPF_100_HZ))

    gyro = sampled("q").then(_pure(PACKET_AGE_S))
    if signal in _POTS:
        return sampled(_POTS[signal][0][0]).then(gyro.inverse())
    omega = 2.0 * math.pi * sensors.vane_hz_per_mps * at.airspeed_mps
    vane = _Delay(2.0 * sensors.vane_damping / omega, 1.0 / omega**2)
    rubbed = _pure(_friction_delay_s(sensors, at))
    return vane.then(rubbed).then(sampled(f"{signal}_a")).then(gyro.inverse())


def _friction_delay_s(sensors: SensorErrorModel, at: LearningCondition) -> float:
    """Return dry friction's delay of a Gaussian motion: friction sqrt(2/pi) over the rate's rms."""
    if at.angle_rate_radps <= 0.0:
        return 0.0
    friction_rad = sensors.vane_friction_rad * (sensors.friction_speed_mps / at.airspeed_mps) ** 2
    return friction_rad * math.sqrt(2.0 / math.pi) / at.angle_rate_radps


def _per_count(axis: str, calibration: Calibration, sensors: SensorErrorModel) -> list[float]:
    """Return the size of one count of each signal in rad or rad/s, as the logger forms them."""
    ident, lines = packed_schema().by_name["ident"], calibration.lines
    result = []
    for signal in SIGNALS[axis]:
        if signal in ("p", "q", "r"):
            gyro = lines["imu.gyro"].slope["pqr".index(signal)]
            result.append(ident.field(signal).scale * gyro)
            continue
        if signal in _POTS:
            of = [(f"channel.{name}", share) for name, share in _POTS[signal]]
        else:  # the sum of both vanes, and upwash
            share = 0.5 / (1.0 + sensors.upwash) if signal == "alpha" else 0.5
            of = [(f"channel.{signal}_{side}", share) for side in "ab"]
        scale = ident.field(of[0][0].partition(".")[2]).scale
        result.append(scale * float(np.mean([lines[n].slope[0] * abs(s) for n, s in of])))
    return result


def _product(axis: str, airframe: AirframeData) -> float:
    if axis == PITCH:
        return 0.0
    own = airframe.izz_kgm2 if axis == YAW else airframe.ixx_kgm2
    return airframe.ixz_kgm2 / own


def _gains(axis: str, airframe: AirframeData, at: LearningCondition) -> list[float]:
    """Return the coefficient's derivative per ratio of acceleration and signal, SI."""
    qbar_pa = 0.5 * at.density_kgpm3 * at.airspeed_mps**2
    inertia, length_m = {
        PITCH: (airframe.iyy_kgm2, airframe.chord_m),
        YAW: (airframe.izz_kgm2, airframe.span_m),
    }.get(axis, (airframe.ixx_kgm2, airframe.span_m))
    moment = inertia / (qbar_pa * airframe.wing_area_m2 * length_m)
    hat = 2.0 * at.airspeed_mps / length_m
    return [moment * (hat if signal in ("p", "q", "r") else 1.0) for signal in SIGNALS[axis]]


@dataclass(frozen=True, slots=True)
class _Wrong:
    """One error of instrument or card, of one standard deviation."""

    angle_share: float = 0.0
    angle_delay_s: float = 0.0
    rate_share: float = 0.0
    rate_delay_s: float = 0.0
    surface_share: tuple[float, float] = (0.0, 0.0)
    lever_s: float = 0.0
    tilt_rad: float = 0.0
    clock_share: float = 0.0
    inertia_share: float = 0.0
    speed_share: float = 0.0
    density_share: float = 0.0


def _tolerances(
    aircraft: str,
    axis: str,
    airframe: AirframeData,
    sensors: SensorErrorModel,
    at: LearningCondition,
    gains: list[float],
) -> Array:
    """Return half-widths from everything that no flight of this card tells.

    The prior's motion at the harmonics is fitted as it is and with each error; the shifts add in
    quadrature.
    """
    A, B = _prior(aircraft, axis, at)
    right = _fitted(A, B, axis, airframe, at, _Wrong())
    total = np.zeros(len(gains))
    for wrong in _errors(axis, airframe, sensors, at):
        theta = _fitted(A, B, axis, airframe, at, wrong)
        rates = np.array([s in ("p", "q", "r") for s in SIGNALS[axis]])
        worth = 1.0 + wrong.inertia_share - wrong.density_share - 2.0 * wrong.speed_share
        shift = theta * worth * np.where(rates, 1.0 + wrong.speed_share, 1.0) - right
        total += shift**2
    return np.asarray(NORMAL_95 * np.abs(np.asarray(gains)) * np.sqrt(total))


def _prior(aircraft: str, axis: str, at: LearningCondition) -> tuple[Array, Array]:
    """Return the fast motion of the aircraft file: angle and rates, and its surfaces."""
    frame = load(aircraft).airframe()
    linear = linearise(frame, solve(frame, at.airspeed_mps, density_kgpm3=at.density_kgpm3))
    V = at.airspeed_mps
    if axis == PITCH:
        keep, scale = np.array([1, 2]), np.array([V, 1.0])
        A, B = linear.longitudinal_a, linear.longitudinal_b
    else:
        keep, scale = np.array([0, 1, 2]), np.array([V, 1.0, 1.0])
        A, B = linear.lateral_a, linear.lateral_b
    A = A[np.ix_(keep, keep)] * scale[None, :] / scale[:, None]
    return A, B[keep, : 1 if axis == PITCH else 2] / scale[:, None]


def _errors(
    axis: str, airframe: AirframeData, sensors: SensorErrorModel, at: LearningCondition
) -> list[_Wrong]:
    e = deviations(sensors, airframe)
    angle = "alpha" if axis == PITCH else "beta"
    up = sensors.upwash / (1.0 + sensors.upwash) * e["upwash_share"] if axis == PITCH else 0.0
    omega = 2.0 * math.pi * sensors.vane_hz_per_mps * at.airspeed_mps
    late_s = e[f"{angle}_lag_share"] * 2.0 * sensors.vane_damping / omega
    rubbed_s = FRICTION_SHARE * _friction_delay_s(sensors, at)
    place_m = math.hypot(e["vane_x_m"], e["cg_x_m"])
    own = {PITCH: ("y", "iyy"), YAW: ("z", "izz")}.get(axis, ("x", "ixx"))
    none = _Wrong()
    surfaces = (
        [(e["elevator_scale"], 0.0)]
        if axis == PITCH
        else [(e["aileron_scale"], 0.0), (0.0, e["rudder_scale"])]
    )
    found = [
        replace(none, angle_share=math.hypot(e[f"{angle}_scale"], up)),
        replace(none, angle_delay_s=math.hypot(late_s, rubbed_s)),
        replace(none, rate_share=e[f"gyro_{own[0]}_scale"]),
        replace(none, rate_delay_s=e["imu_delay_s"]),
        *(replace(none, surface_share=share) for share in surfaces),
        replace(none, lever_s=place_m / at.airspeed_mps),
        replace(none, clock_share=e.get("clock_share", 0.0)),
        replace(none, inertia_share=e[f"{own[1]}_share"]),
        replace(none, speed_share=SPEED_SHARE),
        replace(none, density_share=DENSITY_SHARE),
    ]
    if axis != PITCH:
        found.append(replace(none, tilt_rad=e["imu_tilt_y_rad"]))
    return found


def _fitted(
    A: Array, B: Array, axis: str, airframe: AirframeData, at: LearningCondition, wrong: _Wrong
) -> Array:
    """Return ratios of acceleration and signals, SI, that the logger would find with one error."""
    rows, left = [], []
    own = 1 if axis == PITCH else {"roll": 0, YAW: 1}[axis] + 1
    for harmonic in at.harmonics:
        s = 2j * np.pi * SAMPLE_HZ / TURN_STEPS * harmonic
        states = np.linalg.solve(s * np.eye(len(A)) - A, B)
        for k in range(B.shape[1]):
            angle, rates = states[0, k], states[1:, k].copy()
            if len(rates) == 2:
                rates = rates + wrong.tilt_rad * np.array([-rates[1], rates[0]])
            angle = angle + wrong.lever_s * rates[-1]
            rates[own - 1] *= 1.0 + wrong.rate_share
            rates *= np.exp(-s * wrong.rate_delay_s)
            angle *= (1.0 + wrong.angle_share) * np.exp(-s * wrong.angle_delay_s)
            inputs = np.eye(B.shape[1])[k] * (1.0 + np.array(wrong.surface_share[: B.shape[1]]))
            rows.append([angle, *rates, *inputs])
            moment = s * (1.0 + wrong.clock_share) * rates
            product = 0.0 if len(rates) == 1 else _product(axis, airframe)
            left.append(moment[own - 1] - product * (moment.sum() - moment[own - 1]))
    X, y = np.array(rows), np.array(left)
    theta, *_ = np.linalg.lstsq(
        np.vstack([X.real, X.imag]), np.concatenate([y.real, y.imag]), rcond=None
    )
    return np.asarray(theta)

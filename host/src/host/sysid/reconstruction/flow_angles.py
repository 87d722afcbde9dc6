"""Angles of attack and sideslip where no vane measured them: path, wind, and the air's own force.

Velocity over the ground less the wind, in body axes, has the angles but for gusts. The forces
across have the gusts too: a_z = qbar (c0 + c_alpha alpha + c_q q_hat + c_de de), with alpha the
path's angle and a gust. Path, attitude, wind, gusts and the coefficients c are estimated together
by a Kalman smoother over linearised measurements, repeated about its own answer (Bell, The
Iterated Kalman Smoother as a Gauss-Newton Method, 1994; Klein & Morelli, Aircraft System
Identification, ch. 10). The controls' motion determines the coefficients, the rest the gusts.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass

import numpy as np

from host.aircraft.mass_properties import AirframeData
from host.arrays import Array
from host.constants import BLOCK_S, GRAVITY_MPS2, NORMAL_95
from host.errors import IdentificationError
from host.sysid.reconstruction.flight_path import GPS, WITH_GPS
from host.sysid.reconstruction.linear_smoother import Step, smooth
from host.sysid.reconstruction.path_preparation import gps_fixes
from host.sysid.reconstruction.reconstruction import Compatibility
from host.sysid.reconstruction.strapdown import rotation, rotation_from_vector

PASSES = 3
LONGEST_S = 600.0  # of a flight that is looked at: 16 s of processor time
TILTS = ("imu_tilt_y_rad", "imu_tilt_z_rad")  # of the IMU in the aircraft: no sensor sees it
FIRST_GUST_RAD = np.radians(1.0)
GUST_S = 1.5  # how long a gust lasts; 25 m at 17 m/s
GPS_SD_MPS, AIRSPEED_SD_MPS, AIRSPEED_S = 0.15, 0.3, 0.2
GYRO_SD, FORCE_SD = 0.003, 0.10  # per root Hz: noise, scale and vibration of an autopilot's IMU
TURN_SD_RAD = np.radians([3.0, 3.0, 10.0])  # of the autopilot's attitude at the first instant
ACROSS_SD_MPS2 = (0.3, 0.15)  # of a_z and a_y about their model
# What is known of the coefficients before, mean and standard deviation: of a_z over the handbook's
# lift slope (constant, slope, pitch rate, elevator), of a_y as CY (slope, roll and yaw rate,
# rudder, aileron).
LIFT_SHARE = 0.9
BEFORE = (
    (0.0, 0.1), (-1.0, 0.3), (-1.5, 1.5), (-0.12, 0.1),
    (-0.3, 0.3), (0.0, 0.3), (0.1, 0.3), (0.1, 0.2), (0.0, 0.1),
)  # fmt: skip
LEAST_SPEED_MPS = 5.0
FLYING_SHARE = 0.6  # of the usual airspeed
# State: velocity, attitude error, wind, what gusts add to a_z / qbar and a_y / qbar, coefficients.
# Gusts as forces, not as angles: with angles a slope too large makes each gust smaller, and the
# largest joint density lies 45 % above the truth (a_z of a flight in 0.3 m/s).
V, TURN, WIND, GUST = slice(0, 3), slice(3, 6), slice(6, 8), slice(8, 10)
LIFT, SIDE, COUNT = slice(10, 14), slice(14, 19), 19
ALPHA_SLOPE, BETA_SLOPE = 11, 14
NEEDED = (
    "t_s", "airspeed_mps", "p_radps", "q_radps", "r_radps", "ax_mps2", "ay_mps2", "az_mps2",
    "phi_rad", "theta_rad", "psi_rad", *GPS,
)  # fmt: skip


@dataclass(frozen=True)
class FlowAngles:
    """Reconstructed angles of a flight.

    Attributes
    ----------
    alpha_rad, beta_rad : Array, shape (n,)
        Against the air, gusts included, at the instants of the columns; held outside the part that
        was looked at.
    alpha_sd_rad, beta_sd_rad : float
        Usual standard deviation of an instant.
    alpha_scale_sd, beta_scale_sd : float
        Deviations of the slopes of lift and side force, and so of the scale of what gusts and
        inputs do.
    gust_rad : tuple of float
        Root mean square of the gusts' angles, alpha and beta.
    """

    alpha_rad: Array
    beta_rad: Array
    alpha_sd_rad: float
    beta_sd_rad: float
    alpha_scale_sd: float
    beta_scale_sd: float
    gust_rad: tuple[float, float]

    def hidden(self, columns: Collection[str]) -> dict[str, Array]:
        """Return those that are not among the columns."""
        found = {"alpha_rad": self.alpha_rad, "beta_rad": self.beta_rad}
        return {name: values for name, values in found.items() if name not in columns}

    def line(self) -> str:
        """Return what an answer says of them."""
        alpha, beta = (np.degrees(NORMAL_95 * sd) for sd in (self.alpha_sd_rad, self.beta_sd_rad))
        return (
            "no vanes: angles of attack and sideslip are reconstructed from IMU, attitude, airspeed"
            f" and GPS with the wind, +- {alpha:.1f} and {beta:.1f} deg (95 %), their scales +-"
            f" {100 * NORMAL_95 * self.alpha_scale_sd:.0f} and"
            f" {100 * NORMAL_95 * self.beta_scale_sd:.0f} %, which are in every interval"
        )


def reconstruct_flow_angles(
    columns: Mapping[str, Array], found: Compatibility, airframe: AirframeData
) -> FlowAngles:
    """Return the angles that vanes would have shown.

    Parameters
    ----------
    columns : mapping of (n,) arrays
        SI on an even grid, corrected and at the CG.
    found : Compatibility
        Wind and delay of GPS.
    airframe : AirframeData
        Sizes and mass: what is known beforehand of the slopes of lift and side force.

    Raises
    ------
    IdentificationError
        If a column is missing, or nothing flew.
    """
    missing = [name for name in NEEDED if name not in columns]
    if missing or not found.gps:
        raise IdentificationError(
            f"flow angles are not reconstructed: no {', '.join(missing) or 'GPS'}"
        )
    flown = flying(columns)
    longest = round(LONGEST_S / float(columns["t_s"][1] - columns["t_s"][0]))
    flown = slice(flown.start, min(flown.stop, flown.start + longest))
    record = _record({k: v[flown] for k, v in columns.items()}, found, airframe)
    mean, sd = _coefficients_before(airframe)
    states = _first_guess(record, mean)
    covariances: Array = np.zeros((len(states), COUNT, COUNT))
    slope = np.abs(mean[[ALPHA_SLOPE - LIFT.start, BETA_SLOPE - LIFT.start]])
    gust = FIRST_GUST_RAD * slope
    for _ in range(PASSES):
        steps = _linearised(record, states, gust)
        states, covariances = smooth(*_start(record, mean, sd), steps)
        gust = np.sqrt(np.mean(states[:, GUST] ** 2 + covariances[:, (8, 9), (8, 9)], axis=0))
        gust = np.clip(gust, 1e-3 * slope, 0.1 * slope)
    by = _angle_slopes(record, states)
    full, spread, scale, rms = [], [], [], []
    for angle, row, place, gusty in zip(
        _angles(record, states), by, (ALPHA_SLOPE, BETA_SLOPE), (8, 9), strict=True
    ):
        c, force = states[:, place], states[:, gusty]
        row[:, gusty] += 1.0 / c
        row[:, place] -= force / c**2
        full.append(np.interp(columns["t_s"], record.t_s, angle + force / c))
        variance = np.einsum("ni,nij,nj->n", row, covariances, row)
        tilt_rad = found[TILTS[gusty - 8]].half_width / NORMAL_95
        spread.append(float(np.hypot(np.sqrt(np.median(variance)), tilt_rad)))
        scale.append(float(min(np.sqrt(covariances[-1, place, place]) / abs(c[-1]), 1.0)))
        rms.append(float(gust[gusty - 8] / abs(c[-1])))
    return FlowAngles(full[0], full[1], spread[0], spread[1], scale[0], scale[1],
                      (rms[0], rms[1]))  # fmt: skip


def flying(columns: Mapping[str, Array]) -> slice:
    """Return the longest part of a record in which it flew.

    Raises
    ------
    IdentificationError
        If there is none.
    """
    speed = np.nan_to_num(columns["airspeed_mps"])
    fast = speed[speed > LEAST_SPEED_MPS]
    if len(fast) < 2:
        raise IdentificationError("flow angles are not reconstructed: nothing flew")
    aloft = np.concatenate([[False], speed > FLYING_SHARE * float(np.median(fast)), [False]])
    ends = np.flatnonzero(aloft[1:] != aloft[:-1])
    begin, end = max(zip(ends[::2], ends[1::2], strict=True), key=lambda part: part[1] - part[0])
    return slice(int(begin), int(end))


@dataclass(frozen=True)
class _Record:
    """Inputs of the smoother, at its own steps."""

    t_s: Array
    turn: Array  # (m, 3, 3) of the autopilot's attitude
    drift_rad: Array  # (m, 3): what the gyros turn more than it
    force_ned: Array  # (m, 3)
    across: Array  # (m, 2): a_z, a_y
    lift: Array  # (m, 4) regressors of a_z over the angle's place
    side: Array  # (m, 5)
    airspeed_mps: Array
    velocity_mps: Array
    fixes: Array
    wind_mps: Array
    wind_sd_mps: Array


def _record(columns: Mapping[str, Array], found: Compatibility, airframe: AirframeData) -> _Record:
    t = columns["t_s"]
    block = max(1, round(BLOCK_S / float(t[1] - t[0])))
    rows = len(t) // block
    if rows < 2:
        raise IdentificationError("flow angles are not reconstructed: nothing flew")

    def mean(name: str) -> Array:
        values = columns.get(name, np.zeros(len(t)))
        return np.asarray(values[: rows * block].reshape(rows, block).mean(axis=1))

    at_s = mean("t_s")
    step_s = float(at_s[1] - at_s[0])
    speed = np.maximum(mean("airspeed_mps"), LEAST_SPEED_MPS)
    density = mean("density_kgpm3") if "density_kgpm3" in columns else np.full(rows, 1.225)
    qbar = 0.5 * density * speed**2
    turn = np.stack([rotation(*a) for a in zip(*(mean(f"{n}_rad") for n in ("phi", "theta", "psi")),
                                               strict=True)])  # fmt: skip
    rates = np.column_stack([mean(f"{a}_radps") for a in "pqr"])
    force = np.column_stack([mean(f"a{a}_mps2") for a in "xyz"])
    drift = np.zeros((rows, 3))
    for k in range(rows - 1):
        gyro = rotation_from_vector(0.5 * step_s * (rates[k] + rates[k + 1]))
        rest = turn[k] @ gyro @ turn[k + 1].T
        drift[k] = 0.5 * np.array(
            [rest[2, 1] - rest[1, 2], rest[0, 2] - rest[2, 0], rest[1, 0] - rest[0, 1]]
        )
    sizes_m = np.array([airframe.span_m, airframe.chord_m, airframe.span_m])
    hats = rates * sizes_m / (2.0 * speed[:, None])
    one = np.ones(rows)
    lift = qbar[:, None] * np.column_stack([one, one, hats[:, 1], mean("elevator_rad")])
    side = qbar[:, None] * np.column_stack(
        [one, hats[:, 0], hats[:, 2], mean("rudder_rad"), mean("aileron_rad")]
    )
    late_s = found[WITH_GPS[0]].value
    fixes = np.zeros(rows, dtype=bool)
    nearest = np.round((t[gps_fixes(columns)] - late_s - at_s[0]) / step_s).astype(np.int64)
    fixes[nearest[(nearest >= 0) & (nearest < rows)]] = True
    return _Record(
        at_s, turn, drift, np.einsum("nij,nj->ni", turn, force), force[:, [2, 1]], lift, side,
        speed, np.column_stack([np.interp(at_s + late_s, t, columns[n]) for n in GPS]), fixes,
        np.array([found[n].value for n in WITH_GPS[1:]]),
        np.array([max(found[n].half_width / NORMAL_95, 0.1) for n in WITH_GPS[1:]]),
    )  # fmt: skip


def _coefficients_before(airframe: AirframeData) -> tuple[Array, Array]:
    """Return means and standard deviations of c of a_z, then of a_y, before the flight."""
    aspect = airframe.span_m**2 / airframe.wing_area_m2
    lift = 2.0 * np.pi * aspect / (aspect + 2.0) * LIFT_SHARE
    share = airframe.wing_area_m2 / airframe.mass_kg
    mean, sd = np.array(BEFORE).T
    return share * mean * np.where(np.arange(len(BEFORE)) < 4, lift, 1.0), share * sd * np.where(
        np.arange(len(BEFORE)) < 4, lift, 1.0
    )


def _first_guess(r: _Record, mean: Array) -> Array:
    states = np.zeros((len(r.t_s), COUNT))
    states[:, V] = r.velocity_mps
    states[:, WIND] = r.wind_mps
    states[:, LIFT.start :] = mean
    return states


def _body_velocity(r: _Record, states: Array) -> Array:
    air = states[:, V].copy()
    air[:, :2] -= states[:, WIND]
    return np.asarray(np.einsum("nji,nj->ni", r.turn, air - np.cross(states[:, TURN], air)))


def _angles(r: _Record, states: Array) -> tuple[Array, Array]:
    u, v, w = _body_velocity(r, states).T
    u = np.maximum(u, 1.0)
    return np.arctan2(w, u), np.arctan2(v, np.hypot(u, w))


def _angle_slopes(r: _Record, states: Array) -> tuple[Array, Array]:
    """Return the slopes of both angles of the path by the states: (m, COUNT) each."""
    u, v, w = _body_velocity(r, states).T
    u = np.maximum(u, 1.0)
    plane, whole = u**2 + w**2, u**2 + v**2 + w**2
    by_alpha = np.column_stack([-w, np.zeros(len(u)), u]) / plane[:, None]
    across = np.sqrt(plane)
    by_beta = np.column_stack([-u * v / across, across, -w * v / across]) / whole[:, None]
    air = states[:, V].copy()
    air[:, :2] -= states[:, WIND]
    found = []
    for body in (by_alpha, by_beta):
        ned = np.einsum("nij,nj->ni", r.turn, body)
        slope = np.zeros((len(u), COUNT))
        slope[:, V] = ned
        slope[:, WIND] = -ned[:, :2]
        slope[:, TURN] = np.cross(ned, air)
        found.append(slope)
    return found[0], found[1]


def _start(r: _Record, mean: Array, sd: Array) -> tuple[Array, Array]:
    """Return mean and covariance before the first measurement."""
    first, spread = np.zeros(COUNT), np.zeros(COUNT)
    first[V], first[WIND], first[LIFT.start :] = r.velocity_mps[0], r.wind_mps, mean
    spread[V], spread[TURN], spread[WIND] = 1.0, TURN_SD_RAD, r.wind_sd_mps
    spread[GUST], spread[LIFT.start :] = 0.03 * np.abs(mean[[1, 4]]), sd
    return first, np.diag(spread**2)


def _linearised(r: _Record, states: Array, gust: Array) -> list[Step]:
    """Return the steps of a linear smoother about some states."""
    rows, step_s = len(r.t_s), float(r.t_s[1] - r.t_s[0])
    decay = float(np.exp(-step_s / GUST_S))
    alpha, beta = _angles(r, states)
    slopes = _angle_slopes(r, states)
    power = np.zeros(COUNT)
    power[V], power[TURN] = FORCE_SD**2 * step_s, GYRO_SD**2 * step_s
    power[GUST] = gust**2 * (1.0 - decay**2)
    measured, models = [], []
    for angle, slope, regressors, place, column, gusty, seen in (
        (alpha, slopes[0], r.lift, LIFT, 1, 8, r.across[:, 0]),
        (beta, slopes[1], r.side, SIDE, 0, 9, r.across[:, 1]),
    ):  # fmt: skip
        qbar = regressors[:, column]
        row = slope * (qbar * states[:, place.start + column])[:, None]
        own = regressors.copy()
        own[:, column] *= angle
        row[:, place] += own
        row[:, gusty] = qbar
        value = np.einsum("nk,nk->n", own, states[:, place]) + qbar * states[:, gusty]
        measured.append(seen - value + np.einsum("nk,nk->n", row, states))
        models.append(row)
    air = states[:, V].copy()
    air[:, :2] -= states[:, WIND]
    speed = np.maximum(np.linalg.norm(air, axis=1), 1.0)
    pitot = np.zeros((rows, COUNT))
    pitot[:, V] = air / speed[:, None]
    pitot[:, WIND] = -pitot[:, V.start : V.start + 2]
    pitot_seen = r.airspeed_mps - speed + np.einsum("nk,nk->n", pitot, states)
    every = max(1, round(AIRSPEED_S / step_s))
    angle = gust[0] / abs(float(states[-1, ALPHA_SLOPE]))
    pitot_sd = float(np.hypot(AIRSPEED_SD_MPS, angle * np.median(speed)))
    eye = np.eye(3, COUNT)
    steps = []
    for k in range(rows):
        F = np.eye(COUNT)
        x, y, z = step_s * r.force_ned[k]
        F[0:3, 3:6] = [[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]]  # turn x force
        F[8, 8] = F[9, 9] = decay
        known = np.zeros(COUNT)
        known[V] = step_s * (r.force_ned[k] + [0.0, 0.0, GRAVITY_MPS2])
        known[TURN] = r.drift_rad[k]
        H, values = [models[0][k], models[1][k]], [measured[0][k], measured[1][k]]
        deviations = [*ACROSS_SD_MPS2]
        if r.fixes[k]:
            H += [*eye]
            values += [*r.velocity_mps[k]]
            deviations += [GPS_SD_MPS] * 3
        if k % every == 0:
            H.append(pitot[k])
            values.append(pitot_seen[k])
            deviations.append(pitot_sd)
        steps.append(Step(F, known, power, np.array(H), np.array(values), np.array(deviations)))
    return steps

"""MPU-6000 on the ArduIMU, and the attitude filter that runs beside it."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from host.aircraft.airframe import DOWN, NORTH, Q0, Q3, Array, P, Q, R
from host.aircraft.attitude import euler, to_body
from host.compiled import compiled_fast
from host.constants import GRAVITY_MPS2
from host.twin.flight.fly import STEP_S, FlightRecord
from host.twin.sensors.filters import delayed, first_order
from host.twin.sensors.local_flow import AirData
from host.twin.sensors.sensor_delays import FILTERS, sensor_delays

GYRO_NOISE_RADPS_RTHZ = math.radians(0.005)  # PS-MPU-6000A: 0.005 deg/s/sqrt(Hz)
ACCEL_NOISE_MPS2_RTHZ = 400e-6 * GRAVITY_MPS2  # 400 ug/sqrt(Hz)
GYRO_LSB_RADPS = math.radians(1.0 / 65.5)
ACCEL_LSB_MPS2 = GRAVITY_MPS2 / 8192.0
ANGLE_LSB_RAD = math.radians(0.01)
# Complementary filter of the direction-cosine kind: Mahony, Hamel & Pflimlin, IEEE TAC 53 (2008),
# explicit form; gains of the order of those of small autopilots.
TILT_GAIN_PERS = 0.2
HEADING_GAIN_PERS = 0.3
BIAS_GAIN_PERS2 = 0.005
FIELD_NED_T = np.array([30.0e-6, 2.2e-6, 32.0e-6])  # near Cairo, declination 4.1 deg (thesis)


@dataclass(frozen=True, slots=True)
class Imu:
    """IMU samples.

    Attributes
    ----------
    t_s : (m,) array
        True time of each sample; its registers then hold values as old as the filter's delay.
    dlpf : int
        DLPF_CFG.
    rates_radps, force_mps2 : (m, 3) arrays
        Measured, quantised if that switch is on.
    attitude_rad : (m, 3) array
        phi, theta, psi of the attitude filter, psi within +-pi.
    bias_radps : (m, 3) array
        Gyro bias as the attitude filter estimates it.
    magnetic_t : (m, 3) array
        Magnetometer.
    raw : (m, 9) int16 array
        p q r ax ay az phi theta psi in steps of the packet, saturated.
    """

    t_s: Array
    dlpf: int
    rates_radps: Array
    force_mps2: Array
    attitude_rad: Array
    bias_radps: Array
    magnetic_t: Array
    raw: np.ndarray[tuple[int, int], np.dtype[np.int16]]


@compiled_fast
def turned(c: Array, x: float, y: float, z: float) -> Array:
    """Return the matrix (3, 3) body to north-east-down after a small turn (rad) in body axes, rows
    orthogonal and of unit length."""
    out = np.empty((3, 3))
    for k in range(3):
        a, b, d = c[k, 0], c[k, 1], c[k, 2]
        out[k, 0] = a + b * z - d * y
        out[k, 1] = b + d * x - a * z
        out[k, 2] = d + a * y - b * x
    dot = 0.5 * (out[0, 0] * out[1, 0] + out[0, 1] * out[1, 1] + out[0, 2] * out[1, 2])
    for k in range(3):
        a, b = out[0, k], out[1, k]
        out[0, k], out[1, k] = a - dot * b, b - dot * a
    for k in range(2):
        length = math.sqrt(out[k, 0] ** 2 + out[k, 1] ** 2 + out[k, 2] ** 2)
        for j in range(3):
            out[k, j] /= length
    out[2, 0] = out[0, 1] * out[1, 2] - out[0, 2] * out[1, 1]
    out[2, 1] = out[0, 2] * out[1, 0] - out[0, 0] * out[1, 2]
    out[2, 2] = out[0, 0] * out[1, 1] - out[0, 1] * out[1, 0]
    return out


@compiled_fast
def complementary(
    rates: Array,
    force: Array,
    heading: Array,
    speed: Array,
    start: Array,
    step_s: float,
    carry_s: float,
) -> tuple[Array, Array]:
    """Run the attitude filter; return phi, theta, psi (m, 3) and the bias estimate (m, 3).

    `rates` (m, 3) rad/s, `force` (m, 3) m/s2, `heading` (m,) rad from the magnetometer, `speed`
    (m,) m/s for the centripetal correction, `start` (3,) first angles. As in the IMU's firmware the
    angles are carried on by the nominal delay `carry_s` of the gyro.
    """
    m = rates.shape[0]
    angles, biases = np.empty((m, 3)), np.empty((m, 3))
    c = np.empty((3, 3))  # body to north-east-down
    sp, cp = math.sin(start[0]), math.cos(start[0])
    st, ct = math.sin(start[1]), math.cos(start[1])
    ss, cs = math.sin(start[2]), math.cos(start[2])
    c[0, 0], c[0, 1], c[0, 2] = ct * cs, sp * st * cs - cp * ss, cp * st * cs + sp * ss
    c[1, 0], c[1, 1], c[1, 2] = ct * ss, sp * st * ss + cp * cs, cp * st * ss - sp * cs
    c[2, 0], c[2, 1], c[2, 2] = -st, sp * ct, cp * ct
    bias, e, before = np.zeros(3), np.zeros(3), rates[0].copy()
    for i in range(m):
        now = rates[i] - bias
        if i > 0:
            w = (0.5 * (before + now) + e) * step_s
            c = turned(c, w[0], w[1], w[2])
        before = now
        ahead = turned(c, now[0] * carry_s, now[1] * carry_s, now[2] * carry_s)
        angles[i, 0] = math.atan2(ahead[2, 1], ahead[2, 2])
        angles[i, 1] = -math.asin(min(max(ahead[2, 0], -1.0), 1.0))
        angles[i, 2] = math.atan2(ahead[1, 0], ahead[0, 0])
        biases[i] = bias
        # Measured direction of gravity: minus specific force, less the acceleration omega x V of
        # the turn.
        gx = -force[i, 0]
        gy = -(force[i, 1] - now[2] * speed[i])
        gz = -(force[i, 2] + now[1] * speed[i])
        size = math.sqrt(gx * gx + gy * gy + gz * gz)
        weight = max(0.0, 1.0 - abs(size / GRAVITY_MPS2 - 1.0) * 2.0)
        size = max(size, 1e-6)
        gx, gy, gz = gx / size, gy / size, gz / size
        # Error: measured x expected direction of gravity (third row of c), body axes.
        e[0] = (gy * c[2, 2] - gz * c[2, 1]) * weight * TILT_GAIN_PERS
        e[1] = (gz * c[2, 0] - gx * c[2, 2]) * weight * TILT_GAIN_PERS
        e[2] = (gx * c[2, 1] - gy * c[2, 0]) * weight * TILT_GAIN_PERS
        off = math.sin(heading[i] - angles[i, 2]) * HEADING_GAIN_PERS
        for k in range(3):
            e[k] += off * c[2, k]
            bias[k] -= BIAS_GAIN_PERS2 / TILT_GAIN_PERS * e[k] * step_s
    return angles, biases


@compiled_fast
def sensed_motion(
    states: Array,
    force_cg: Array,
    angular: Array,
    place: Array,
    tilt: Array,
    gyro_scale: Array,
    gyro_bias: Array,
    accel_scale: Array,
    accel_bias: Array,
    noise: Array,
    gyro_noise: float,
    accel_noise: float,
) -> tuple[Array, Array]:
    """Return angular rate and specific force at gyro and accelerometer before their filter, (n, 3)
    each.

    Specific force at `place` (3,) from the CG: f + omega' x r + omega x (omega x r); both then
    turned by the misalignment `tilt` (3, 3), scaled, biased and made noisy (`noise` (n, 6),
    standard normal).
    """
    count = states.shape[0]
    rates, force = np.empty((count, 3)), np.empty((count, 3))
    w, f = np.empty(3), np.empty(3)
    x, y, z = place[0], place[1], place[2]
    for i in range(count):
        p, q, r = states[i, P], states[i, Q], states[i, R]
        dp, dq, dr = angular[i, 0], angular[i, 1], angular[i, 2]
        along = p * x + q * y + r * z
        size = p * p + q * q + r * r
        f[0] = force_cg[i, 0] + dq * z - dr * y + p * along - size * x
        f[1] = force_cg[i, 1] + dr * x - dp * z + q * along - size * y
        f[2] = force_cg[i, 2] + dp * y - dq * x + r * along - size * z
        w[0], w[1], w[2] = p, q, r
        for k in range(3):
            turned_w = tilt[k, 0] * w[0] + tilt[k, 1] * w[1] + tilt[k, 2] * w[2]
            turned_f = tilt[k, 0] * f[0] + tilt[k, 1] * f[1] + tilt[k, 2] * f[2]
            rates[i, k] = turned_w * gyro_scale[k] + gyro_bias[k] + gyro_noise * noise[i, k]
            force[i, k] = turned_f * accel_scale[k] + accel_bias[k] + accel_noise * noise[i, 3 + k]
    return rates, force


def imu(
    record: FlightRecord, data: AirData, at_s: Array, dlpf: int, rng: np.random.Generator
) -> Imu:
    """Return the IMU's samples.

    Parameters
    ----------
    record : FlightRecord
    data : AirData
    at_s : (m,) array
        Sampling times.
    dlpf : int
        DLPF_CFG, a key of `delays.FILTERS`.
    rng : numpy Generator

    Returns
    -------
    Imu
    """
    switches, draws = record.card.sensors, record.draws
    t, n = record.t_s, len(record.t_s)
    place = np.zeros(3)
    if switches.position:
        place = record.aircraft.vector("sensors.imu_m") + draws.vector("imu_m") - record.frame.cg_m
    noise = rng.standard_normal((n, 6))
    band = math.sqrt(0.5 / STEP_S) if switches.noise else 0.0  # white up to half the sampling rate
    rates, force = sensed_motion(
        record.states,
        record.specific_force_mps2,
        record.angular_acceleration_radps2,
        place,
        _rotation(draws.vector("misalignment_rad")),
        1.0 + draws.vector("gyro_scale_share"),
        draws.vector("gyro_bias_radps"),
        1.0 + draws.vector("accel_scale_share"),
        draws.vector("accel_bias_mps2"),
        noise,
        GYRO_NOISE_RADPS_RTHZ * band,
        ACCEL_NOISE_MPS2_RTHZ * band,
    )
    if switches.imu_filter:
        late = sensor_delays(record.aircraft, draws, dlpf)
        gyro_hz, accel_hz = (bandwidth_hz for bandwidth_hz, _ in FILTERS[dlpf])
        rates = _low_pass(rates, t, at_s, gyro_hz, late["gyro"])
        force = _low_pass(force, t, at_s, accel_hz, late["accelerometer"])
    else:
        rates, force = delayed(t, rates, 0.0, at_s), delayed(t, force, 0.0, at_s)

    attitudes = record.states[:, Q0 : Q3 + 1]
    true_angles = np.column_stack([np.unwrap(a) for a in euler(attitudes)])
    nearest = np.minimum(np.round(at_s / STEP_S).astype(np.int64), n - 1)
    magnetic = to_body(attitudes[nearest]) @ FIELD_NED_T
    magnetic = magnetic + rng.standard_normal(magnetic.shape) * (2e-7 if switches.noise else 0.0)
    angles = delayed(t, true_angles, 0.0, at_s)
    bias = np.zeros_like(rates)
    if switches.attitude_filter:
        # The compass is read late and has a slow error of its own: 2 deg.
        heading = angles[:, 2] + np.deg2rad(2.0) * np.sin(angles[:, 2])
        ground = np.linalg.norm(
            np.gradient(record.states[:, NORTH : DOWN + 1], STEP_S, axis=0), axis=1
        )
        ground[record.t_s < record.card.flight.ground_s + 2 * STEP_S] = 0.0
        speed = delayed(t, ground, 0.3, at_s)
        step = float(np.median(np.diff(at_s)))
        carry = FILTERS[dlpf][0][1] if switches.imu_filter else 0.0
        angles, bias = complementary(rates, force, heading, speed, angles[0], step, carry)
    angles[:, 2] = np.mod(angles[:, 2] + np.pi, 2.0 * np.pi) - np.pi
    raw = np.column_stack([rates / GYRO_LSB_RADPS, force / ACCEL_LSB_MPS2, angles / ANGLE_LSB_RAD])
    raw = np.clip(np.round(raw), -32767, 32767)
    if switches.quantisation:
        rates, force = raw[:, :3] * GYRO_LSB_RADPS, raw[:, 3:6] * ACCEL_LSB_MPS2
    return Imu(at_s, dlpf, rates, force, angles, bias, magnetic, raw.astype(np.int16))


def _low_pass(x: Array, t: Array, at_s: Array, bandwidth_hz: float, late_s: float) -> Array:
    """Return x behind a lag of the filter's bandwidth and a pure delay for the rest of `late_s`."""
    tau = min(1.0 / (2.0 * math.pi * bandwidth_hz), late_s)
    slow = np.column_stack([first_order(x[:, k], tau, STEP_S) for k in range(x.shape[1])])
    return delayed(t, slow, late_s - tau, at_s)


def _rotation(small_rad: Array) -> Array:
    """Return the matrix that turns a vector into axes tilted by small angles about x, y, z."""
    a, b, c = small_rad
    return np.array([[1.0, c, -b], [-c, 1.0, a], [b, -a, 1.0]])

"""MPU-6000 on the ArduIMU, and the attitude filter that runs on it."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from host.aircraft.airframe import DOWN, NORTH, Q0, Q3, Array, P, Q, R
from host.aircraft.attitude import euler, to_body
from host.compiled import compiled_fast
from host.constants import GRAVITY_MPS2
from host.twin.flight.fly import STEP_S, FlightRecord
from host.twin.sensors.filters import delayed, go_on_first_order
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
REST_SPREAD_RADPS = math.radians(2.0)  # from end to end of a second: the firmware's RestDetector
SPEED_LATE_S = 0.3  # of a GPS
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
    step_s: float,
    carry_s: float,
    first: int,
    last: int,
    resting: int,
    c: Array,
    kept: Array,
    angles: Array,
    biases: Array,
) -> None:
    """Run the attitude filter through the samples first..last: phi, theta, psi into `angles`
    (m, 3), the bias estimate into `biases` (m, 3).

    `rates` (m, 3) rad/s, `force` (m, 3) m/s2, `heading` (m,) rad from the magnetometer, `speed`
    (m,) m/s for the centripetal correction. `c` (3, 3), body to north-east-down, and `kept` (4, 3),
    bias, correction and rate of the sample before, and rest, are what it remembers. As in the IMU's
    firmware the angles are carried on by the nominal delay `carry_s` of the gyro; and behind three
    seconds at rest, which are among the first `resting` samples, the mean rates of the second
    before the last are the bias, and nothing else teaches it.
    """
    bias, e, before = kept[0], kept[1], kept[2]
    second = int(1.0 / step_s + 0.5)
    at_rest = kept[3, 0] > 0.0
    for i in range(first, last):
        if i % second == 0:
            at_rest = 3 * second <= i < resting
            for k in range(3):
                if at_rest:
                    seen = rates[i - 3 * second : i, k]
                    at_rest = seen.max() - seen.min() < REST_SPREAD_RADPS
            for k in range(3):
                if at_rest:
                    bias[k] = np.mean(rates[i - 2 * second : i - second, k])
        now = rates[i] - bias
        if i > 0:
            w = (0.5 * (before + now) + e) * step_s
            c[:, :] = turned(c, w[0], w[1], w[2])
        before[:] = now
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
            if not at_rest:
                bias[k] -= BIAS_GAIN_PERS2 / TILT_GAIN_PERS * e[k] * step_s
    kept[3, 0] = 1.0 if at_rest else 0.0


@compiled_fast
def turned_to(start: Array) -> Array:
    """Return the matrix (3, 3) body to north-east-down of phi, theta, psi."""
    c = np.empty((3, 3))
    sp, cp = math.sin(start[0]), math.cos(start[0])
    st, ct = math.sin(start[1]), math.cos(start[1])
    ss, cs = math.sin(start[2]), math.cos(start[2])
    c[0, 0], c[0, 1], c[0, 2] = ct * cs, sp * st * cs - cp * ss, cp * st * cs + sp * ss
    c[1, 0], c[1, 1], c[1, 2] = ct * ss, sp * st * ss + cp * cs, cp * st * ss - sp * cs
    c[2, 0], c[2, 1], c[2, 2] = -st, sp * ct, cp * ct
    return c


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
    taking = ImuSampling(record, at_s, dlpf, rng)
    taking.take(len(at_s))
    return taking.samples


class ImuSampling:
    """Takes the samples one after the other: also while the flight is flown.

    Attributes
    ----------
    samples : Imu
        Zero where not taken yet.
    """

    def __init__(
        self, record: FlightRecord, at_s: Array, dlpf: int, rng: np.random.Generator
    ) -> None:
        n, m = len(record.t_s), len(at_s)
        self._record, self._switches, draws = record, record.card.sensors, record.draws
        self._resting = int(np.searchsorted(at_s, record.card.flight.ground_s))
        self._place = np.zeros(3)
        if self._switches.position:
            self._place = (
                record.aircraft.vector("sensors.imu_m") + draws.vector("imu_m") - record.frame.cg_m
            )
        self._noise = rng.standard_normal((n, 6))
        # White up to half the sampling rate.
        self._band = math.sqrt(0.5 / STEP_S) if self._switches.noise else 0.0
        self._lag = [(0.0, 0.0), (0.0, 0.0)]
        if self._switches.imu_filter:
            late = sensor_delays(record.aircraft, draws, dlpf)
            names = zip(("gyro", "accelerometer"), FILTERS[dlpf], strict=True)
            self._lag = [
                (min(1.0 / (2.0 * math.pi * hz), late[name]), late[name]) for name, (hz, _) in names
            ]
        self._field_noise = rng.standard_normal((m, 3)) * (2e-7 if self._switches.noise else 0.0)
        self._step_s = float(np.median(np.diff(at_s))) if m > 1 else STEP_S
        self._carry_s = FILTERS[dlpf][0][1] if self._switches.imu_filter else 0.0
        self._c, self._kept = np.zeros((3, 3)), np.zeros((4, 3))
        self._heading, self._speed = np.zeros(m), np.zeros(m)
        # Values of every step: as sensed, behind the low-pass, true angles unwrapped, ground speed.
        self._sensed = [np.zeros((n, 3)), np.zeros((n, 3))]
        self._slow = [np.zeros((n, 3)), np.zeros((n, 3))]
        self._angles, self._ground = np.zeros((n, 3)), np.zeros(n)
        self._steps = self._next = 0
        self._exact = [np.zeros((m, 3)), np.zeros((m, 3))]
        self.samples = Imu(
            at_s, dlpf, np.zeros((m, 3)), np.zeros((m, 3)), np.zeros((m, 3)), np.zeros((m, 3)),
            np.zeros((m, 3)), np.zeros((m, 9), dtype=np.int16),
        )  # fmt: skip

    def take(self, last: int) -> None:
        """Take the samples before number `last`; the motion is there up to the step behind each."""
        first, self._next = self._next, last
        if first >= last:
            return
        out, switches = self.samples, self._switches
        at_s = out.t_s[first:last]
        self._sense(min(math.ceil(float(at_s[-1]) / STEP_S) + 1, len(self._record.t_s)))
        rows = slice(first, last)
        for k, (tau_s, late_s) in enumerate(self._lag):
            self._exact[k][rows] = self._delayed(self._slow[k], late_s - tau_s, at_s)
        nearest = np.minimum(np.round(at_s / STEP_S).astype(np.int64), len(self._record.t_s) - 1)
        attitudes = self._record.states[nearest, Q0 : Q3 + 1]
        out.magnetic_t[rows] = to_body(attitudes) @ FIELD_NED_T + self._field_noise[rows]
        angles = self._delayed(self._angles, 0.0, at_s)
        if switches.attitude_filter:
            # The compass is read late and has a slow error of its own: 2 deg.
            self._heading[rows] = angles[:, 2] + np.deg2rad(2.0) * np.sin(angles[:, 2])
            self._speed[rows] = self._delayed(self._ground, SPEED_LATE_S, at_s)
            if first == 0:
                self._c[:] = turned_to(angles[0])
            complementary(
                self._exact[0], self._exact[1], self._heading, self._speed, self._step_s,
                self._carry_s, first, last, self._resting,
                self._c, self._kept, out.attitude_rad, out.bias_radps,
            )  # fmt: skip
        else:
            out.attitude_rad[rows] = angles
        turn = out.attitude_rad[rows, 2]
        out.attitude_rad[rows, 2] = np.mod(turn + np.pi, 2.0 * np.pi) - np.pi
        exact = [e[rows] for e in self._exact]
        raw = np.column_stack(
            [exact[0] / GYRO_LSB_RADPS, exact[1] / ACCEL_LSB_MPS2,
             out.attitude_rad[rows] / ANGLE_LSB_RAD]
        )  # fmt: skip
        raw = np.clip(np.round(raw), -32767, 32767)
        if switches.quantisation:
            exact = [raw[:, :3] * GYRO_LSB_RADPS, raw[:, 3:6] * ACCEL_LSB_MPS2]
        out.rates_radps[rows], out.force_mps2[rows] = exact
        out.raw[rows] = raw.astype(np.int16)

    def _sense(self, last: int) -> None:
        """Fill what is sensed before step `last`."""
        first, self._steps = self._steps, last
        if first >= last:
            return
        record, draws, part = self._record, self._record.draws, slice(first, last)
        self._sensed[0][part], self._sensed[1][part] = sensed_motion(
            record.states[part],
            record.specific_force_mps2[part],
            record.angular_acceleration_radps2[part],
            self._place,
            _rotation(draws.vector("misalignment_rad")),
            1.0 + draws.vector("gyro_scale_share"),
            draws.vector("gyro_bias_radps"),
            1.0 + draws.vector("accel_scale_share"),
            draws.vector("accel_bias_mps2"),
            self._noise[part],
            GYRO_NOISE_RADPS_RTHZ * self._band,
            ACCEL_NOISE_MPS2_RTHZ * self._band,
        )
        begin = max(first, 1)
        for sensed, slow, (tau_s, _) in zip(self._sensed, self._slow, self._lag, strict=True):
            if first == 0:
                slow[0] = sensed[0]
            for k in range(3):
                go_on_first_order(sensed[:, k], slow[:, k], begin, last, tau_s, STEP_S)
        angles = np.column_stack(euler(record.states[part, Q0 : Q3 + 1]))
        if first > 0:
            angles = np.concatenate([self._angles[first - 1 : first], angles])
        self._angles[part] = np.unwrap(angles, axis=0)[-(last - first) :]
        # Between the steps before and behind: what is needed is as old as the compass.
        north = record.states[max(begin - 2, 0) : last, NORTH : DOWN + 1]
        begin = last - len(north) + 1
        self._ground[begin : last - 1] = np.linalg.norm(
            (north[2:] - north[:-2]) / (2.0 * STEP_S), axis=1
        )
        begun_s = record.card.flight.ground_s + 2 * STEP_S
        self._ground[: np.searchsorted(record.t_s, begun_s)] = 0.0

    def _delayed(self, x: Array, late_s: float, at_s: Array) -> Array:
        """Return `delayed` of all steps; a part of them has what it needs."""
        low = max(int((float(at_s[0]) - late_s) / STEP_S) - 2, 0)
        high = max(int((float(at_s[-1]) - late_s) / STEP_S) + 3, low + 2)
        return delayed(self._record.t_s[low:high], x[low:high], late_s, at_s)


def _rotation(small_rad: Array) -> Array:
    """Return the matrix that turns a vector into axes tilted by small angles about x, y, z."""
    a, b, c = small_rad
    return np.array([[1.0, c, -b], [-c, 1.0, a], [b, -a, 1.0]])

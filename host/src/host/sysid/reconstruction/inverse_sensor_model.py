"""Inverse sensor model: flight signals at the CG for assumed sensor errors.

The whole flight is corrected in the frequency domain. Delays and lags are inverted there, and every
signal passes the same low-pass, so that equations between signals still hold.
"""

from __future__ import annotations

import copy
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from host.aircraft.attitude import euler_rates
from host.arrays import Array
from host.instrument.deviations import SensorErrorModel
from host.physical.recording import SURFACES
from host.sysid.reconstruction.path_preparation import SLIDING_RADPS

PASS_HZ, STOP_HZ = 9.0, 13.0
FIT_RATE_HZ = 33.0  # signals end at 13 Hz; a fit takes a third of the time
ATTITUDE_CROSSOVER_RADPS = 2.0 * np.pi * 0.05  # attitude filter below, integrated gyro above
Spectrum = NDArray[np.complex128]


@dataclass(slots=True)
class Record:
    """Columns of a flight on an even grid, and their spectra.

    The straight line through the ends of a column is removed before the transform, so that nothing
    wraps; `cache` holds results for repeated sensor errors.
    """

    dt_s: float
    columns: dict[str, Array]
    jw: Spectrum = field(init=False)
    low_pass: Array = field(init=False)
    spectra: dict[str, Spectrum] = field(init=False)
    cache: dict[str, tuple[tuple[float, ...], Array]] = field(init=False, default_factory=dict)

    def __post_init__(self) -> None:
        hertz = np.fft.rfftfreq(self.samples, self.dt_s)
        self.jw = np.asarray(2j * np.pi * hertz, dtype=np.complex128)
        share = np.clip((hertz - PASS_HZ) / (STOP_HZ - PASS_HZ), 0.0, 1.0)
        self.low_pass = 0.5 * (1.0 + np.cos(np.pi * share))
        self.spectra = {k: np.fft.rfft(v - self._line(v)) for k, v in self.columns.items()}

    @property
    def samples(self) -> int:
        """Samples of every column."""
        return len(next(iter(self.columns.values())))

    def _line(self, values: Array) -> Array:
        return np.linspace(float(values[0]), float(values[-1]), len(values))

    def smooth(self, name: str, through: Spectrum | float = 1.0) -> Array:
        """Return a column behind the low-pass and a filter of unit static gain."""
        spectrum = self.spectra[name] * self.low_pass * through
        back: Array = np.fft.irfft(spectrum, self.samples)
        return back + self._line(self.columns[name])

    def filtered(self, values: Array, through: Spectrum | Array) -> Array:
        """Return filtered values, the line through their ends removed."""
        spectrum = np.fft.rfft(values - self._line(values)) * through
        return np.asarray(np.fft.irfft(spectrum, self.samples), dtype=np.float64)

    def rate(self, values: Array) -> Array:
        """Return the time derivative."""
        slope = float(values[-1] - values[0]) / ((self.samples - 1) * self.dt_s)
        return self.filtered(values, self.jw * (np.abs(self.jw) < 2.0 * np.pi * STOP_HZ)) + slope

    def on_clock(self, share: float) -> Record:
        """Return the record as of a clock that was slow by a relative error `share`."""
        if share == 0.0:
            return self
        result = copy.copy(self)
        result.dt_s, result.jw, result.cache = (
            self.dt_s * (1.0 + share),
            self.jw / (1.0 + share),
            {},
        )
        return result

    def cached(self, name: str, of: tuple[float, ...], make: Callable[[], Array]) -> Array:
        """Return `make()`, or its last result under this name for the same numbers."""
        if name not in self.cache or self.cache[name][0] != of:
            self.cache[name] = of, make()
        return self.cache[name][1]


def usable_length(samples: int) -> int:
    """Return the largest length up to `samples` with a fast transform (factors 2, 3, 5)."""
    best = 1
    twos = 1
    while twos <= samples:
        threes = twos
        while threes <= samples:
            fives = threes
            while fives <= samples:
                best = max(best, fives)
                fives *= 5
            threes *= 3
        twos *= 2
    return best


def decimate(columns: Mapping[str, Array], dt_s: float) -> Record:
    """Return a record decimated to the rate of the fit; its first sample keeps its time.

    Ljung, System Identification, 2nd ed., ch. 14. The signals are band-limited in the transform.

    Parameters
    ----------
    columns : mapping of (n,) arrays
        On an even grid; n of `usable_length`.
    dt_s : float
        Sample period, s.
    """
    samples = len(next(iter(columns.values())))
    decimated_samples = min(usable_length(round(samples * dt_s * FIT_RATE_HZ)), samples)
    at = np.arange(decimated_samples) * (samples / decimated_samples)
    result = {}
    for name, values in columns.items():
        line = np.linspace(float(values[0]), float(values[-1]), samples)
        spectrum = np.fft.rfft(values - line)[: decimated_samples // 2 + 1]
        back: Array = np.fft.irfft(spectrum, decimated_samples) * (decimated_samples / samples)
        result[name] = back + np.interp(at, np.arange(samples), line)
    return Record(dt_s * samples / decimated_samples, result)


def attitude(record: Record, s: Mapping[str, Array]) -> tuple[Array, Array]:
    """Return phi and theta, rad, by a complementary filter.

    Low frequencies come from the attitude filter, high ones from the gyros.
    """
    phi, theta = record.smooth("phi_rad"), record.smooth("theta_rad")
    rates = euler_rates(phi, theta, s["p"], s["q"], s["r"])
    blended = []
    for angle, rate in zip((phi, theta), rates[:2], strict=True):
        both = ATTITUDE_CROSSOVER_RADPS * angle + rate
        line = np.linspace(both[0], both[-1], len(both)) / ATTITUDE_CROSSOVER_RADPS
        blended.append(record.filtered(both, 1.0 / (record.jw + ATTITUDE_CROSSOVER_RADPS)) + line)
    return blended[0], blended[1]


def apply_sensor_errors(
    record: Record, errors: Mapping[str, float], data: SensorErrorModel, airspeed_mps: float
) -> dict[str, Array]:
    """Return signals at the CG for assumed instrument errors.

    Parameters
    ----------
    record : Record
    errors : mapping
        Values by the names of `host.instrument.deviations.deviations`.
    data : SensorErrorModel
    airspeed_mps : float
        Mean of the maneuvers, m/s: it gives the vanes' natural frequency.

    Returns
    -------
    dict
        ``V`` m/s, ``qbar`` Pa, ``alpha beta`` rad, ``p q r`` rad/s, ``pd qd rd`` rad/s2,
        ``ax ay az`` m/s2, ``de da dr`` rad, each (n,).
    """
    e = errors
    pitot = e["pitot_delay_s"], data.pitot_lag_s
    pressure = record.cached("qbar_pa", pitot, lambda: _invert_lag(record, "qbar_pa", *pitot))
    qbar = (pressure - e["pitot_zero_pa"]) / (1.0 + e["pitot_scale"])
    density = record.columns["density_kgpm3"] * (1.0 + e["density_share"])
    V = np.sqrt(2.0 * np.maximum(qbar, 1.0) / density)
    tilt = [e[f"imu_tilt_{a}_rad"] for a in "xyz"]
    alignment = np.linalg.inv(
        [[1.0, tilt[2], -tilt[1]], [-tilt[2], 1.0, tilt[0]], [tilt[1], -tilt[0], 1.0]]
    )
    inertial = _inertial_signals(
        record, e["imu_delay_s"], 1.0 / (2.0 * np.pi * data.imu_bandwidth_hz)
    )
    gyro_gain = np.array([[1.0 + e[f"gyro_{a}_scale"]] for a in "xyz"])
    accel_gain = np.array([[1.0 + e[f"accel_{a}_scale"]] for a in "xyz"])
    p, q, r = alignment @ (
        (inertial[:3] - [[e[f"gyro_{a}_bias_radps"]] for a in "xyz"]) / gyro_gain
    )
    pd, qd, rd = alignment @ (inertial[3:6] / gyro_gain)
    ax, ay, az = alignment @ (
        (inertial[6:] - [[e[f"accel_{a}_bias_mps2"]] for a in "xyz"]) / accel_gain
    )
    x, y, z = (
        data.imu_m[k] + e[f"imu_{a}_m"] - e[f"cg_{a}_m"] for k, a in enumerate("xyz")
    )  # fmt: skip
    ax = ax - (qd * z - rd * y + q * (p * y - q * x) - r * (r * x - p * z))
    ay = ay - (rd * x - pd * z + r * (q * z - r * y) - p * (p * y - q * x))
    az = az - (pd * y - qd * x + p * (r * x - p * z) - q * (q * z - r * y))
    alpha = (_vane_angle(record, "alpha", e, data, airspeed_mps) - e["alpha_zero_rad"]) / (
        1.0 + e["alpha_scale"]
    )
    beta = _vane_angle(record, "beta", e, data, airspeed_mps) / (1.0 + e["beta_scale"])
    # A vane in upwash reads atan((1 + upwash) w/u); a beta vane the flank angle atan(v/u).
    up = np.tan(alpha) / (1.0 + data.upwash * (1.0 + e["upwash_share"]))
    side = np.tan(beta)
    u = V / np.sqrt(1.0 + up**2 + side**2)
    x = data.vanes_m[0] + e["vane_x_m"] - e["cg_x_m"]
    y = data.vanes_m[1] - e["cg_y_m"]
    z = data.vanes_m[2] + e["vane_z_m"] - e["cg_z_m"]
    w = up * u - (p * y - q * x)
    v = side * u - (r * x - p * z)
    u = u - (q * z - r * y)
    surfaces = _surfaces(record, e, data.recording.commanded)
    return {
        "V": V, "qbar": qbar,
        "alpha": np.arctan2(w, u), "beta": np.arctan2(v, np.hypot(u, w)),
        "p": p, "q": q, "r": r, "pd": pd, "qd": qd, "rd": rd, "ax": ax, "ay": ay, "az": az,
        **dict(zip(("de", "da", "dr"), surfaces, strict=True)),
    }  # fmt: skip


def _surfaces(record: Record, e: Mapping[str, float], commanded: tuple[str, ...]) -> list[Array]:
    """Return surface positions, rad, corrected for errors of pots or of commanded servos."""
    late_s = e.get("servo_delay_s", 0.0)

    def moved() -> Array:
        late = [np.exp(-record.jw * late_s) if s in commanded else 1.0 for s in SURFACES]
        names = [f"{s}_rad" for s in SURFACES]
        return np.stack([record.smooth(n, by) for n, by in zip(names, late, strict=True)])

    shares = [e.get(f"{s}_{'servo_' * (s in commanded)}scale", 0.0) for s in SURFACES]
    positions = record.cached("surfaces", (late_s,), moved)
    return [
        # A servo moves (1 + scale) times its command; a pot reads (1 + scale) times the position.
        x * (1.0 + share) if s in commanded else x / (1.0 + share)
        for s, x, share in zip(SURFACES, positions, shares, strict=True)
    ]


def _invert_lag(record: Record, name: str, delay_s: float, lag_s: float) -> Array:
    """Return a column with its delay and first-order lag inverted."""
    return record.smooth(name, (1.0 + record.jw * lag_s) * np.exp(record.jw * delay_s))


def _inertial_signals(record: Record, delay_s: float, pole_s: float) -> Array:
    """Return p, q, r, their derivatives and ax, ay, az, delay and low-pass inverted, (9, n)."""

    def make() -> Array:
        columns = "p_radps", "q_radps", "r_radps", "ax_mps2", "ay_mps2", "az_mps2"
        rows = [_invert_lag(record, name, delay_s - pole_s, pole_s) for name in columns]
        return np.stack([*rows[:3], *map(record.rate, rows[:3]), *rows[3:]])

    return record.cached("inertial", (delay_s, pole_s), make)


def _vane_angle(
    record: Record, name: str, e: Mapping[str, float], data: SensorErrorModel, airspeed_mps: float
) -> Array:
    """Return the flow angle at a vane: second-order dynamics and dry friction inverted.

    delta'' + 2 zeta omega delta' + omega^2 delta = omega^2 (flow angle - friction sign(delta')),
    with omega proportional to airspeed and friction to its inverse square.
    """
    omega = 2.0 * np.pi * data.vane_hz_per_mps * airspeed_mps * (1.0 + e[f"{name}_lag_share"])
    friction_rad = data.vane_friction_rad * (1.0 + e["friction_share"])
    friction_rad *= (data.friction_speed_mps / airspeed_mps) ** 2

    def inverse_dynamics() -> Array:
        inverse = 1.0 + 2.0 * data.vane_damping * record.jw / omega + (record.jw / omega) ** 2
        return record.smooth(f"{name}_rad", inverse)

    def rate_sign() -> Array:
        vane_rate = record.rate(record.smooth(f"{name}_rad"))
        return record.filtered(np.tanh(vane_rate / SLIDING_RADPS), record.low_pass)

    sign = record.cached(f"{name} friction", (), rate_sign)
    return (
        record.cached(f"{name}_rad", (omega, data.vane_damping), inverse_dynamics)
        + friction_rad * sign
    )

"""Flight signals at the CG, corrected for sensors whose errors are assumed known.

The whole flight is corrected in the frequency domain: delays and lags are undone there, and the
same low-pass goes over every signal, so that an equation between them stays one.
"""

from __future__ import annotations

import copy
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from host.arrays import Array
from host.instrument.deviations import SensorErrorModel
from host.instrument.recording import SURFACES

PASS_HZ, STOP_HZ = 9.0, 13.0
FIT_RATE_HZ = 33.0  # rate of the fit: nothing is left above 13 Hz, a fit takes a third of the time
# Over this rate a vane slides for certain; its noise after the low-pass is about 0.015 rad/s.
SLIDING_RADPS = 0.02
ATTITUDE_CROSSOVER_RADPS = 2.0 * np.pi * 0.05  # attitude: filter below, integrated gyro above
Spectrum = NDArray[np.complex128]


@dataclass(slots=True)
class Record:
    """Columns of a flight on an even grid, and their spectra without the line through the ends."""

    dt_s: float
    columns: dict[str, Array]
    jw: Spectrum = field(init=False)
    low_pass: Array = field(init=False)
    spectra: dict[str, Spectrum] = field(init=False)
    latest: dict[str, tuple[tuple[float, ...], Array]] = field(init=False, default_factory=dict)

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
        """Return a column through the low-pass and a filter of unit gain at rest."""
        spectrum = self.spectra[name] * self.low_pass * through
        back: Array = np.fft.irfft(spectrum, self.samples)
        return back + self._line(self.columns[name])

    def passed(self, values: Array, through: Spectrum | Array) -> Array:
        """Return values, the line through their ends removed, through a filter."""
        spectrum = np.fft.rfft(values - self._line(values)) * through
        return np.asarray(np.fft.irfft(spectrum, self.samples), dtype=np.float64)

    def rate(self, values: Array) -> Array:
        """Return the time derivative."""
        slope = float(values[-1] - values[0]) / ((self.samples - 1) * self.dt_s)
        return self.passed(values, self.jw * (np.abs(self.jw) < 2.0 * np.pi * STOP_HZ)) + slope

    def on_clock(self, share: float) -> Record:
        """Return the same for a clock that was slow by a share: all took longer than it says."""
        if share == 0.0:
            return self
        result = copy.copy(self)
        result.dt_s, result.jw, result.latest = (
            self.dt_s * (1.0 + share),
            self.jw / (1.0 + share),
            {},
        )
        return result

    def made(self, name: str, of: tuple[float, ...], make: Callable[[], Array]) -> Array:
        """Return `make()`, or what it last gave under this name for the same numbers."""
        if name not in self.latest or self.latest[name][0] != of:
            self.latest[name] = of, make()
        return self.latest[name][1]


def usable_length(samples: int) -> int:
    """Return the largest length up to `samples` that transforms fast (factors 2, 3, 5)."""
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
    """Return a record at the rate of the fit; its first sample keeps its time.

    Parameters
    ----------
    columns : mapping of (n,) arrays
        On an even grid; n must transform fast (`usable_length`).
    dt_s : float
    """
    samples = len(next(iter(columns.values())))
    fewer = min(usable_length(round(samples * dt_s * FIT_RATE_HZ)), samples)
    at = np.arange(fewer) * (samples / fewer)
    result = {}
    for name, values in columns.items():
        line = np.linspace(float(values[0]), float(values[-1]), samples)
        spectrum = np.fft.rfft(values - line)[: fewer // 2 + 1]
        back: Array = np.fft.irfft(spectrum, fewer) * (fewer / samples)
        result[name] = back + np.interp(at, np.arange(samples), line)
    return Record(dt_s * samples / fewer, result)


def attitude(record: Record, s: Mapping[str, Array]) -> tuple[Array, Array]:
    """Return phi, theta: the attitude filter's at low, the integrated gyro's at high frequency."""
    phi, theta = record.smooth("phi_rad"), record.smooth("theta_rad")
    across = s["q"] * np.sin(phi) + s["r"] * np.cos(phi)
    rates = (s["p"] + np.tan(theta) * across, s["q"] * np.cos(phi) - s["r"] * np.sin(phi))
    blended = []
    for angle, rate in zip((phi, theta), rates, strict=True):
        both = ATTITUDE_CROSSOVER_RADPS * angle + rate
        line = np.linspace(both[0], both[-1], len(both)) / ATTITUDE_CROSSOVER_RADPS
        blended.append(record.passed(both, 1.0 / (record.jw + ATTITUDE_CROSSOVER_RADPS)) + line)
    return blended[0], blended[1]


def apply_sensor_errors(
    record: Record, errors: Mapping[str, float], data: SensorErrorModel, airspeed_mps: float
) -> dict[str, Array]:
    """Return signals at the CG for assumed instrument errors.

    Parameters
    ----------
    record : Record
    errors : mapping
        Names of `instrument_errors.deviations`.
    data : SensorErrorModel
    airspeed_mps : float
        Mean of the maneuvers: sets the vanes' frequency.

    Returns
    -------
    dict
        ``V`` m/s, ``qbar`` Pa, ``alpha beta`` rad, ``p q r`` rad/s, ``pd qd rd`` rad/s2,
        ``ax ay az`` m/s2, ``de da dr`` rad, each (n,).
    """
    e = errors
    pitot = e["pitot_delay_s"], data.pitot_lag_s
    pressure = record.made("qbar_pa", pitot, lambda: _invert_lag(record, "qbar_pa", *pitot))
    qbar = (pressure - e["pitot_drift_pa"]) / (1.0 + e["pitot_scale"])
    density = record.columns["density_kgpm3"] * (1.0 + e["density_share"])
    V = np.sqrt(2.0 * np.maximum(qbar, 1.0) / density)
    tilt = [e[f"tilt_{a}_rad"] for a in "xyz"]
    turned = np.linalg.inv(
        [[1.0, tilt[2], -tilt[1]], [-tilt[2], 1.0, tilt[0]], [tilt[1], -tilt[0], 1.0]]
    )
    inertial = _inertial_signals(
        record, e["imu_delay_s"], 1.0 / (2.0 * np.pi * data.imu_bandwidth_hz)
    )
    spread = np.array([[1.0 + e[f"gyro_{a}_scale"]] for a in "xyz"])
    stretch = np.array([[1.0 + e[f"accel_{a}_scale"]] for a in "xyz"])
    p, q, r = turned @ ((inertial[:3] - [[e[f"gyro_{a}_bias_radps"]] for a in "xyz"]) / spread)
    pd, qd, rd = turned @ (inertial[3:6] / spread)
    ax, ay, az = turned @ ((inertial[6:] - [[e[f"accel_{a}_bias_mps2"]] for a in "xyz"]) / stretch)
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
    """Return what the surfaces did: errors of pots, or of servos that were only commanded."""
    late_s = e.get("servo_delay_s", 0.0)

    def moved() -> Array:
        late = [np.exp(-record.jw * late_s) if s in commanded else 1.0 for s in SURFACES]
        names = [f"{s}_rad" for s in SURFACES]
        return np.stack([record.smooth(n, by) for n, by in zip(names, late, strict=True)])

    shares = [e.get(f"{s}_{'servo_' * (s in commanded)}scale", 0.0) for s in SURFACES]
    positions = record.made("surfaces", (late_s,), moved)
    return [
        # A servo goes further than it is told; a pot says more than there is.
        x * (1.0 + share) if s in commanded else x / (1.0 + share)
        for s, x, share in zip(SURFACES, positions, shares, strict=True)
    ]


def _invert_lag(record: Record, name: str, delay_s: float, lag_s: float) -> Array:
    """Return a column without its delay and the lag of the first order behind it."""
    return record.smooth(name, (1.0 + record.jw * lag_s) * np.exp(record.jw * delay_s))


def _inertial_signals(record: Record, delay_s: float, pole_s: float) -> Array:
    """Return p, q, r, their derivatives and ax, ay, az without delay and low-pass, (9, n)."""

    def make() -> Array:
        columns = "p_radps", "q_radps", "r_radps", "ax_mps2", "ay_mps2", "az_mps2"
        rows = [_invert_lag(record, name, delay_s - pole_s, pole_s) for name in columns]
        return np.stack([*rows[:3], *map(record.rate, rows[:3]), *rows[3:]])

    return record.made("inertial", (delay_s, pole_s), make)


def _vane_angle(
    record: Record, name: str, e: Mapping[str, float], data: SensorErrorModel, airspeed_mps: float
) -> Array:
    """Return the flow angle a vane was pushed by: inertia, damping and dry friction undone."""
    omega = 2.0 * np.pi * data.vane_hz_per_mps * airspeed_mps * (1.0 + e[f"{name}_lag_share"])
    hold = data.vane_friction_rad * (1.0 + e["friction_share"])
    hold *= (data.friction_speed_mps / airspeed_mps) ** 2

    def pushed() -> Array:
        inverse = 1.0 + 2.0 * data.vane_damping * record.jw / omega + (record.jw / omega) ** 2
        return record.smooth(f"{name}_rad", inverse)

    def sliding() -> Array:
        moving = record.rate(record.smooth(f"{name}_rad"))
        return record.passed(np.tanh(moving / SLIDING_RADPS), record.low_pass)

    against = record.made(f"{name} friction", (), sliding)
    return record.made(f"{name}_rad", (omega, data.vane_damping), pushed) + hold * against

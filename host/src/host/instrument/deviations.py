"""Sensor error model of identification: places, dynamics, one standard deviation per error.

Every error moves the corrected signals or the known mass properties. Two sensors of a kind are
averaged, so the deviation of their mean counts.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

from host.aircraft import usual_servo
from host.aircraft.file import load_measured
from host.aircraft.mass_properties import AirframeData, Place, place
from host.instrument.instrument_errors import (
    InstrumentErrors,
    errors_without_file,
    instrument_errors,
    standard_errors,
)
from host.physical.calibration import Calibration
from host.physical.recording import FOREIGN, OWN, Recording

LEAST_LAG_S = 1e-5  # stands for no low-pass at all, so that its bandwidth stays finite
LEAST_CLOCK_SHARE = 1e-5  # GPS leaves 0.2 ppm, far too little to change an interval
# Delay of the vanes of airframes/*.toml at 17 m/s, of which the filter model's error is a share.
VANE_DELAY_S = 8e-3
VANES = {"alpha": ("alpha_a", "alpha_b"), "beta": ("beta_a", "beta_b")}
POTS = {
    "elevator": ("pot_elevator",),
    "aileron": ("pot_aileron_left", "pot_aileron_right"),
    "rudder": ("pot_rudder",),
}


@dataclass(frozen=True, slots=True)
class SensorErrorModel:
    """Places and dynamics of the sensors from the aircraft file, and their errors.

    Places are in metres from the nominal CG. `recording` is that of one flight: only some flights
    have errors of servos and clock.
    """

    imu_m: Place
    vanes_m: Place
    upwash: float
    vane_hz_per_mps: float
    vane_damping: float
    vane_friction_rad: float
    friction_speed_mps: float
    pitot_lag_s: float
    imu_bandwidth_hz: float = 42.0  # MPU-6000 register map, DLPF_CFG 3
    servo_hz: float = 0.0  # 0: the aircraft file has no servo
    servo_rate_radps: float = 0.0
    errors: InstrumentErrors = field(default_factory=standard_errors)
    recording: Recording = field(default_factory=Recording)

    @property
    def servo(self) -> tuple[float, float]:
        """Bandwidth (Hz) and rate limit (rad/s) of the servos; usual ones if the file has none."""
        if self.servo_hz > 0.0:
            return self.servo_hz, self.servo_rate_radps
        return usual_servo.BANDWIDTH_HZ, usual_servo.RATE_LIMIT_RADPS

    def recorded(self, recording: Recording) -> SensorErrorModel:
        """Return the model for one flight's recording, with the low-pass that its IMU had.

        A table from others does not state one, so none is taken out of its columns.
        """
        if recording.imu_lag_s is None:
            of_others = recording.maker == FOREIGN
            known_hz = math.inf if of_others else self.imu_bandwidth_hz
            return replace(self, recording=recording, imu_bandwidth_hz=known_hz)
        lag_s = max(recording.imu_lag_s, LEAST_LAG_S)
        return replace(self, recording=recording, imu_bandwidth_hz=1.0 / (2.0 * math.pi * lag_s))

    def scaled(self, factor: float, *names: str) -> SensorErrorModel:
        """Return the same with some errors, or all, that many times as large."""
        return replace(self, errors=self.errors.scaled(factor, *names))


def sensor_error_model(
    source: str,
    calibration: Calibration | None = None,
    *,
    defaults: bool = False,
    maker: str = OWN,
) -> SensorErrorModel:
    """Return the sensors of an aircraft by name or file, and their errors.

    Parameters
    ----------
    source : str
        Aircraft.
    calibration : Calibration, optional
        Calibration of the instrument; without one the standard errors count.
    defaults : bool
        Whether calibration lines that nobody measured count too, as in `instrument_errors`.
    maker : str
        Whose sensors they are (`Recording.maker`).

    Raises
    ------
    host.errors.UsageError
        If there is no such file, it does not describe its sensors, or an error of the calibration
        is unknown or impossible.
    """
    loaded = load_measured(source)
    number, vector, cg = loaded.scalar, loaded.vector, loaded.vector("mass.cg_m")
    between = 0.5 * (vector("sensors.vane_a_m") + vector("sensors.vane_b_m"))
    return SensorErrorModel(
        imu_m=place(vector("sensors.imu_m") - cg),
        vanes_m=place(between - cg),
        upwash=number("sensors.upwash"),
        vane_hz_per_mps=number("sensors.vane_frequency_hz_per_mps"),
        vane_damping=number("sensors.vane_damping"),
        vane_friction_rad=number("sensors.vane_friction_rad"),
        friction_speed_mps=number("trim.airspeed_mps"),
        pitot_lag_s=number("sensors.pitot_lag_s"),
        servo_hz=number("servo.bandwidth_hz"),
        servo_rate_radps=number("servo.rate_limit_radps"),
        errors=instrument_errors(loaded, calibration, defaults=defaults, maker=maker),
    )


def unknown_sensors(
    recording: Recording | None = None, calibration: Calibration | None = None
) -> SensorErrorModel:
    """Return the sensors of an aircraft without a file: dynamics of airframes/*.toml, at the CG.

    Their errors are those of `errors_without_file`.
    """
    nowhere = (0.0, 0.0, 0.0)
    recording = recording or Recording()
    errors = errors_without_file(recording.maker, calibration)
    return SensorErrorModel(
        nowhere, nowhere, upwash=0.0, vane_hz_per_mps=0.8, vane_damping=0.35,
        vane_friction_rad=0.0, friction_speed_mps=1.0, pitot_lag_s=0.010,
        errors=errors, recording=recording,
    )  # fmt: skip


def deviations(instrument: SensorErrorModel, airframe: AirframeData) -> dict[str, float]:
    """Return the prior standard deviation of every error that moves a coefficient.

    Parameters
    ----------
    instrument : SensorErrorModel
    airframe : AirframeData
        Its shares of mass and inertia count too.

    Returns
    -------
    dict of str to float
        By name; a name ends in the unit of its value.
    """
    e = instrument.errors
    lag_share = {
        name: math.hypot(
            e["delay_share"].of_mean(*pair), e["filter_model_s"].of_mean(pair[0]) / VANE_DELAY_S
        )
        for name, pair in VANES.items()
    }
    result = {
        "mass_share": airframe.mass_share,
        "ixx_share": airframe.inertia_share,
        "iyy_share": airframe.inertia_share,
        "izz_share": airframe.inertia_share,
        "vane_x_m": math.hypot(
            e["place_m"].of_mean("vane_a", "vane_b"), e["vane_ahead_m"].of_mean()
        ),
        "vane_z_m": e["place_m"].of_mean("vane_a", "vane_b"),
        **{
            f"{name}_scale": math.hypot(
                e["vane_scale"].of_mean(*pair), e["vane_flow_share"].sigma(name)
            )
            for name, pair in VANES.items()
        },
        "upwash_share": e["upwash_share"].of_mean(),
        "alpha_zero_rad": e["vane_zero_rad"].of_mean(*VANES["alpha"]),
        "pitot_scale": e["pitot_scale"].of_mean(),
        "pitot_zero_pa": e["pitot_zero_pa"].of_mean(),
        "density_share": e["density_share"].of_mean(),
        "imu_delay_s": imu_delay_s(instrument),
        "alpha_lag_share": lag_share["alpha"],
        "beta_lag_share": lag_share["beta"],
        "pitot_delay_s": max(  # a lag of 0 is not known exactly either
            e["delay_share"].of_mean("dp_a", "dp_b") * instrument.pitot_lag_s,
            e["delay_least_s"].of_mean("dp_a", "dp_b"),
        ),
        "friction_share": e["vane_friction_share"].of_mean(),
        **surface_deviations(instrument),
        "thrust_share": e["thrust_share"].of_mean(),
    }
    clock = clock_share(instrument)
    if clock > 0.0:
        result["clock_share"] = clock
    for axis in "xyz":
        result |= {
            f"cg_{axis}_m": e["cg_m"].sigma(axis),
            f"imu_{axis}_m": e["place_m"].sigma("imu"),
            f"gyro_{axis}_scale": e["gyro_scale"].sigma(axis),
            f"gyro_{axis}_bias_radps": e["gyro_bias_radps"].sigma(axis),
            f"accel_{axis}_scale": e["accel_scale"].sigma(axis),
            f"accel_{axis}_bias_mps2": e["accel_bias_mps2"].sigma(axis),
            f"imu_tilt_{axis}_rad": e["misalignment_rad"].sigma(axis),
        }
    return {name: float(value) for name, value in result.items()}


def surface_deviations(instrument: SensorErrorModel) -> dict[str, float]:
    """Return the standard deviation of each surface angle: that of its pot, else of its servo."""
    e, commanded = instrument.errors, instrument.recording.commanded
    result = {
        f"{surface}_scale": e["pot_scale"].of_mean(*pots)
        for surface, pots in POTS.items()
        if surface not in commanded
    }
    result |= {f"{surface}_servo_scale": e["servo_scale"].sigma(surface) for surface in commanded}
    if commanded:
        result["servo_delay_s"] = max(servo_delay_s(instrument, surface) for surface in commanded)
    return result


def servo_delay_s(instrument: SensorErrorModel, surface: str) -> float:
    """Return one standard deviation of a servo's delay, s.

    Below 3 Hz its first-order lag is a delay, so the error of its bandwidth is in it.
    """
    e, (hertz, _) = instrument.errors, instrument.servo
    share = "servo_bandwidth_share" if instrument.servo_hz > 0.0 else "servo_unknown_share"
    lag_s = 1.0 / (2.0 * math.pi * hertz)
    return math.hypot(e[share].sigma(surface) * lag_s, e["servo_delay_s"].sigma(surface))


def dynamic_pressure_share(errors: InstrumentErrors, qbar_pa: float) -> float:
    """Return one standard deviation of the pitots' dynamic pressure, as a share of it."""
    zero = errors["pitot_zero_pa"].of_mean() / qbar_pa
    return math.hypot(errors["pitot_scale"].of_mean(), zero)


def airspeed_share(errors: InstrumentErrors, qbar_pa: float) -> float:
    """Return one standard deviation of the airspeed's scale: pitots, and the density."""
    pressure = dynamic_pressure_share(errors, qbar_pa)
    return 0.5 * math.hypot(pressure, errors["density_share"].of_mean())


def clock_share(instrument: SensorErrorModel) -> float:
    """Return one standard deviation of the clock's scale: after GPS, else the resonator's."""
    left = instrument.recording.clock_share
    if left is None:
        return instrument.errors["clock_share"].sigma("mega")
    return left if left >= LEAST_CLOCK_SHARE else 0.0


def imu_delay_s(instrument: SensorErrorModel) -> float:
    """Return one standard deviation of the IMU's delay, s, with the error of its filter model."""
    e = instrument.errors
    return math.hypot(e["delay_least_s"].sigma("imu"), e["filter_model_s"].sigma("imu"))


def vane_delay_s(instrument: SensorErrorModel, nominal_s: float) -> float:
    """Return one standard deviation of the vanes' mean delay, s."""
    e = instrument.errors
    share, least = e["delay_share"], e["delay_least_s"]
    pairs = (("alpha_a", "alpha_b"), ("beta_a", "beta_b"))
    return max(max(nominal_s * share.of_mean(*pair), least.of_mean(*pair)) for pair in pairs)

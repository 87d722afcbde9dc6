"""What the airborne instrument may be wrong by: one standard deviation of each unknown error.

Every entry moves the corrected signals or the known mass properties; `coefficient_fit` estimates
all of them beside the coefficients, so that what the data cannot tell stays in the intervals.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from host.aircraft.file import load_measured
from host.aircraft.mass_properties import AirframeData, place

EVEN = 1.0 / np.sqrt(3.0)  # standard deviation of an even distribution over its half-width
PAIR = 1.0 / np.sqrt(2.0)  # of the mean of two sensors
DEGREE = np.pi / 180.0


@dataclass(frozen=True, slots=True)
class InstrumentData:
    """Sensor dynamics from the aircraft file, and what is left after calibration.

    Half-widths of the even distributions of an instrument that was calibrated once; positions in
    metres from the nominal CG.
    """

    imu_m: tuple[float, float, float]
    vanes_m: tuple[float, float, float]
    upwash: float
    upwash_share: float
    vane_hz_per_mps: float
    vane_damping: float
    vane_friction_rad: float
    friction_speed_mps: float
    pitot_lag_s: float
    position_m: float = 0.010
    cg_m: float = 0.010
    vane_scale: float = 0.03
    vane_zero_rad: float = 0.5 * DEGREE
    pitot_scale: float = 0.03
    pitot_drift_pa: float = 4.88
    delay_share: float = 0.20
    delay_least_s: float = 1e-3
    align_s: float = 0.5e-3  # filters modelled as one pole and a delay
    misalignment_rad: float = 1.0 * DEGREE
    gyro_scale: float = 0.01
    gyro_bias_radps: float = 0.5 * DEGREE
    accel_scale: float = 0.01
    accel_bias_mps2: float = 0.245
    pot_scale: float = 0.01
    friction_share: float = 0.2  # standard deviation
    density_share: float = 0.005  # standard deviation
    thrust_share: float = 0.02  # standard deviation
    imu_bandwidth_hz: float = 42.0  # MPU-6000 register map, DLPF_CFG 3


def instrument_data(source: str) -> InstrumentData:
    """Return the sensors' places and dynamics of an aircraft by name or file.

    Raises
    ------
    host.errors.UsageError
        If there is no such file, or it does not describe its sensors.
    """
    loaded = load_measured(source)
    number, vector, cg = loaded.scalar, loaded.vector, loaded.vector("mass.cg_m")
    between = 0.5 * (vector("sensors.vane_a_m") + vector("sensors.vane_b_m"))
    return InstrumentData(
        imu_m=place(vector("sensors.imu_m") - cg),
        vanes_m=place(between - cg),
        upwash=number("sensors.upwash"),
        upwash_share=number("sensors.upwash_tolerance"),
        vane_hz_per_mps=number("sensors.vane_frequency_hz_per_mps"),
        vane_damping=number("sensors.vane_damping"),
        vane_friction_rad=number("sensors.vane_friction_rad"),
        friction_speed_mps=number("trim.airspeed_mps"),
        pitot_lag_s=number("sensors.pitot_lag_s"),
        position_m=number("sensors.position_tolerance_m"),
        cg_m=number("mass.cg_tolerance_m"),
    )


def deviations(instrument: InstrumentData, airframe: AirframeData) -> dict[str, float]:
    """Return one standard deviation of every error, by name."""
    i = instrument
    late_share = np.hypot(i.delay_share * EVEN * PAIR, i.align_s / 8e-3)
    result = {
        "mass_share": airframe.mass_share,
        "ixx_share": airframe.inertia_share,
        "iyy_share": airframe.inertia_share,
        "izz_share": airframe.inertia_share,
        "vane_x_m": i.position_m * EVEN * PAIR,
        "vane_z_m": i.position_m * EVEN * PAIR,
        "alpha_scale": i.vane_scale * EVEN * PAIR,
        "beta_scale": i.vane_scale * EVEN * PAIR,
        "upwash_share": i.upwash_share * EVEN * PAIR,
        "alpha_zero_rad": i.vane_zero_rad * EVEN * PAIR,
        "pitot_scale": i.pitot_scale * EVEN * PAIR,
        "pitot_drift_pa": i.pitot_drift_pa * EVEN * PAIR,
        "density_share": i.density_share,
        "imu_delay_s": float(np.hypot(i.delay_least_s * EVEN, i.align_s)),
        "alpha_lag_share": float(late_share),
        "beta_lag_share": float(late_share),
        "pitot_delay_s": i.delay_share * i.pitot_lag_s * EVEN * PAIR,
        "friction_share": i.friction_share,
        "elevator_scale": i.pot_scale * EVEN,
        "aileron_scale": i.pot_scale * EVEN * PAIR,
        "rudder_scale": i.pot_scale * EVEN,
        "thrust_share": i.thrust_share,
    }
    for axis in "xyz":
        result |= {
            f"cg_{axis}_m": i.cg_m * EVEN,
            f"imu_{axis}_m": i.position_m * EVEN,
            f"gyro_{axis}_scale": i.gyro_scale * EVEN,
            f"gyro_{axis}_bias_radps": i.gyro_bias_radps * EVEN,
            f"accel_{axis}_scale": i.accel_scale * EVEN,
            f"accel_{axis}_bias_mps2": i.accel_bias_mps2 * EVEN,
            f"tilt_{axis}_rad": i.misalignment_rad * EVEN,
        }
    return {name: float(value) for name, value in result.items()}

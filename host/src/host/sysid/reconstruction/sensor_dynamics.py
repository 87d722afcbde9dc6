"""Invert known sensor dynamics, move signals to the CG, and perturb columns by residual errors.

Vanes have friction, dynamics and delay, the IMU has a low-pass, and none is at the CG. The aircraft
file and the reconstruction give values for these, which are inverted before the linear fits. The
errors that remain cannot be estimated in gusts; they are consider parameters of the fits.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from host.aircraft.mass_properties import AirframeData
from host.arrays import Array
from host.constants import NORMAL_95
from host.instrument.deviations import SensorErrorModel
from host.instrument.deviations import deviations as prior_deviations
from host.instrument.instrument_errors import InstrumentErrors
from host.physical.recording import SURFACES
from host.sysid.reconstruction.flight_path import AIR, DELAYS
from host.sysid.reconstruction.path_preparation import (
    NO_OFFSETS,
    compensate_friction,
    compensate_lowpass,
    vane_delay_by_file,
)
from host.sysid.reconstruction.position_correction import transfer_to_cg
from host.sysid.reconstruction.reconstruction import Compatibility

VANE_DELAY, PITOT_DELAY = DELAYS
IMU_DELAY = "imu_delay_s"
FRICTION = "friction_share"
ANGLES = AIR[1:]
PRESSURE = (AIR[0], "qbar_pa")
INERTIAL = (*(f"{a}_radps" for a in "pqr"), *(f"a{a}_mps2" for a in "xyz"))
DELAYED_COLUMNS = {
    VANE_DELAY: ANGLES,
    PITOT_DELAY: PRESSURE,
    IMU_DELAY: (*INERTIAL, *ANGLES, *PRESSURE, "phi_rad", "theta_rad"),
}
SERVO_DELAY, CLOCK = "servo_delay_s", "clock_share"
POTS = {f"{name}_scale": f"{name}_rad" for name in SURFACES}
SERVOS = {f"{name}_servo_scale": f"{name}_rad" for name in SURFACES}
PLACES = tuple(f"{what}_{a}_m" for what in ("imu", "cg", "vane") for a in "xyz")


def columns_at_cg(
    columns: Mapping[str, Array], airframe: AirframeData, found: Compatibility
) -> dict[str, Array]:
    """Return columns as perfect sensors at the CG would measure them, as far as is known.

    Parameters
    ----------
    columns : mapping of (n,) arrays
        SI, as decoded.
    airframe : AirframeData
    found : Compatibility
        Its estimated delays are removed; without its instrument only places are corrected.
    """
    i = found.instrument
    if i is None:
        return transfer_to_cg(dict(columns), airframe)
    result = dict(columns)
    dt_s = float(columns["t_s"][1] - columns["t_s"][0])
    tau_s, _ = vane_delay_of(found, i, columns)
    for name in (a for a in ANGLES if a in columns and AIR[0] in columns):
        result[name] = invert_vane_dynamics(
            compensate_friction(columns, name, i, dt_s), tau_s, i, columns, dt_s
        )
    for name in (n for n in INERTIAL if n in columns):
        result[name] = compensate_lowpass(columns[name], i, dt_s)
    result = advance_in_time(result, PRESSURE, i.pitot_lag_s)
    return transfer_to_cg(result, airframe)


def without_expected_errors(
    columns: Mapping[str, Array], errors: InstrumentErrors
) -> dict[str, Array]:
    """Return columns without what is expected of vanes of which no file tells upwash and place.

    Parameters
    ----------
    columns : mapping of (n,) arrays
        SI, as decoded.
    errors : InstrumentErrors
        Without a file (`no_file.toml`).
    """
    flow, ahead_m = errors["vane_flow_share"].mean, errors["vane_ahead_m"].mean
    result = {k: v / (1.0 + flow) if flow and k in ANGLES else v for k, v in columns.items()}
    return transfer_to_cg(result, _displaced("vane_x_m", ahead_m)) if ahead_m else result


def invert_vane_dynamics(
    angle: Array, tau_s: float, i: SensorErrorModel, columns: Mapping[str, Array], dt_s: float
) -> Array:
    """Return a vane's angle (rad) with its delay and second-order dynamics removed.

    To second order in s the vane is exp(-tau s) (1 - (tau^2 / 2 - 1 / omega^2) s^2), with the
    natural frequency omega proportional to airspeed; both factors are inverted.
    """
    t = columns["t_s"]
    undelayed = np.interp(t + tau_s, t, angle)
    omega = 2.0 * np.pi * i.vane_hz_per_mps * float(np.median(columns[AIR[0]]))
    curvature_s2 = 0.5 * tau_s**2 - 1.0 / omega**2
    return np.asarray(undelayed - curvature_s2 * np.gradient(np.gradient(undelayed, dt_s), dt_s))


def vane_delay_of(
    found: Compatibility, i: SensorErrorModel, columns: Mapping[str, Array]
) -> tuple[float, float]:
    """Return the vanes' delay and its deviation, s: reconstructed, else by the aircraft file."""
    estimated = next((f for f in found.findings if f.name == VANE_DELAY and f.data_informed), None)
    if estimated is not None:
        return estimated.value, estimated.half_width / NORMAL_95
    return vane_delay_by_file(i, columns)


def residual_errors(found: Compatibility, columns: Mapping[str, Array]) -> dict[str, float]:
    """Return the deviation of every residual error of place, delay, pot and friction, by name."""
    i = found.instrument
    if i is None:
        return {}
    every = prior_deviations(i, NO_OFFSETS)
    wanted = (*PLACES, *POTS, *SERVOS, SERVO_DELAY, CLOCK, FRICTION, IMU_DELAY, PITOT_DELAY)
    sizes = {n: every[n] for n in wanted if n in every}
    if AIR[0] in columns:  # a vane's delay goes by the airspeed
        sizes[VANE_DELAY] = vane_delay_of(found, i, columns)[1]
    return sizes


def perturb_columns(
    columns: Mapping[str, Array], error: str, size: float, found: Compatibility
) -> dict[str, Array]:
    """Return columns at the CG corrected for one error of `residual_errors` of a given size."""
    result = dict(columns)
    if error in DELAYED_COLUMNS:
        return advance_in_time(result, DELAYED_COLUMNS[error], size)
    if error in POTS:
        name = POTS[error]
        return result | ({name: columns[name] / (1.0 + size)} if name in columns else {})
    if error in SERVOS:
        name = SERVOS[error]
        return result | ({name: columns[name] * (1.0 + size)} if name in columns else {})
    if error == CLOCK:
        return result | {"t_s": columns["t_s"] * (1.0 + size)}
    i = found.instrument
    if error == SERVO_DELAY and i is not None:
        return advance_in_time(
            result, tuple(f"{name}_rad" for name in i.recording.commanded), -size
        )
    if error == FRICTION and i is not None and AIR[0] in columns:
        dt_s = float(columns["t_s"][1] - columns["t_s"][0])
        more_friction = replace(i, vane_friction_rad=size * i.vane_friction_rad)
        return result | {
            n: compensate_friction(columns, n, more_friction, dt_s) for n in ANGLES if n in columns
        }
    return transfer_to_cg(result, _displaced(error, size)) if error in PLACES else result


def _displaced(error: str, size_m: float) -> AirframeData:
    """Return places of sensors that are off by an error of one of them, or of the CG."""
    what, axis = error.split("_")[:2]
    size_m = -size_m if what == "cg" else size_m
    x, y, z = (size_m if a == axis else 0.0 for a in "xyz")
    return replace(
        NO_OFFSETS,
        imu_m=(x, y, z) if what != "vane" else NO_OFFSETS.imu_m,
        vanes_m=((x, y, z),) if what != "imu" else (),
    )


def advance_in_time(
    columns: Mapping[str, Array], names: tuple[str, ...], delay_s: float
) -> dict[str, Array]:
    """Return columns with some of them advanced in time by a delay (s)."""
    t = columns["t_s"]
    return {k: np.interp(t + delay_s, t, v) if k in names else v for k, v in columns.items()}

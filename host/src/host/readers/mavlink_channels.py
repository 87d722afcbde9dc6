"""MAVLink messages of a ground station in our names, units and signs.

common.xml gives the units; accelerations of RAW_IMU and SCALED_IMU are thousandths of g, rates
thousandths of rad/s, as ArduPilot fills them.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from host.arrays import Array
from host.constants import GRAVITY_MPS2
from host.physical.airdata import KELVIN, density_kgpm3
from host.readers.ardupilot_outputs import (
    SURFACES,
    Outputs,
    moves_a_surface,
    surfaces,
    unknown_outputs,
)
from host.readers.autopilot_log import AutopilotLog, Messages
from host.readers.named_channels import (
    SERVO_HZ,
    STANDARD_DENSITY_KGPM3,
    Channels,
    instance_of,
    numbers,
)
from host.readers.px4_outputs import surfaces_of_pulses
from host.readers.written_parameters import made_of_outputs

MILLI = 1e-3
IMUS = (("RAW_IMU", MILLI), ("SCALED_IMU", MILLI), ("SCALED_IMU2", MILLI), ("HIGHRES_IMU", 1.0))
PASCALS = 100.0  # of a hPa
MOST_SERVOS = 16


def mavlink_channels(log: AutopilotLog, chosen: Mapping[str, int]) -> Channels:
    """Return the channels of a telemetry log; `chosen` names instances by message."""
    found = Channels()
    for name in chosen:
        instance_of(log, name, chosen, [])
    _inertial(log, found)
    att = log.first("ATTITUDE")
    if att is not None:
        for ours, theirs in (("phi_rad", "roll"), ("theta_rad", "pitch"), ("psi_rad", "yaw")):
            found.add(ours, att.t_s, _field(att, theirs), f"ATTITUDE.{theirs}")
    _air(log, found)
    path = log.first("GLOBAL_POSITION_INT")
    if path is not None:
        for ours, theirs in (("v_north_mps", "vx"), ("v_east_mps", "vy"), ("v_down_mps", "vz")):
            found.add(ours, path.t_s, 0.01 * _field(path, theirs), f"GLOBAL_POSITION_INT.{theirs}")
    _outputs(log, found)
    return found


def _field(messages: Messages, name: str, gain: float = 1.0) -> Array:
    values = messages.fields[name]
    if values.dtype == np.float32 or values.dtype.itemsize <= np.dtype(np.int16).itemsize:
        # Single precision holds what the message has: of a gigabyte twice is too much.
        return np.asarray(np.multiply(values, np.float32(gain), dtype=np.float32))
    return numbers(values) * gain


def _inertial(log: AutopilotLog, found: Channels) -> None:
    able = [(m, n, gain) for n, gain in IMUS if (m := log.first(n)) is not None and len(m) > 1]
    att = log.first("ATTITUDE")
    if able:
        # Raw before scaled; a faster one before a slower.
        imu, name, gain = max(able, key=lambda one: round(len(one[0]) / len(able[0][0]), 1))
        force = gain * (GRAVITY_MPS2 if gain == MILLI else 1.0)
        for axis in "xyz":
            found.add(
                f"a{axis}_mps2", imu.t_s, force * _field(imu, f"{axis}acc"), f"{name}.{axis}acc"
            )
        if att is None or len(imu) >= 0.9 * len(att):
            for ours, axis in zip("pqr", "xyz", strict=True):
                values = gain * _field(imu, f"{axis}gyro")
                found.add(f"{ours}_radps", imu.t_s, values, f"{name}.{axis}gyro")
    if "p_radps" not in found.signals and att is not None:
        for ours, theirs in zip("pqr", ("rollspeed", "pitchspeed", "yawspeed"), strict=True):
            found.add(f"{ours}_radps", att.t_s, _field(att, theirs), f"ATTITUDE.{theirs}")


def _air(log: AutopilotLog, found: Channels) -> None:
    pressure, hud = log.first("SCALED_PRESSURE"), log.first("VFR_HUD")
    if pressure is not None:
        static = np.multiply(_field(pressure, "press_abs"), PASCALS, dtype=np.float64)
        found.add("static_pa", pressure.t_s, static, "SCALED_PRESSURE.press_abs")
        warm_k = np.add(_field(pressure, "temperature", 0.01), KELVIN, dtype=np.float64)
        rho = density_kgpm3(static, warm_k)
        found.add("density_kgpm3", pressure.t_s, rho, "SCALED_PRESSURE")
    differential = None if pressure is None else np.ptp(_field(pressure, "press_diff"))
    if hud is None or (differential is not None and differential == 0.0):
        return  # without a pitot VFR_HUD's airspeed is made of ground speed and wind
    indicated = _field(hud, "airspeed")
    share = found.true_over_indicated(hud.t_s)
    found.add("airspeed_mps", hud.t_s, indicated * share, "VFR_HUD.airspeed, true")
    found.add("qbar_pa", hud.t_s, 0.5 * STANDARD_DENSITY_KGPM3 * indicated**2, "VFR_HUD.airspeed")


def _outputs(log: AutopilotLog, found: Channels) -> None:
    out = log.first("SERVO_OUTPUT_RAW")
    if out is None:
        return
    pulses = {
        k: _field(out, f"servo{k}_raw")
        for k in range(1, MOST_SERVOS + 1)
        if f"servo{k}_raw" in out.fields
    }
    made, by = _surfaces(log, out.t_s, pulses)
    found.output_period_s = 1.0 / max(log.parameters.get("SERVO_RATE", SERVO_HZ), 1.0)
    for name, share in made.shares.items():
        found.add(name, out.t_s, share, made.made_of[name])
    found.clipped |= {name: many for name, many in made.clipped.items() if many}
    if made.made_of:
        said = "; ".join(f"{name} of {how}" for name, how in made.made_of.items())
        found.notes.append(f"surfaces by {by} parameters: {said}")
    if SURFACES & made.shares.keys():
        return
    if log.autopilot == "px4":
        found.unknown_outputs = "no CA_SV_CSn_TYPE with a PWM_MAIN_FUNCn for it came over the radio"
    elif not log.parameters:
        found.unknown_outputs = "no SERVOn_FUNCTION came over the radio"
    else:
        found.unknown_outputs = unknown_outputs(pulses, log.parameters)


def _surfaces(log: AutopilotLog, t_s: Array, pulses: Mapping[int, Array]) -> tuple[Outputs, str]:
    """Return the surfaces behind pulses, and which parameters said so."""

    def made(rows: slice, stood: Mapping[str, float]) -> Outputs:
        own = {k: values[rows] for k, values in pulses.items()}
        if log.autopilot == "px4":
            return surfaces_of_pulses(own, stood)
        return surfaces({k: v for k, v in own.items() if moves_a_surface(k, stood)}, stood)

    by = "PWM_ and CA_SV_" if log.autopilot == "px4" else "SERVOn_"
    return made_of_outputs(t_s, log.parameters, made), by

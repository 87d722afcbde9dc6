"""Propeller and motor: thrust and torque by advance ratio, shaft power by throttle."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from host.aircraft.airframe import Airframe, Array
from host.compiled import compiled_fast, compiled_part

FASTEST_RADPS, BISECTIONS = 4000.0, 40  # 38 000 rpm
WORTH_COMPILING = 1e5  # steps of the rotor, half a second of Python


class RotorInputs(NamedTuple):
    """Throttle, axial airspeed and density of a flight, each shape (n,)."""

    throttle: Array
    axial_mps: Array
    density_kgpm3: Array


@compiled_part
def polynomial(coefficients: Array, x: float) -> float:
    """Evaluate a polynomial given from the highest power down."""
    y = 0.0
    for c in coefficients:
        y = y * x + c
    return y


@compiled_part
def propeller(
    frame: Airframe, rotor_radps: float, axial_mps: float, density_kgpm3: float
) -> tuple[float, float]:
    """Return thrust (N) and the torque the air takes from the rotor (N m).

    The advance ratio is clamped to the range of the polynomials; beyond it (a rotor that slows
    down or stands) the drag of the stopped blades comes in as the rotor falls below the clamped
    speed.
    """
    n = max(rotor_radps, 0.0) / (2.0 * math.pi)
    d = frame.propeller_diameter_m
    v = max(axial_mps, 0.0)
    limit = frame.advance_ratio_max
    advance = limit
    if v < limit * n * d:
        advance = v / (n * d)
    scale = density_kgpm3 * n * n * d**4
    thrust = scale * polynomial(frame.ct_polynomial, advance)
    torque = scale * d * polynomial(frame.cp_polynomial, advance) / (2.0 * math.pi)
    stopped = 0.0
    if v > limit * n * d:
        stopped = 1.0 - limit * n * d / v
    thrust -= 0.5 * density_kgpm3 * v * v * frame.stopped_drag_area_m2 * stopped
    return thrust, torque


@compiled_part
def motor_torque(frame: Airframe, throttle: float, rotor_radps: float) -> float:
    """Return the torque of motor, friction and brake on the rotor (N m): shaft power over speed,
    current-limited."""
    power = max(polynomial(frame.motor_power_polynomial_w, min(max(throttle, 0.0), 1.0)), 0.0)
    if throttle <= 0.0:
        power = 0.0
    drive = min(power / max(rotor_radps, 1.0), frame.motor_torque_max_nm)
    # A controller brakes at zero throttle. Friction fades out at standstill: it never turns it
    # back.
    hold = frame.brake_torque_nm if throttle <= 0.0 else frame.friction_torque_nm
    friction = hold * min(max(rotor_radps, 0.0) / 5.0, 1.0)
    return drive - friction


def rotor_history(
    frame: Airframe, inputs: RotorInputs, start_radps: float, part_s: float, parts: int
) -> Array:
    """Run the rotor through a flight.

    Parameters
    ----------
    frame : Airframe
    inputs : RotorInputs
    start_radps : float
        Rotor speed before the first sample.
    part_s, parts : float, int
        Length of an Euler step, and steps in a sample.

    Returns
    -------
    Array, shape (3, n)
        Thrust (N), rotor speed (rad/s) and motor torque (N m).
    """
    if rotor_steps.pays(len(inputs.throttle) * parts, WORTH_COMPILING):
        return rotor_steps(frame, inputs, start_radps, part_s, parts)
    # Half the time of the same steps on scalars of numpy.
    curves = ("ct_polynomial", "cp_polynomial", "motor_power_polynomial_w")
    lists: Any = {name: tuple(getattr(frame, name).tolist()) for name in curves}
    plain = frame._replace(**lists)
    columns = RotorInputs(*(column.tolist() for column in inputs))
    return np.asarray(rotor_steps.function(plain, columns, start_radps, part_s, parts))


@compiled_fast
def rotor_steps(
    frame: Airframe, inputs: RotorInputs, start_radps: float, part_s: float, parts: int
) -> Array:
    """Do the work of `rotor_history`; columns and polynomials may be lists in Python."""
    result = np.empty((3, len(inputs.throttle)))
    speed, push, torque = start_radps, 0.0, 0.0
    for i in range(len(inputs.throttle)):
        for _ in range(parts):
            push, load = propeller(frame, speed, inputs.axial_mps[i], inputs.density_kgpm3[i])
            torque = motor_torque(frame, inputs.throttle[i], speed)
            speed = max(speed + part_s * (torque - load) / frame.rotor_inertia_kgm2, 0.0)
        result[0, i], result[1, i], result[2, i] = push, speed, torque
    return result


def thrust_of_power(
    frame: Airframe, power_w: Array, axial_mps: Array, density_kgpm3: Array
) -> Array:
    """Return the thrust (N) of a rotor that takes a shaft power, settled, each (n,).

    The rotor speed is where the torque of the air times it is the power, by bisection.
    """
    d, limit, v = frame.propeller_diameter_m, frame.advance_ratio_max, np.maximum(axial_mps, 0.0)
    low, high = np.zeros(len(power_w)), np.full(len(power_w), FASTEST_RADPS)
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        n = middle / (2.0 * math.pi)
        advance = np.minimum(v / (n * d), limit)
        taken = density_kgpm3 * n**3 * d**5 * np.polyval(frame.cp_polynomial, advance)
        low, high = np.where(taken > power_w, low, middle), np.where(taken > power_w, middle, high)
    n = 0.5 * (low + high) / (2.0 * math.pi)
    advance = np.minimum(v / (n * d), limit)
    stopped = np.maximum(1.0 - limit * n * d / np.maximum(v, 1e-9), 0.0)
    thrust = density_kgpm3 * n**2 * d**4 * np.polyval(frame.ct_polynomial, advance)
    drag = 0.5 * density_kgpm3 * v**2 * frame.stopped_drag_area_m2 * stopped
    return np.asarray(thrust - drag, dtype=np.float64)

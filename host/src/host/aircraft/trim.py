"""Trim: the steady flight from which a maneuver starts."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq, least_squares

from host.aircraft.airframe import (
    AILERON,
    COMMAND_COUNT,
    ELEVATOR,
    Q0,
    ROTOR,
    RUDDER,
    STATE_COUNT,
    Airframe,
    Array,
    P,
    R,
    U,
    W,
)  # fmt: skip
from host.aircraft.attitude import quaternion
from host.aircraft.propulsion import motor_torque, propeller
from host.aircraft.rigid_body import derivative
from host.errors import UsageError


class TrimError(UsageError):
    """No steady flight exists at the requested condition."""


@dataclass(frozen=True, slots=True)
class Trim:
    """Steady, straight flight without sideslip; a slight bank balances the rotor's torque.

    Attributes
    ----------
    airspeed_mps, alpha_rad, bank_rad, climb_rad, density_kgpm3 : float
    command : (4,) array
        Elevator, aileron, rudder (rad), throttle (0..1).
    state : (17,) array
        Heading north, at the origin.
    residual : float
        Largest of the six accelerations left over (m/s2, rad/s2).
    """

    airspeed_mps: float
    alpha_rad: float
    bank_rad: float
    climb_rad: float
    density_kgpm3: float
    command: Array
    state: Array
    residual: float


def solve(
    frame: Airframe,
    airspeed_mps: float,
    *,
    climb_rad: float = 0.0,
    density_kgpm3: float = 1.225,
    motor: bool = True,
) -> Trim:
    """Find the trim at one airspeed.

    Parameters
    ----------
    frame : Airframe
    airspeed_mps : float
        True airspeed.
    climb_rad : float
        Flight-path angle; ignored without motor, where it is the answer.
    density_kgpm3 : float
    motor : bool
        False: the rotor stands still and the glide angle is found.

    Returns
    -------
    Trim

    Raises
    ------
    TrimError
        The residual stays above 1e-6, a surface limit or full power is passed.
    """
    if frame.linear > 0.0:
        return _steady(frame, density_kgpm3)
    still_air = np.zeros(9)

    def place(unknown: Array) -> tuple[Array, Array, float]:
        alpha, phi, elevator, aileron, rudder, last = unknown
        gamma = climb_rad if motor else last
        rotor = last if motor else 0.0
        x = np.zeros(STATE_COUNT)
        x[U] = airspeed_mps * math.cos(alpha)
        x[W] = airspeed_mps * math.sin(alpha)
        # Without sideslip sin(gamma) = sin(theta) cos(alpha) - cos(phi) cos(theta) sin(alpha).
        lean = math.atan(math.cos(phi) * math.tan(alpha))
        size = math.hypot(math.cos(alpha), math.cos(phi) * math.sin(alpha))
        x[Q0 : Q0 + 4] = quaternion(phi, lean + math.asin(math.sin(gamma) / size), 0.0)
        x[ELEVATOR], x[AILERON], x[RUDDER], x[ROTOR] = elevator, aileron, rudder, rotor
        axis = frame.thrust_axis
        load = propeller(frame, rotor, x[U] * axis[0] + x[W] * axis[2], density_kgpm3)[1]
        return x, np.array([elevator, aileron, rudder, 0.0]), load

    def throttle(rotor: float, load: float) -> float:
        def surplus(setting: float) -> float:
            return motor_torque(frame, setting, rotor) - load

        if surplus(1.0) < 0.0:
            return 1.0
        return float(brentq(surplus, 1e-9, 1.0, xtol=1e-14))

    def residual(unknown: Array) -> Array:
        x, command, load = place(unknown)
        if motor:
            command[3] = throttle(x[ROTOR], load)
        out = np.empty(STATE_COUNT + 4)
        derivative(frame, x, command, still_air, density_kgpm3, out)
        return np.concatenate([out[U : W + 1], out[P : R + 1]])

    guess = np.array(
        [0.1, 0.0, -0.1, 0.0, 0.0, airspeed_mps / (0.4 * frame.propeller_diameter_m) * 2 * math.pi]
    )
    if not motor:
        guess[5] = -0.15
    scale = [0.1, 0.1, 0.1, 0.1, 0.1, max(abs(guess[5]), 0.1)]
    try:
        fit = least_squares(residual, guess, x_scale=scale, xtol=1e-15, ftol=1e-15, gtol=1e-15)
    except ValueError:  # no throttle balances the propeller's torque, or a number is NaN
        raise TrimError(
            f"no trim at {airspeed_mps:.1f} m/s: no throttle balances the propeller"
        ) from None
    x, command, load = place(fit.x)
    if motor:
        command[3] = throttle(x[ROTOR], load)
    left = float(np.max(np.abs(residual(fit.x))))
    if not left <= 1e-6:
        raise TrimError(
            f"no trim at {airspeed_mps:.1f} m/s: {left:.2g} m/s2 or rad/s2 left, expected 1e-6"
        )
    if np.any(np.abs(command[:3]) > frame.surface_limit_rad) or command[3] >= 1.0:
        raise TrimError(f"no trim at {airspeed_mps:.1f} m/s: surface limit or full power passed")
    assert command.shape == (COMMAND_COUNT,)
    return Trim(
        airspeed_mps=airspeed_mps,
        alpha_rad=float(fit.x[0]),
        bank_rad=float(fit.x[1]),
        climb_rad=climb_rad if motor else float(fit.x[5]),
        density_kgpm3=density_kgpm3,
        command=command,
        state=x,
        residual=left,
    )


def _steady(frame: Airframe, density_kgpm3: float) -> Trim:
    """Return the one steady flight of a linear aircraft, level."""
    u, w, elevator, throttle = frame.steady.tolist()
    alpha = math.atan2(w, u)
    x = np.zeros(STATE_COUNT)
    x[U], x[W], x[ELEVATOR] = u, w, elevator
    x[Q0 : Q0 + 4] = quaternion(0.0, alpha, 0.0)
    command = np.array([elevator, 0.0, 0.0, throttle])
    out = np.empty(STATE_COUNT + 4)
    derivative(frame, x, command, np.zeros(9), density_kgpm3, out)
    return Trim(
        airspeed_mps=math.hypot(u, w),
        alpha_rad=alpha,
        bank_rad=0.0,
        climb_rad=0.0,
        density_kgpm3=density_kgpm3,
        command=command,
        state=x,
        residual=float(np.max(np.abs(out[U : R + 1]))),
    )

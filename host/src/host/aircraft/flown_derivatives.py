"""Dimensional derivatives of an aircraft at the condition that it was flown in, and their modes.

A trim at the same airspeed has another angle of attack and elevator than a maneuver had in the
mean, and coefficients change with both. The rotor is settled: its speed follows the airspeed within
a sixth of a second (the 25e), well before the airspeed itself has changed. Holding it doubles the
damping of the phugoid.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

from host.aircraft.airframe import (
    ELEVATOR,
    Q0,
    ROTOR,
    STATE_COUNT,
    Airframe,
    Array,
    P,
    R,
    U,
    W,
)
from host.aircraft.attitude import quaternion
from host.aircraft.linearisation import Linear, Mode, modes
from host.aircraft.propulsion import FASTEST_RADPS, motor_torque, propeller
from host.aircraft.rigid_body import derivative

AIRSPEED_WIDTH_MPS = 0.1
STANDING_RADPS = 1e-3
LONGITUDINAL = ("V", "alpha", "q", "de")
LATERAL = ("beta", "p", "r", "da", "dr")
# Places of these in the point that is varied: airspeed, alpha, beta, rates, surfaces.
PLACES = dict(zip(("V", "alpha", "beta", "p", "q", "r", "de", "da", "dr"), range(9), strict=True))


@dataclass(frozen=True, slots=True)
class FlownCondition:
    """The mean condition of a maneuver: m/s, rad, N, kg/m3.

    Attributes
    ----------
    surfaces_rad : tuple of float
        Elevator, aileron, rudder.
    """

    airspeed_mps: float
    alpha_rad: float
    beta_rad: float
    surfaces_rad: tuple[float, float, float]
    thrust_n: float
    density_kgpm3: float


def flown_derivatives(
    frame: Airframe, at: FlownCondition, width_rad: float = 0.01
) -> dict[str, float]:
    """Return dimensional derivatives by central differences of all forces, thrust included.

    Parameters
    ----------
    frame : Airframe
    at : FlownCondition
    width_rad : float
        Half-width of the difference in angles and surfaces, and in p_hat, q_hat, r_hat.

    Returns
    -------
    dict
        ``D_`` along and ``Z_`` normal to the path over the airspeed, ``M_`` by V, alpha, q, de;
        ``Y_`` over the airspeed, ``L_``, ``N_`` by beta, p, r, da, dr. SI, radians.
    """
    throttle = _throttle(frame, at)
    point = np.array([at.airspeed_mps, at.alpha_rad, at.beta_rad, 0.0, 0.0, 0.0, *at.surfaces_rad])
    by_rate = 2.0 * at.airspeed_mps * width_rad
    width = np.full(len(point), width_rad)
    width[0] = AIRSPEED_WIDTH_MPS
    width[3:6] = by_rate / np.array([frame.span_m, frame.chord_m, frame.span_m])
    found: dict[str, float] = {}
    for rows, names in (("DZM", LONGITUDINAL), ("YLN", LATERAL)):
        for name in names:
            step = float(width[PLACES[name]])
            shift = np.zeros(len(point))
            shift[PLACES[name]] = step
            up, down = (_forces(frame, x, at, throttle) for x in (point + shift, point - shift))
            for row in rows:
                slope = (up[row] - down[row]) / (2.0 * step)
                found[f"{row}_{name}"] = slope / (at.airspeed_mps if row in "ZY" else 1.0)
    return found


def flown_modes(
    derivatives: dict[str, float], at: FlownCondition, gravity_mps2: float
) -> list[Mode]:
    """Return the modes about level flight at the condition, as `linearisation.modes` names them.

    Parameters
    ----------
    derivatives : dict
        From `flown_derivatives`.
    at : FlownCondition
    gravity_mps2 : float
    """
    d = derivatives
    longitudinal = np.array(
        [
            [d["D_V"], d["D_alpha"] + gravity_mps2, d["D_q"], -gravity_mps2],
            [d["Z_V"], d["Z_alpha"], 1.0 + d["Z_q"], 0.0],
            [d["M_V"], d["M_alpha"], d["M_q"], 0.0],
            [0.0, 0.0, 1.0, 0.0],
        ]
    )
    lateral = np.array(
        [
            [
                d["Y_beta"],
                d["Y_p"] + math.sin(at.alpha_rad),
                d["Y_r"] - math.cos(at.alpha_rad),
                gravity_mps2 * math.cos(at.alpha_rad) / at.airspeed_mps,
            ],
            [d["L_beta"], d["L_p"], d["L_r"], 0.0],
            [d["N_beta"], d["N_p"], d["N_r"], 0.0],
            [0.0, 1.0, math.tan(at.alpha_rad), 0.0],
        ]
    )
    return modes(Linear(longitudinal, np.zeros((4, 1)), lateral, np.zeros((4, 2))))


def _forces(frame: Airframe, point: Array, at: FlownCondition, throttle: float) -> dict[str, float]:
    """Return specific force along, normal to and across the path, and angular accelerations."""
    speed, alpha, beta = (float(x) for x in point[:3])
    x = np.zeros(STATE_COUNT)
    x[U : W + 1] = speed * np.array(
        [math.cos(alpha) * math.cos(beta), math.sin(beta), math.sin(alpha) * math.cos(beta)]
    )
    x[P : R + 1] = point[3:6]
    x[Q0 : Q0 + 4] = quaternion(0.0, alpha, 0.0)
    x[ELEVATOR : ELEVATOR + 3] = point[6:9]
    x[ROTOR] = _rotor_radps(frame, throttle, float(x[U]), float(x[W]), at.density_kgpm3)
    out = np.empty(STATE_COUNT + 4)
    command = np.array([*point[6:9], throttle])
    derivative(frame, x, command, np.zeros(9), at.density_kgpm3, out)
    ax, ay, az = out[STATE_COUNT : STATE_COUNT + 3].tolist()
    ca, sa, cb, sb = math.cos(alpha), math.sin(alpha), math.cos(beta), math.sin(beta)
    return {
        "D": (ax * ca + az * sa) * cb + ay * sb,
        "Z": az * ca - ax * sa,
        "Y": ay * cb - (ax * ca + az * sa) * sb,
        "L": float(out[P]),
        "M": float(out[P + 1]),
        "N": float(out[R]),
    }


def _axial(frame: Airframe, u: float, w: float) -> float:
    return u * float(frame.thrust_axis[0]) + w * float(frame.thrust_axis[2])


def _throttle(frame: Airframe, at: FlownCondition) -> float:
    """Return the throttle that holds the thrust that was flown; 0 of a rotor that stands."""
    if frame.linear > 0.0:
        return float(frame.steady[3])
    u, w = (at.airspeed_mps * f(at.alpha_rad) for f in (math.cos, math.sin))

    def short(throttle: float) -> float:
        rotor = _rotor_radps(frame, throttle, u, w, at.density_kgpm3)
        return propeller(frame, rotor, _axial(frame, u, w), at.density_kgpm3)[0] - at.thrust_n

    if at.thrust_n <= 0.0:
        return 0.0
    return 1.0 if short(1.0) < 0.0 else float(brentq(short, 1e-6, 1.0, xtol=1e-12))


def _rotor_radps(frame: Airframe, throttle: float, u: float, w: float, density: float) -> float:
    """Return the speed at which motor and air hold the rotor."""
    if frame.linear > 0.0 or throttle <= 0.0:
        return 0.0

    def surplus(rotor: float) -> float:
        load = propeller(frame, rotor, _axial(frame, u, w), density)[1]
        return motor_torque(frame, throttle, rotor) - load

    if surplus(STANDING_RADPS) < 0.0:
        return 0.0
    return float(brentq(surplus, STANDING_RADPS, FASTEST_RADPS, xtol=1e-9))

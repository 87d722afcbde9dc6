"""Dimensional derivatives written out by hand from the coefficients: the check on the
linearisation.

Nothing is shared with `rigid_body` or `linearisation`: tables are interpolated here, and slopes are
formulas. Etkin & Reid, Dynamics of Flight, chapter 4, turned from stability to body axes; CG at the
reference point.
"""

from __future__ import annotations

import numpy as np
from host.aircraft.airframe import Array
from host.aircraft.file import Aircraft
from host.constants import GRAVITY_MPS2


def analytic_matrices(
    aircraft: Aircraft,
    *,
    airspeed_mps: float,
    alpha_rad: float,
    theta_rad: float,
    elevator_rad: float,
    rotor_radps: float,
    density_kgpm3: float = 1.225,
) -> tuple[Array, Array, Array, Array]:
    """Return longitudinal A, B (u w q theta; elevator) and lateral A, B (v p r phi; aileron
    rudder).

    Parameters
    ----------
    aircraft : Aircraft
        Alpha between two nodes of its table and short of the stall.
    airspeed_mps, alpha_rad, theta_rad, elevator_rad, rotor_radps, density_kgpm3 : float
        The trim; wings level.

    Returns
    -------
    (4, 4), (4, 1), (4, 4), (4, 2) arrays
        SI, radians.
    """
    g = aircraft.scalar
    nodes = aircraft.vector("aerodynamics.alpha_rad")

    def c(name: str) -> float:
        return float(np.interp(alpha_rad, nodes, aircraft.vector(f"aerodynamics.{name}")))

    def slope(name: str) -> float:
        i = int(np.clip(np.searchsorted(nodes, alpha_rad) - 1, 0, len(nodes) - 2))
        column = aircraft.vector(f"aerodynamics.{name}")
        return float((column[i + 1] - column[i]) / (nodes[i + 1] - nodes[i]))

    v, rho = airspeed_mps, density_kgpm3
    sa, ca = np.sin(alpha_rad), np.cos(alpha_rad)
    u0, w0 = v * ca, v * sa
    s, b, chord = (
        g("geometry.wing_area_m2"), g("geometry.span_m"), g("geometry.chord_m"),
    )  # fmt: skip
    m, ixx, iyy, izz, ixz = (
        g(f"mass.{k}") for k in ("mass_kg", "ixx_kgm2", "iyy_kgm2", "izz_kgm2", "ixz_kgm2")
    )
    qs = 0.5 * rho * v * v * s

    cl = c("cl_0") + c("cl_alpha") * alpha_rad + c("cl_elevator") * elevator_rad
    cl_a = (
        c("cl_alpha") + slope("cl_0") + slope("cl_alpha") * alpha_rad
        + slope("cl_elevator") * elevator_rad
    )  # fmt: skip
    k = g("aerodynamics.induced_factor")
    cd = g("aerodynamics.cd_0") + k * cl * cl + c("cd_elevator") * elevator_rad
    cd_a = 2 * k * cl * cl_a + slope("cd_elevator") * elevator_rad
    cm = c("cm_0") + c("cm_alpha") * alpha_rad + c("cm_elevator") * elevator_rad
    cm_a = (
        c("cm_alpha") + slope("cm_0") + slope("cm_alpha") * alpha_rad
        + slope("cm_elevator") * elevator_rad
    )  # fmt: skip
    cx, cz = -cd * ca + cl * sa, -cd * sa - cl * ca
    cx_a = -cd_a * ca + cd * sa + cl_a * sa + cl * ca
    cz_a = -cd_a * sa - cd * ca - cl_a * ca + cl * sa
    cd_de = c("cd_elevator") + 2 * k * cl * c("cl_elevator")
    cx_q, cz_q = c("cl_q") * sa, -c("cl_q") * ca
    cx_de = -cd_de * ca + c("cl_elevator") * sa
    cz_de = -cd_de * sa - c("cl_elevator") * ca

    # Thrust against airspeed along its axis: T = rho n^2 d^4 CT(J), dJ/dV = 1/(n d).
    d = g("propulsion.diameter_m")
    n = rotor_radps / (2 * np.pi)
    tilt = g("propulsion.thrust_pitch_rad")
    tx, tz = np.cos(tilt), -np.sin(tilt)
    ct = np.poly1d(aircraft.vector("propulsion.ct_polynomial"))
    thrust_v = rho * n * d**3 * float(np.polyval(ct.deriv(), (u0 * tx + w0 * tz) / (n * d)))
    hub = aircraft.vector("propulsion.hub_m")
    arm = hub[2] * tx - hub[0] * tz  # pitching moment per newton of thrust

    # Per unit of u: dV = cos(alpha), d alpha = -sin(alpha)/V; of w: sin(alpha), cos(alpha)/V.
    def per_u(value: float, value_a: float) -> float:
        return float(qs / v * (2 * value * ca - value_a * sa))

    def per_w(value: float, value_a: float) -> float:
        return float(qs / v * (2 * value * sa + value_a * ca))

    rate = chord / (2 * v)
    lon_a = np.array(
        [
            [
                (per_u(cx, cx_a) + thrust_v * tx * tx) / m,
                (per_w(cx, cx_a) + thrust_v * tx * tz) / m,
                qs * rate * cx_q / m - w0,
                -GRAVITY_MPS2 * np.cos(theta_rad),
            ],
            [
                (per_u(cz, cz_a) + thrust_v * tz * tx) / m,
                (per_w(cz, cz_a) + thrust_v * tz * tz) / m,
                qs * rate * cz_q / m + u0,
                -GRAVITY_MPS2 * np.sin(theta_rad),
            ],
            [
                (chord * per_u(cm, cm_a) + arm * thrust_v * tx) / iyy,
                (chord * per_w(cm, cm_a) + arm * thrust_v * tz) / iyy,
                qs * chord * rate * c("cm_q") / iyy,
                0.0,
            ],
            [0.0, 0.0, 1.0, 0.0],
        ]
    )
    lon_b = np.array(
        [[qs * cx_de / m], [qs * cz_de / m], [qs * chord * c("cm_elevator") / iyy], [0.0]]
    )

    def lateral(per_side: float, per_roll: float, per_yaw: float, scale: float) -> list[float]:
        det = ixx * izz - ixz * ixz
        roll, yaw = qs * b * per_roll * scale, qs * b * per_yaw * scale
        return [
            qs * per_side * scale / m,
            (izz * roll + ixz * yaw) / det,
            (ixz * roll + ixx * yaw) / det,
        ]

    span_rate = b / (2 * v)
    by_v = lateral(c("cy_beta"), c("croll_beta"), c("cn_beta"), 1 / v)
    by_p = lateral(c("cy_p"), c("croll_p"), c("cn_p"), span_rate)
    by_r = lateral(c("cy_r"), c("croll_r"), c("cn_r"), span_rate)
    by_da = lateral(c("cy_aileron"), c("croll_aileron"), c("cn_aileron"), 1.0)
    by_dr = lateral(c("cy_rudder"), c("croll_rudder"), c("cn_rudder"), 1.0)
    lat_a = np.array(
        [
            [by_v[0], by_p[0] + w0, by_r[0] - u0, GRAVITY_MPS2 * np.cos(theta_rad)],
            [by_v[1], by_p[1], by_r[1], 0.0],
            [by_v[2], by_p[2], by_r[2], 0.0],
            [0.0, 1.0, np.tan(theta_rad), 0.0],
        ]
    )
    lat_b = np.array([[by_da[i], by_dr[i]] for i in range(3)] + [[0.0, 0.0]])
    return lon_a, lon_b, lat_a, lat_b

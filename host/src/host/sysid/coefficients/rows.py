"""Equations that hold at every sample: coefficients of force and moment, and kinematics.

Each is a left side and named regressors; the kinematic ones have none and tell instrument errors
apart. Stevens & Lewis, ch. 1; signs and axes of the house.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from host.compiled import Array
from host.sysid.aircraft.airframe import AirframeData
from host.sysid.aircraft.powerplant import Powerplant
from host.sysid.compatibility.signals import Record

GRAVITY_MPS2 = 9.80665
# Roll under the elevator: lift beside a CG off the plane of symmetry, its only clear trace.
LONGITUDINAL = ("CL", "CD", "Cm", "Cl", "w", "u")
LATERAL = ("CY", "Cl", "Cn", "v")
KINEMATIC = ("u", "v", "w")


@dataclass(frozen=True, slots=True)
class Flown:
    """What goes with the signals of one flight: thrust, spin, motor torque, attitude, each (n,)."""

    thrust_n: Array
    spin_radps: Array
    drive_nm: Array
    phi_rad: Array
    theta_rad: Array


@dataclass(frozen=True, slots=True)
class Equation:
    """Left side (n,) and regressors (n,) by name."""

    left: Array
    terms: dict[str, Array]


def equations(
    record: Record,
    s: Mapping[str, Array],
    errors: Mapping[str, float],
    flown: Flown,
    airframe: AirframeData,
    plant: Powerplant,
    trim_alpha_rad: float,
) -> dict[str, Equation]:
    """Return every equation of a flight for assumed instrument errors.

    Parameters
    ----------
    record : Record
    s : mapping
        Of `coefficient_signals.corrected`.
    errors : mapping
        Of the mass properties and the thrust.
    flown : Flown
    airframe : AirframeData
    plant : Powerplant
    trim_alpha_rad : float
        Where the drag polar's curvature is taken out.
    """
    e = errors
    mass = airframe.mass_kg * (1.0 + e["mass_share"])
    ixx = airframe.ixx_kgm2 * (1.0 + e["ixx_share"])
    iyy = airframe.iyy_kgm2 * (1.0 + e["iyy_share"])
    izz = airframe.izz_kgm2 * (1.0 + e["izz_share"])
    ixz = airframe.ixz_kgm2
    S, b, c = airframe.wing_area_m2, airframe.span_m, airframe.chord_m
    thrust = flown.thrust_n * (1.0 + e["thrust_share"])
    tx, tz = thrust * plant.axis[0], thrust * plant.axis[2]
    spin = plant.rotor_kgm2 * flown.spin_radps
    hx, hz = spin * plant.axis[0], spin * plant.axis[2]
    p, q, r, V = s["p"], s["q"], s["r"], s["V"]
    X, Y, Z = mass * s["ax"] - tx, mass * s["ay"], mass * s["az"] - tz
    force = s["qbar"] * S
    ca, sa = np.cos(s["alpha"]), np.sin(s["alpha"])
    arm_x, arm_z = plant.hub_m[0] - e["cg_x_m"], plant.hub_m[2] - e["cg_z_m"]
    roll = ixx * s["pd"] - ixz * (s["rd"] + p * q) + (izz - iyy) * q * r + q * hz
    roll += flown.drive_nm * plant.axis[0]
    pitch = iyy * s["qd"] + (ixx - izz) * p * r + ixz * (p * p - r * r) + r * hx - p * hz
    pitch -= arm_z * tx - arm_x * tz
    yaw = izz * s["rd"] - ixz * (s["pd"] - q * r) + (iyy - ixx) * p * q - q * hx
    yaw += flown.drive_nm * plant.axis[2]
    # About the plane of symmetry, where neither lift nor drag rolls or yaws: a CG 8 mm beside it
    # makes Cl_alpha -0.024, which left out drew Cl_r by 4 %.
    roll += e["cg_y_m"] * mass * s["az"]
    yaw -= e["cg_y_m"] * mass * s["ax"]
    de, alpha = s["de"], s["alpha"]
    along = {"alpha": alpha, "q": 0.5 * q * c / V, "de": de}
    bent, moved = alpha - trim_alpha_rad, de - float(np.mean(de))
    drag = {
        "alpha": alpha, "de": de, "alpha2": bent**2, "alpha_de": bent * moved, "de2": moved**2,
    }  # fmt: skip
    across = {
        "beta": s["beta"], "p": 0.5 * p * b / V, "r": 0.5 * r * b / V, "da": s["da"], "dr": s["dr"],
    }  # fmt: skip
    u, v, w = V * ca * np.cos(s["beta"]), V * np.sin(s["beta"]), V * sa * np.cos(s["beta"])
    phi, theta = flown.phi_rad, flown.theta_rad
    gx = -GRAVITY_MPS2 * np.sin(theta)
    gy = GRAVITY_MPS2 * np.sin(phi) * np.cos(theta)
    gz = GRAVITY_MPS2 * np.cos(phi) * np.cos(theta)
    return {
        "CL": Equation(-(Z * ca - X * sa) / force, along),
        "CD": Equation(-(X * ca + Z * sa) / force, drag),
        "Cm": Equation(pitch / (force * c), along),
        "CY": Equation(Y / force, across),
        "Cl": Equation(roll / (force * b), across),
        "Cn": Equation(yaw / (force * b), across),
        "u": Equation(record.rate(u) - (s["ax"] + gx - q * w + r * v), {}),
        "v": Equation(record.rate(v) - (s["ay"] + gy - r * u + p * w), {}),
        "w": Equation(record.rate(w) - (s["az"] + gz + q * u - p * v), {}),
    }

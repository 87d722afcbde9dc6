"""Equations that hold at every sample: coefficients of force and moment, and kinematics.

Each is a left side and named regressors; the kinematic ones have none and tell instrument errors
apart. Stevens & Lewis, ch. 1; signs and axes of the house.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace

import numpy as np

from host.aircraft.mass_properties import AirframeData
from host.aircraft.powerplant import Powerplant
from host.arrays import Array, IntArray
from host.constants import GRAVITY_MPS2
from host.sysid.coefficients.coefficient_model import CoefficientModel
from host.sysid.compatibility.inverse_sensor_model import Record

# Roll under the elevator: lift beside a CG off the plane of symmetry, its only clear trace.
LONGITUDINAL = ("Cm", "Cl", "w", "u")  # behind the model's two forces
LATERAL = ("CY", "Cl", "Cn", "v")
KINEMATIC = ("u", "v", "w")


@dataclass(frozen=True, slots=True)
class Flown:
    """What goes with the signals of one flight: thrust, spin, motor torque, attitude, airspeed over
    that of the maneuvers less one, airspeed along x behind that thrust, each (n,); how much more
    thrust it would be with airspeed (N per m/s) and with density (N per unit share)."""

    thrust_n: Array
    spin_radps: Array
    drive_nm: Array
    phi_rad: Array
    theta_rad: Array
    faster: Array
    flying_mps: Array
    pull: tuple[float, float]

    def at(self, samples: IntArray) -> Flown:
        """Return it at some samples."""
        cut = {f.name: getattr(self, f.name)[samples] for f in fields(self) if f.name != "pull"}
        return replace(self, **cut)


@dataclass(frozen=True, slots=True)
class Equation:
    """Left side (n,) and regressors (n,) by name."""

    left: Array
    terms: dict[str, Array]


@dataclass(frozen=True, slots=True)
class Equations:
    """All equations by row; lift and drag coefficients (n,), rows or not, at the same samples; mean
    specific force along the path of the whole flight (m/s2)."""

    rows: dict[str, Equation]
    lift: Array
    drag: Array
    along_mps2: float


def equations(
    model: CoefficientModel,
    record: Record,
    s: Mapping[str, Array],
    errors: Mapping[str, float],
    flown: Flown,
    airframe: AirframeData,
    plant: Powerplant,
    trim_alpha_rad: float,
    inside: IntArray | None = None,
) -> Equations:
    """Return every equation of a flight for assumed instrument errors.

    Parameters
    ----------
    model : CoefficientModel
        Whose terms the force and moment coefficients are made of.
    record : Record
    s : mapping
        Of `coefficient_signals.corrected`.
    errors : mapping
        Of the mass properties and the thrust.
    flown : Flown
    airframe : AirframeData
    plant : Powerplant
    trim_alpha_rad : float
        Where products of the angle of attack count from.
    inside : (m,) IntArray, optional
        Samples at which the equations are wanted; all by default. Speeds are differentiated over
        the whole flight.
    """
    e = errors
    about = {"alpha": trim_alpha_rad, "de": float(np.mean(s["de"]))}
    u, v, w = speeds(s)
    along = float(np.mean((u * s["ax"] + v * s["ay"] + w * s["az"]) / s["V"]))
    rising = [record.rate(x) for x in (u, v, w)]
    if inside is not None:
        s, flown = {name: values[inside] for name, values in s.items()}, flown.at(inside)
        u, v, w, *rising = (x[inside] for x in (u, v, w, *rising))
    mass = airframe.mass_kg * (1.0 + e["mass_share"])
    ixx = airframe.ixx_kgm2 * (1.0 + e["ixx_share"])
    iyy = airframe.iyy_kgm2 * (1.0 + e["iyy_share"])
    izz = airframe.izz_kgm2 * (1.0 + e["izz_share"])
    ixz = airframe.ixz_kgm2
    S, b, c = airframe.wing_area_m2, airframe.span_m, airframe.chord_m
    by_speed, by_density = flown.pull
    thrust = flown.thrust_n + by_speed * (s["V"] * np.cos(s["alpha"]) - flown.flying_mps)
    thrust = (thrust + by_density * e["density_share"]) * (1.0 + e["thrust_share"])
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
    lift, drag = -(Z * ca - X * sa) / force, -(X * ca + Z * sa) / force
    signals = {
        "alpha": s["alpha"], "beta": s["beta"],
        "p": 0.5 * p * b / V, "q": 0.5 * q * c / V, "r": 0.5 * r * b / V,
        "de": s["de"], "da": s["da"], "dr": s["dr"], "V": flown.faster, "CL": lift,
    }  # fmt: skip
    phi, theta = flown.phi_rad, flown.theta_rad
    gx = -GRAVITY_MPS2 * np.sin(theta)
    gy = GRAVITY_MPS2 * np.sin(phi) * np.cos(theta)
    gz = GRAVITY_MPS2 * np.cos(phi) * np.cos(theta)
    left = {
        "CL": lift, "CD": drag, "CZ": Z / force, "CX": X / force, "Cm": pitch / (force * c),
        "CY": Y / force, "Cl": roll / (force * b), "Cn": yaw / (force * b),
    }  # fmt: skip
    found = {
        row: Equation(left[row], {term.label: term.values(signals, about) for term in terms})
        for row, terms in model.rows.items()
    }
    found |= {
        "u": Equation(rising[0] - (s["ax"] + gx - q * w + r * v), {}),
        "v": Equation(rising[1] - (s["ay"] + gy - r * u + p * w), {}),
        "w": Equation(rising[2] - (s["az"] + gz + q * u - p * v), {}),
    }
    return Equations(found, lift, drag, along)


def speeds(s: Mapping[str, Array]) -> tuple[Array, Array, Array]:
    """Return speed through the air along x, y and z (m/s), each (n,)."""
    plane = s["V"] * np.cos(s["beta"])
    return plane * np.cos(s["alpha"]), s["V"] * np.sin(s["beta"]), plane * np.sin(s["alpha"])

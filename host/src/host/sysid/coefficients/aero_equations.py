"""Equations that hold at every sample: force and moment coefficients, and kinematics.

Each has a response and named regressors. The kinematic equations have no regressors: their response
is zero but for noise, gusts and sensor errors. Signs and axes are those of the house.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace

import numpy as np

from host.aircraft.mass_properties import AirframeData
from host.aircraft.powerplant import Powerplant
from host.arrays import Array, IntArray
from host.constants import GRAVITY_MPS2
from host.sysid.models.coefficient_model import CoefficientModel
from host.sysid.reconstruction.inverse_sensor_model import Record

# Roll in elevator maneuvers: lift of a CG off the plane of symmetry, its only clear trace.
LONGITUDINAL = ("Cm", "Cl", "w", "u")  # behind the model's two forces
LATERAL = ("CY", "Cl", "Cn", "v")
KINEMATIC = ("u", "v", "w")


@dataclass(frozen=True, slots=True)
class FlightHistory:
    """Columns of one flight besides the corrected signals, each (n,) unless stated.

    Attributes
    ----------
    thrust_n, spin_radps, drive_nm : Array
        Thrust, rotor speed and motor torque.
    phi_rad, theta_rad : Array
    airspeed_deviation : Array
        Airspeed over the mean of the maneuvers, less one.
    axial_mps : Array
        Airspeed along x that the thrust was computed with.
    thrust_slopes : tuple of float
        Derivative of the mean thrust by airspeed (N per m/s) and by density (N per unit share).
    """

    thrust_n: Array
    spin_radps: Array
    drive_nm: Array
    phi_rad: Array
    theta_rad: Array
    airspeed_deviation: Array
    axial_mps: Array
    thrust_slopes: tuple[float, float]

    def at(self, samples: IntArray) -> FlightHistory:
        """Return the history at some samples."""
        columns = [f.name for f in fields(self) if f.name != "thrust_slopes"]
        return replace(self, **{name: getattr(self, name)[samples] for name in columns})


@dataclass(frozen=True, slots=True)
class Equation:
    """Dependent variable (n,) and regressors (n,) by the label of their term."""

    response: Array
    regressors: dict[str, Array]


@dataclass(frozen=True, slots=True)
class Equations:
    """Equations of a flight, all at the same samples.

    Attributes
    ----------
    by_name : dict
    lift, drag : Array, shape (m,)
        CL and CD, whether the model has them or not.
    along_mps2 : float
        Mean specific force along the path of the whole flight.
    """

    by_name: dict[str, Equation]
    lift: Array
    drag: Array
    along_mps2: float


def equations(
    model: CoefficientModel,
    record: Record,
    s: Mapping[str, Array],
    errors: Mapping[str, float],
    history: FlightHistory,
    airframe: AirframeData,
    powerplant: Powerplant,
    trim_alpha_rad: float,
    inside: IntArray | None = None,
) -> Equations:
    """Return every equation of a flight for assumed sensor errors.

    Parameters
    ----------
    model : CoefficientModel
        Terms of the force and moment coefficients.
    record : Record
    s : mapping
        From `apply_sensor_errors`: SI signals at the CG, (n,) each.
    errors : mapping
        Errors of mass properties, CG, thrust and density.
    history : FlightHistory
    airframe : AirframeData
    powerplant : Powerplant
    trim_alpha_rad : float
        Reference of the angle of attack in products.
    inside : IntArray, shape (m,), optional
        Samples at which the equations are wanted; all without. Velocities are differentiated over
        the whole flight.

    Returns
    -------
    Equations
    """
    e = errors
    reference = {"alpha": trim_alpha_rad, "de": float(np.mean(s["de"]))}
    u, v, w = body_velocity(s)
    along = float(np.mean((u * s["ax"] + v * s["ay"] + w * s["az"]) / s["V"]))
    rates = [record.rate(x) for x in (u, v, w)]
    if inside is not None:
        s, history = {name: values[inside] for name, values in s.items()}, history.at(inside)
        u, v, w, *rates = (x[inside] for x in (u, v, w, *rates))
    mass = airframe.mass_kg * (1.0 + e["mass_share"])
    S, b, c = airframe.wing_area_m2, airframe.span_m, airframe.chord_m
    by_speed, by_density = history.thrust_slopes
    thrust = history.thrust_n + by_speed * (s["V"] * np.cos(s["alpha"]) - history.axial_mps)
    thrust = (thrust + by_density * e["density_share"]) * (1.0 + e["thrust_share"])
    tx, tz = thrust * powerplant.axis[0], thrust * powerplant.axis[2]
    p, q, r, V = s["p"], s["q"], s["r"], s["V"]
    # Aerodynamic force from specific force, thrust subtracted (EQUATIONS.md, eq. 1).
    X, Y, Z = mass * s["ax"] - tx, mass * s["ay"], mass * s["az"] - tz
    roll, pitch, yaw = _moments(s, e, history, airframe, powerplant, (mass, tx, tz))
    force = s["qbar"] * S
    ca, sa = np.cos(s["alpha"]), np.sin(s["alpha"])
    # From body to wind axes (EQUATIONS.md, eq. 5).
    lift, drag = -(Z * ca - X * sa) / force, -(X * ca + Z * sa) / force
    signals = {
        "alpha": s["alpha"], "beta": s["beta"],
        "p": 0.5 * p * b / V, "q": 0.5 * q * c / V, "r": 0.5 * r * b / V,
        "de": s["de"], "da": s["da"], "dr": s["dr"], "V": history.airspeed_deviation, "CL": lift,
    }  # fmt: skip
    phi, theta = history.phi_rad, history.theta_rad
    gx = -GRAVITY_MPS2 * np.sin(theta)
    gy = GRAVITY_MPS2 * np.sin(phi) * np.cos(theta)
    gz = GRAVITY_MPS2 * np.cos(phi) * np.cos(theta)
    response = {
        "CL": lift, "CD": drag, "CZ": Z / force, "CX": X / force, "Cm": pitch / (force * c),
        "CY": Y / force, "Cl": roll / (force * b), "Cn": yaw / (force * b),
    }  # fmt: skip
    found = {
        name: Equation(
            response[name], {term.label: term.values(signals, reference) for term in terms}
        )
        for name, terms in model.equations.items()
    }
    # Kinematic equations of the velocity through the air (EQUATIONS.md, eq. 1).
    found |= {
        "u": Equation(rates[0] - (s["ax"] + gx - q * w + r * v), {}),
        "v": Equation(rates[1] - (s["ay"] + gy - r * u + p * w), {}),
        "w": Equation(rates[2] - (s["az"] + gz + q * u - p * v), {}),
    }
    return Equations(found, lift, drag, along)


def _moments(
    s: Mapping[str, Array],
    e: Mapping[str, float],
    history: FlightHistory,
    airframe: AirframeData,
    powerplant: Powerplant,
    mass_and_thrust: tuple[float, Array, Array],
) -> tuple[Array, Array, Array]:
    """Return the aerodynamic moments in roll, pitch, yaw (N m) by Euler's equations.

    The rotor's angular momentum counts (EQUATIONS.md, eq. 2); the last argument is the mass and the
    thrust along x and z.
    """
    mass, tx, tz = mass_and_thrust
    ixx = airframe.ixx_kgm2 * (1.0 + e["ixx_share"])
    iyy = airframe.iyy_kgm2 * (1.0 + e["iyy_share"])
    izz = airframe.izz_kgm2 * (1.0 + e["izz_share"])
    ixz = airframe.ixz_kgm2
    axis, hub = powerplant.axis, powerplant.hub_m
    spin = powerplant.rotor_kgm2 * history.spin_radps
    hx, hz = spin * axis[0], spin * axis[2]
    p, q, r = s["p"], s["q"], s["r"]
    arm_x, arm_z = hub[0] - e["cg_x_m"], hub[2] - e["cg_z_m"]
    roll = ixx * s["pd"] - ixz * (s["rd"] + p * q) + (izz - iyy) * q * r + q * hz
    roll += history.drive_nm * axis[0]
    pitch = iyy * s["qd"] + (ixx - izz) * p * r + ixz * (p * p - r * r) + r * hx - p * hz
    pitch -= arm_z * tx - arm_x * tz
    yaw = izz * s["rd"] - ixz * (s["pd"] - q * r) + (iyy - ixx) * p * q - q * hx
    yaw += history.drive_nm * axis[2]
    # About the plane of symmetry, where neither lift nor drag rolls or yaws: a CG 8 mm off it
    # makes Cl_alpha -0.024, which left out biases Cl_r by 4 %.
    roll += e["cg_y_m"] * mass * s["az"]
    yaw -= e["cg_y_m"] * mass * s["ax"]
    return roll, pitch, yaw


def body_velocity(s: Mapping[str, Array]) -> tuple[Array, Array, Array]:
    """Return velocity through the air along x, y and z (m/s), each (n,) (EQUATIONS.md, eq. 4)."""
    plane = s["V"] * np.cos(s["beta"])
    return plane * np.cos(s["alpha"]), s["V"] * np.sin(s["beta"]), plane * np.sin(s["alpha"])

"""The auxiliary model: a gust-free simulation whose regressors are the instrumental variables.

A linear model with the coefficients found so far is driven by the measured surfaces. Its signals
are correlated with the inputs but not with gusts and sensor noise, so an estimate with regressors
of this simulation as instrumental variables is not biased by either (Ljung, System Identification,
sec. 7.6; Soderstrom & Stoica, Instrumental Variable Methods, 1983). They need not be exact, but
they must not run away: where air pitches or rolls, the first coefficients, found without them, make
an aircraft that does, and so may those of an aircraft that an autopilot holds. Its growing motions
die away instead.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from host.aircraft.mass_properties import AirframeData
from host.arrays import Array
from host.constants import GRAVITY_MPS2
from host.errors import IdentificationError
from host.instrument.deviations import SensorErrorModel
from host.sysid.coefficients.aero_equations import FlightHistory
from host.sysid.numerics.discretisation import discretise
from host.sysid.numerics.recursion import simulate
from host.sysid.reconstruction.inverse_sensor_model import ATTITUDE_CROSSOVER_RADPS, Record

LEVELLING_PERS = 0.3  # the pilot brings the wings back
MEAN_DRAG = 0.04  # the mean of a force is removed again
MARGIN_PERS = 1e-3
SLOWEST_PERS = 0.1  # a motion that dies away more slowly than a maneuver lasts


def stabilised(A: Array) -> Array:
    """Return a motion (n, n) whose growing or standing roots decay as fast as they grew, others
    as they are."""
    roots, vectors = np.linalg.eig(A)
    growing = roots.real > -MARGIN_PERS
    if not growing.any():
        return A
    decay = np.maximum(np.abs(roots.real), SLOWEST_PERS)
    mirrored = np.where(growing, -decay + 1j * roots.imag, roots)
    return np.ascontiguousarray(((vectors * mirrored) @ np.linalg.pinv(vectors)).real)


def _simulate(A: Array, B: Array, inputs: Array, dt_s: float) -> Array:
    """Return states (samples, n) of x' = A x + B u from rest, A stabilised."""
    if not (np.isfinite(A).all() and np.isfinite(B).all()):
        raise IdentificationError("the coefficients found so far are not finite")
    A = stabilised(A)
    middle = 0.5 * (inputs + np.vstack([inputs[1:], inputs[-1:]]))
    n, m = B.shape
    AB = np.hstack([A, B, np.zeros((n, 1))])
    none = np.zeros(0, dtype=np.int64)
    step, _ = discretise(AB, n, m, False, dt_s, none, none, none, np.zeros(0), 0)
    driving = np.hstack([middle, np.ones((len(middle), 1))])
    finite, states = simulate(step, driving, np.zeros(n))
    if not finite:
        raise IdentificationError("the coefficients found so far make an unstable aircraft")
    return np.ascontiguousarray(states[:, :n])


def simulate_noise_free(
    record: Record,
    s: Mapping[str, Array],
    history: FlightHistory,
    value: Callable[[str], float],
    airframe: AirframeData,
    sensors: SensorErrorModel,
    condition: tuple[float, float, float],
    whole: tuple[bool, bool] = (True, True),
) -> tuple[Record, FlightHistory]:
    """Simulate the sensor columns and the history of a gust-free flight with the same surfaces.

    Parameters
    ----------
    record, s, history
        The flight as measured and corrected.
    value : callable
        Derivative at the trim found so far, by name.
    airframe, sensors
        Without errors.
    condition : tuple
        Airspeed (m/s), dynamic pressure (Pa), angle of attack (rad).
    whole : tuple of bool
        Whether lift and pitch, and side force, roll and yaw, have all their equations. Without, the
        motion of that axis is the measured one: nothing is known to simulate it by.

    Raises
    ------
    IdentificationError
        If the coefficients do not make a stable aircraft.
    """
    V, qbar, alpha_0 = condition
    a, n, jw = airframe, record.samples, record.jw
    # Slow trim changes are outside the linear model.
    high_pass = jw / (jw + ATTITUDE_CROSSOVER_RADPS)
    de, da, dr = (record.filtered(s[k], high_pass) for k in ("de", "da", "dr"))
    short_period = np.column_stack([s["alpha"] - alpha_0, s["q"]])
    if whole[0]:
        short_period = _simulate(*_short_period(value, a, V, qbar), de[:, None], record.dt_s)
    beta, p, r, phi = s["beta"], s["p"], s["r"], history.phi_rad
    if whole[1]:
        system = _lateral_motion(value, a, condition)
        beta, p, r, phi = _simulate(*system, np.column_stack([da, dr]), record.dt_s).T
    alpha, q = alpha_0 + short_period[:, 0], short_period[:, 1]
    angles = {"alpha": short_period[:, 0], "beta": beta, "p": p, "q": q, "r": r}
    thrust = float(np.mean(history.thrust_n))
    ax, ay, az = _specific_force(
        value, a, condition, thrust, angles | {"de": de, "da": da, "dr": dr}
    )
    pd, qd, rd = (record.rate(x) for x in (p, q, r))
    # Accelerometers away from the CG measure the angular acceleration times their arm.
    x, y, z = sensors.imu_m
    omega = 2.0 * np.pi * sensors.vane_hz_per_mps * V
    # Second-order vane; upwash and the vane's own motion added.
    vane = 1.0 / (1.0 + 2.0 * sensors.vane_damping * jw / omega + (jw / omega) ** 2)
    theta = alpha_0 + record.filtered(q, 1.0 / (jw + ATTITUDE_CROSSOVER_RADPS))
    columns = {
        "ax_mps2": ax + qd * z - rd * y,
        "ay_mps2": ay + rd * x - pd * z,
        "az_mps2": az + pd * y - qd * x,
        "p_radps": p, "q_radps": q, "r_radps": r,
        "alpha_rad": record.filtered(
            (1.0 + sensors.upwash) * (alpha - q * sensors.vanes_m[0] / V), vane
        ),
        "beta_rad": record.filtered(beta + r * sensors.vanes_m[0] / V, vane),
        "qbar_pa": np.full(n, qbar), "density_kgpm3": np.full(n, 2.0 * qbar / V**2),
        "elevator_rad": de + float(np.mean(s["de"])), "aileron_rad": da, "rudder_rad": dr,
        "phi_rad": phi, "theta_rad": theta,
    }  # fmt: skip
    columns["alpha_rad"] += (1.0 + sensors.upwash) * alpha_0
    simulated = FlightHistory(
        np.full(n, thrust),
        np.full(n, float(np.mean(history.spin_radps))),
        np.full(n, float(np.mean(history.drive_nm))),
        phi,
        theta,
        history.airspeed_deviation,  # measured: it is slow, and the model has no speed
        np.full(n, V * np.cos(alpha_0)),
        history.thrust_slopes,
    )
    return Record(record.dt_s, columns), simulated


def _specific_force(
    value: Callable[[str], float],
    a: AirframeData,
    condition: tuple[float, float, float],
    thrust_n: float,
    s: Mapping[str, Array],
) -> tuple[Array, Array, Array]:
    """Return the specific force at the CG along x, y, z; alpha and surfaces are from the trim."""
    V, qbar, alpha_0 = condition
    hat_q, hat_p = 0.5 * a.chord_m / V, 0.5 * a.span_m / V
    unit = qbar * a.wing_area_m2 / a.mass_kg
    CL = GRAVITY_MPS2 / unit + value("CL_de") * s["de"]
    CL = CL + value("CL_alpha") * s["alpha"] + value("CL_q") * s["q"] * hat_q
    CD = MEAN_DRAG + value("CD_alpha") * s["alpha"] + value("CD_de") * s["de"]
    CY = value("CY_beta") * s["beta"] + (value("CY_p") * s["p"] + value("CY_r") * s["r"]) * hat_p
    CY = CY + value("CY_da") * s["da"] + value("CY_dr") * s["dr"]
    alpha = alpha_0 + s["alpha"]
    ax = unit * (CL * np.sin(alpha) - CD * np.cos(alpha)) + thrust_n / a.mass_kg
    az = -unit * (CL * np.cos(alpha) + CD * np.sin(alpha))
    return ax, unit * CY, az


def _short_period(
    value: Callable[[str], float], a: AirframeData, V: float, qbar: float
) -> tuple[Array, Array]:
    """Return A and B of alpha and q by the elevator (Etkin & Reid, ch. 4)."""
    lift = qbar * a.wing_area_m2 / (a.mass_kg * V)
    pitch, hat_q = qbar * a.wing_area_m2 * a.chord_m / a.iyy_kgm2, 0.5 * a.chord_m / V
    A = np.array(
        [
            [-lift * value("CL_alpha"), 1.0 - lift * value("CL_q") * hat_q],
            [pitch * value("Cm_alpha"), pitch * value("Cm_q") * hat_q],
        ]
    )
    return A, np.array([[-lift * value("CL_de")], [pitch * value("Cm_de")]])


def _lateral_motion(
    value: Callable[[str], float], a: AirframeData, condition: tuple[float, float, float]
) -> tuple[Array, Array]:
    """Return A and B of beta, p, r, phi by aileron and rudder, body axes (Etkin & Reid, ch. 4)."""
    V, qbar, alpha_0 = condition
    S, b = a.wing_area_m2, a.span_m
    lift, hat_p = qbar * S / (a.mass_kg * V), 0.5 * b / V
    scale = {"beta": 1.0, "p": hat_p, "r": hat_p}
    inertia = np.array([[a.ixx_kgm2, -a.ixz_kgm2], [-a.ixz_kgm2, a.izz_kgm2]])
    A, B = np.zeros((4, 4)), np.zeros((4, 2))
    for j, k in enumerate(scale):
        A[0, j] = lift * value(f"CY_{k}") * scale[k]
        moments = qbar * S * b * np.array([value(f"Cl_{k}"), value(f"Cn_{k}")]) * scale[k]
        A[1:3, j] = np.linalg.solve(inertia, moments)
    A[0, 1:4] += [np.sin(alpha_0), -np.cos(alpha_0), GRAVITY_MPS2 / V]
    A[3, 1:4] = 1.0, np.tan(alpha_0), -LEVELLING_PERS
    for j, k in enumerate(("da", "dr")):
        B[0, j] = lift * value(f"CY_{k}")
        moments = qbar * S * b * np.array([value(f"Cl_{k}"), value(f"Cn_{k}")])
        B[1:3, j] = np.linalg.solve(inertia, moments)
    return A, B

"""What the sensors would have said without gusts: instruments in the sense of regression.

A linear model with the coefficients found so far is driven by the surfaces as measured. Its
signals follow the inputs and know nothing of gusts and sensor noise: least squares weighted with
them has no bias from either (instrumental variables; Soderstrom & Stoica 1983). They need not be
exact.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from host.aircraft.mass_properties import AirframeData
from host.arrays import Array
from host.constants import GRAVITY_MPS2
from host.instrument.deviations import SensorErrorModel
from host.sysid.coefficients.aero_equations import Flown
from host.sysid.compatibility.inverse_sensor_model import ATTITUDE_CROSSOVER_RADPS, Record
from host.sysid.identification_error import IdentificationError
from host.sysid.numerics.discretisation import discretise
from host.sysid.numerics.recursion import simulate

LEVELLING_PERS = 0.3  # the pilot brings the wings back
DRAG = 0.04  # only sets the mean of a force whose mean is taken out again


def _simulate(A: Array, B: Array, inputs: Array, dt_s: float) -> Array:
    if np.max(np.linalg.eigvals(A).real) > -1e-3:
        raise IdentificationError("the coefficients found so far make an unstable aircraft")
    middle = 0.5 * (inputs + np.vstack([inputs[1:], inputs[-1:]]))
    n, m = B.shape
    AB = np.hstack([A, B, np.zeros((n, 1))])
    none = np.zeros(0, dtype=np.int64)
    step, _ = discretise(AB, n, m, False, dt_s, none, none, none, np.zeros(0), 0)
    drive = np.hstack([middle, np.ones((len(middle), 1))])
    finite, states = simulate(step, drive, np.zeros(n))
    if not finite:
        raise IdentificationError("the coefficients found so far make an unstable aircraft")
    return np.ascontiguousarray(states[:, :n])


def gust_free(
    record: Record,
    s: Mapping[str, Array],
    flown: Flown,
    value: Callable[[str], float],
    airframe: AirframeData,
    data: SensorErrorModel,
    condition: tuple[float, float, float],
) -> tuple[Record, Flown]:
    """Return sensor columns and attitude of a gust-free flight with the same surfaces.

    Parameters
    ----------
    record, s, flown
        The flight as measured and corrected.
    value : callable
        Slope at the trim found so far, by name.
    airframe, data
        Nominal.
    condition : tuple
        Airspeed (m/s), dynamic pressure (Pa), angle of attack (rad).

    Raises
    ------
    IdentificationError
        If the coefficients do not make a stable aircraft.
    """
    V, qbar, alpha_0 = condition
    a, n, jw = airframe, record.samples, record.jw
    S, b, c = a.wing_area_m2, a.span_m, a.chord_m
    lift = qbar * S / (a.mass_kg * V)
    pitch, hat_q, hat_p = qbar * S * c / a.iyy_kgm2, 0.5 * c / V, 0.5 * b / V
    fast = jw / (jw + ATTITUDE_CROSSOVER_RADPS)  # slow trim changes leave the linear model
    de, da, dr = (record.passed(s[k], fast) for k in ("de", "da", "dr"))
    short = _simulate(
        np.array(
            [
                [-lift * value("CL_alpha"), 1.0 - lift * value("CL_q") * hat_q],
                [pitch * value("Cm_alpha"), pitch * value("Cm_q") * hat_q],
            ]
        ),
        np.array([[-lift * value("CL_de")], [pitch * value("Cm_de")]]),
        de[:, None],
        record.dt_s,
    )
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
    beta, p, r, phi = _simulate(A, B, np.column_stack([da, dr]), record.dt_s).T
    alpha, q = alpha_0 + short[:, 0], short[:, 1]
    CL = a.mass_kg * GRAVITY_MPS2 / (qbar * S) + value("CL_de") * de
    CL = CL + value("CL_alpha") * short[:, 0] + value("CL_q") * q * hat_q
    CD = DRAG + value("CD_alpha") * short[:, 0] + value("CD_de") * de
    CY = value("CY_beta") * beta + (value("CY_p") * p + value("CY_r") * r) * hat_p
    CY = CY + value("CY_da") * da + value("CY_dr") * dr
    thrust = float(np.mean(flown.thrust_n))
    unit = qbar * S / a.mass_kg
    ax = unit * (CL * np.sin(alpha) - CD * np.cos(alpha)) + thrust / a.mass_kg
    az = -unit * (CL * np.cos(alpha) + CD * np.sin(alpha))
    pd, qd, rd = (record.rate(x) for x in (p, q, r))
    x, y, z = data.imu_m
    omega = 2.0 * np.pi * data.vane_hz_per_mps * V
    vane = 1.0 / (1.0 + 2.0 * data.vane_damping * jw / omega + (jw / omega) ** 2)
    theta = alpha_0 + record.passed(q, 1.0 / (jw + ATTITUDE_CROSSOVER_RADPS))
    columns = {
        "ax_mps2": ax + qd * z - rd * y,
        "ay_mps2": unit * CY + rd * x - pd * z,
        "az_mps2": az + pd * y - qd * x,
        "p_radps": p, "q_radps": q, "r_radps": r,
        "alpha_rad": record.passed((1.0 + data.upwash) * (alpha - q * data.vanes_m[0] / V), vane),
        "beta_rad": record.passed(beta + r * data.vanes_m[0] / V, vane),
        "qbar_pa": np.full(n, qbar), "density_kgpm3": np.full(n, 2.0 * qbar / V**2),
        "elevator_rad": de + float(np.mean(s["de"])), "aileron_rad": da, "rudder_rad": dr,
        "phi_rad": phi, "theta_rad": theta,
    }  # fmt: skip
    columns["alpha_rad"] += (1.0 + data.upwash) * alpha_0
    calm = Flown(
        np.full(n, thrust),
        np.full(n, float(np.mean(flown.spin_radps))),
        np.full(n, float(np.mean(flown.drive_nm))),
        phi,
        theta,
        flown.faster,  # of the flight: slow, and nothing else tells how speed changed
        np.full(n, V * np.cos(alpha_0)),
        flown.pull,
    )
    return Record(record.dt_s, columns), calm

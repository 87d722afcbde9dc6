"""Linear motion and natural modes of the aircraft from a fit of coefficients.

Errors of mass and inertia cancel: a moment coefficient is uncertain by the inertia assumed, but the
motion computed from both is not, because their joint covariance is used.

Linearised equations of motion in level flight: Etkin & Reid, Dynamics of Flight, ch. 4; Klein &
Morelli, Aircraft System Identification, ch. 3.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from host.aircraft.mass_properties import AirframeData
from host.arrays import Array
from host.constants import GRAVITY_MPS2, NORMAL_95
from host.instrument.error_list import MASS, QBAR, error_kinds
from host.sysid.coefficients.coefficient_fit import CoefficientFit
from host.sysid.conversion.derivative_conversion import Quantities
from host.sysid.models.modal_analysis import Mode, eigenmodes, lateral_names, longitudinal_names

SIGNALS = {
    "longitudinal": (("airspeed_mps", "alpha_rad", "q_radps", "theta_rad"), ("elevator_rad",)),
    "lateral": (("beta_rad", "p_radps", "r_radps", "phi_rad"), ("aileron_rad", "rudder_rad")),
}
# Coefficients in the linear motion; a model need not have all of them.
LINEAR_MOTION = (
    *(f"{row}_{k}" for row in ("CL", "CD", "Cm") for k in ("alpha", "q", "de", "V")),
    *(f"{row}_{k}" for row in ("CY", "Cl", "Cn") for k in ("beta", "p", "r", "da", "dr")),
)


def coefficient_modes(fit: CoefficientFit, airframe: AirframeData) -> tuple[Mode, ...]:
    """Return short period, phugoid, dutch roll, roll and spiral as far as they exist.

    Parameters
    ----------
    fit : CoefficientFit
    airframe : AirframeData
        The one the fit was made with.
    """
    base, perturbed, steps = _perturbed(fit, airframe)
    found: list[Mode] = []
    known = known_axes(fit)
    for k, named in enumerate((longitudinal_names, lateral_names)):
        if not known[k]:
            continue
        slopes = [(m[k][0] - base[k][0]) / step for m, step in zip(perturbed, steps, strict=True)]
        own = eigenmodes(base[k][0], slopes, fit.covariance)
        names = named([m.oscillatory for m in own])
        called = [replace(m, name=name) for m, name in zip(own, names, strict=True)]
        found += sorted(called, key=lambda m: not m.oscillatory)
    return tuple(found)


def known_axes(fit: CoefficientFit) -> tuple[bool, bool]:
    """Return whether the longitudinal and the lateral linear motion follow from a fit.

    Lift, drag and pitch make the one, side force, roll and yaw the other.
    """
    rows = {d.name.split("_")[0] for d in fit.derivatives}
    return {"CL", "CD", "Cm"} <= rows, {"CY", "Cl", "Cn"} <= rows


@dataclass(frozen=True, slots=True)
class LinearSystem:
    """Linear system x' = A x + B u; every entry with its 95 % half-width.

    Attributes
    ----------
    states, inputs : tuple of str
        Names that end in their SI unit.
    A, A_half : Array, shape (n, n)
    B, B_half : Array, shape (n, m)
    """

    states: tuple[str, ...]
    inputs: tuple[str, ...]
    A: Array
    B: Array
    A_half: Array
    B_half: Array


def quantities(fit: CoefficientFit) -> Quantities:
    """Return the estimates for `to_derivatives`, with errors of mass, inertia, pitot and density.

    Moments of a fit are at the actual CG and angles are true, so errors of the CG and of vane
    scales do not enter the conversion.
    """
    table = {d.name: d.value for d in fit.derivatives} | {n: e for n, (e, _) in fit.errors.items()}
    errors = [n for n, k in error_kinds().items() if k.change == MASS or k.conversion == QBAR]
    names = [n for n in table if n in LINEAR_MOTION or n in errors]
    at = [list(table).index(n) for n in names]
    values = np.array([table[n] for n in names])
    return Quantities(tuple(names), values, fit.covariance[np.ix_(at, at)])


def linear_systems(fit: CoefficientFit, airframe: AirframeData) -> dict[str, LinearSystem]:
    """Return the linear systems of the coefficients, ``longitudinal`` and ``lateral``.

    Parameters
    ----------
    fit : CoefficientFit
    airframe : AirframeData
        The one the fit was made with; errors of its mass and inertia cancel.
    """
    base, perturbed, steps = _perturbed(fit, airframe)
    found = {}
    known = known_axes(fit)
    for k, (name, (states, inputs)) in enumerate(SIGNALS.items()):
        if not known[k]:
            continue
        halves = []
        for part in (0, 1):
            slope = np.stack(
                [(m[k][part] - base[k][part]) / s for m, s in zip(perturbed, steps, strict=True)]
            )
            variance = np.einsum("iab,ij,jab->ab", slope, fit.covariance, slope)
            halves.append(NORMAL_95 * np.sqrt(np.maximum(variance, 0.0)))
        found[name] = LinearSystem(states, inputs, *base[k], *halves)
    return found


Matrices = tuple[Array, Array]


def _perturbed(
    fit: CoefficientFit, airframe: AirframeData
) -> tuple[tuple[Matrices, Matrices], list[tuple[Matrices, Matrices]], Array]:
    """Return both systems, the systems with each unknown perturbed by a step, and the steps."""
    names = [d.name for d in fit.derivatives] + list(fit.errors)
    absent = dict.fromkeys(LINEAR_MOTION, 0.0)
    state = np.array([d.value for d in fit.derivatives] + [e for e, _ in fit.errors.values()])

    def systems(values: Array) -> tuple[Matrices, Matrices]:
        table = absent | dict(zip(names, values.tolist(), strict=True))
        return longitudinal(table, fit, airframe), lateral(table, fit, airframe)

    steps = 1e-3 * np.maximum(np.sqrt(np.maximum(np.diag(fit.covariance), 0.0)), 1e-9)
    perturbed = [
        systems(state + step * row) for step, row in zip(steps, np.eye(len(state)), strict=True)
    ]
    return systems(state), perturbed, steps


def longitudinal(v: Mapping[str, float], fit: CoefficientFit, a: AirframeData) -> Matrices:
    """Return the system of airspeed, alpha, q, theta in level flight, and its inputs."""
    f = fit.condition
    V, force = _speed_and_force(v, fit, a, f.airspeed_ratio[0])
    mass = a.mass_kg * (1.0 + v["mass_share"])
    iyy = a.iyy_kgm2 * (1.0 + v["iyy_share"])
    hat, g = 0.5 * a.chord_m / V, GRAVITY_MPS2
    pitch = force * a.chord_m / iyy
    # In trim the moments of air and thrust cancel; with airspeed one grows, the other falls.
    by_speed = (
        f.thrust_effect.arm_m
        * (f.thrust_effect.slope_npmps - 2.0 * f.thrust_effect.thrust_n / V)
        / iyy
    )
    A = np.array(
        [
            [
                (f.thrust_effect.slope_npmps - 2.0 * force * f.drag / V) / mass
                - force * v["CD_V"] / (mass * V),
                g - force * v["CD_alpha"] / mass, 0.0, -g,
            ],
            [
                -2.0 * g / V**2 - force * v["CL_V"] / (mass * V**2),
                -force * (v["CL_alpha"] + f.drag) / (mass * V),
                1.0 - force * v["CL_q"] * hat / (mass * V), 0.0,
            ],
            [by_speed + pitch * v["Cm_V"] / V, pitch * v["Cm_alpha"], pitch * v["Cm_q"] * hat, 0.0],
            [0.0, 0.0, 1.0, 0.0],
        ]
    )  # fmt: skip
    lifted = -force * v["CL_de"] / (mass * V)
    return A, np.array([[-force * v["CD_de"] / mass], [lifted], [pitch * v["Cm_de"]], [0.0]])


def lateral(v: Mapping[str, float], fit: CoefficientFit, a: AirframeData) -> Matrices:
    """Return the system of beta, p, r, phi in level flight, and its inputs."""
    f = fit.condition
    V, force = _speed_and_force(v, fit, a, f.airspeed_ratio[1])
    mass = a.mass_kg * (1.0 + v["mass_share"])
    ixx, izz = (n * (1.0 + v[k]) for n, k in ((a.ixx_kgm2, "ixx_share"), (a.izz_kgm2, "izz_share")))
    inertia = np.array([[ixx, -a.ixz_kgm2], [-a.ixz_kgm2, izz]])
    A, B = np.zeros((4, 4)), np.zeros((4, 2))
    hat = 0.5 * a.span_m / V
    for j, (k, scale) in enumerate({"beta": 1.0, "p": hat, "r": hat}.items()):
        A[0, j] = force / (mass * V) * v[f"CY_{k}"] * scale
        moments = force * a.span_m * np.array([v[f"Cl_{k}"], v[f"Cn_{k}"]]) * scale
        A[1:3, j] = np.linalg.solve(inertia, moments)
    for j, k in enumerate(("da", "dr")):
        B[0, j] = force / (mass * V) * v[f"CY_{k}"]
        moments = force * a.span_m * np.array([v[f"Cl_{k}"], v[f"Cn_{k}"]])
        B[1:3, j] = np.linalg.solve(inertia, moments)
    A[0, 1:] += [np.sin(f.alpha_rad), -np.cos(f.alpha_rad), GRAVITY_MPS2 / V]
    A[3] = 0.0, 1.0, np.tan(f.alpha_rad), 0.0
    return A, B


def _speed_and_force(
    v: Mapping[str, float], fit: CoefficientFit, a: AirframeData, airspeed_ratio: float
) -> tuple[float, float]:
    """Return airspeed and dynamic pressure times wing area, corrected for pitot and density."""
    qbar_pa = (fit.condition.qbar_pa - v["pitot_zero_pa"]) / (1.0 + v["pitot_scale"])
    share = qbar_pa / fit.condition.qbar_pa / (1.0 + v["density_share"])
    return (
        fit.condition.airspeed_mps * airspeed_ratio * share**0.5,
        qbar_pa * airspeed_ratio**2 * a.wing_area_m2,
    )

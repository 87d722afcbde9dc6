"""Natural modes of the aircraft that a fit of coefficients found, with their uncertainty.

Mass and inertia cancel: what is uncertain in a moment coefficient by the inertia assumed is exact
in the motion it stands for, and the joint covariance of both says so.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from host.compiled import Array
from host.sysid.airframe import AirframeData
from host.sysid.coefficient_answer import CoefficientFit
from host.sysid.coefficient_rows import GRAVITY_MPS2
from host.sysid.modes import Mode, mode_of

PAIRS = (("short period", "phugoid"), ("dutch roll", "roll and spiral"))
SINGLE = ("roll", "spiral")


def coefficient_modes(fit: CoefficientFit, airframe: AirframeData) -> tuple[Mode, ...]:
    """Return short period, phugoid, dutch roll, roll and spiral as far as they exist.

    Parameters
    ----------
    fit : CoefficientFit
    airframe : AirframeData
        The one the fit was made with.
    """
    names = [d.name for d in fit.derivatives] + list(fit.errors)
    state = np.array([d.value for d in fit.derivatives] + [e for e, _ in fit.errors.values()])

    def systems(values: Array) -> tuple[Array, Array]:
        table = dict(zip(names, values.tolist(), strict=True))
        return longitudinal(table, fit, airframe), lateral(table, fit, airframe)

    steps = 1e-3 * np.maximum(np.sqrt(np.maximum(np.diag(fit.covariance), 0.0)), 1e-9)
    base = systems(state)
    moved = [
        systems(state + step * row) for step, row in zip(steps, np.eye(len(state)), strict=True)
    ]
    found = []
    for k, pair_names in enumerate(PAIRS):
        values, right = np.linalg.eig(base[k])
        left = np.linalg.inv(right)
        slopes = [(m[k] - base[k]) / step for m, step in zip(moved, steps, strict=True)]
        own: dict[str, list[Mode]] = {"pair": [], "single": []}
        for j in np.argsort(-np.abs(values)):
            value = complex(values[j])
            if value.imag < 0.0:
                continue
            gradient = np.array([left[j] @ slope @ right[:, j] for slope in slopes])
            J = np.vstack([gradient.real, gradient.imag])
            names_here = pair_names if value.imag > 0.0 else SINGLE if k else pair_names
            kind = own["pair" if value.imag > 0.0 else "single"]
            kind.append(mode_of(names_here[min(len(kind), 1)], value, J @ fit.covariance @ J.T))
        found += [*own["pair"], *own["single"]]
    return tuple(found)


def longitudinal(v: Mapping[str, float], fit: CoefficientFit, a: AirframeData) -> Array:
    """Return the system of airspeed, alpha, q, theta in level flight."""
    f = fit.flight
    V, force = _moving(v, fit, a)
    mass = a.mass_kg * (1.0 + v["mass_share"])
    iyy = a.iyy_kgm2 * (1.0 + v["iyy_share"])
    hat, g = 0.5 * a.chord_m / V, GRAVITY_MPS2
    pitch = force * a.chord_m / iyy
    # In trim the moments of air and thrust cancel; with airspeed one grows, the other falls.
    by_speed = f.pull.arm_m * (f.pull.slope_npmps - 2.0 * f.pull.thrust_n / V) / iyy
    return np.array(
        [
            [
                (f.pull.slope_npmps - 2.0 * force * f.drag / V) / mass,
                g - force * v["CD_alpha"] / mass, 0.0, -g,
            ],
            [
                -2.0 * g / V**2,
                -force * (v["CL_alpha"] + f.drag) / (mass * V),
                1.0 - force * v["CL_q"] * hat / (mass * V), 0.0,
            ],
            [by_speed, pitch * v["Cm_alpha"], pitch * v["Cm_q"] * hat, 0.0],
            [0.0, 0.0, 1.0, 0.0],
        ]
    )  # fmt: skip


def lateral(v: Mapping[str, float], fit: CoefficientFit, a: AirframeData) -> Array:
    """Return the system of beta, p, r, phi in level flight."""
    f = fit.flight
    V, force = _moving(v, fit, a)
    mass = a.mass_kg * (1.0 + v["mass_share"])
    ixx, izz = (n * (1.0 + v[k]) for n, k in ((a.ixx_kgm2, "ixx_share"), (a.izz_kgm2, "izz_share")))
    inertia = np.array([[ixx, -a.ixz_kgm2], [-a.ixz_kgm2, izz]])
    A = np.zeros((4, 4))
    hat = 0.5 * a.span_m / V
    for j, (k, scale) in enumerate({"beta": 1.0, "p": hat, "r": hat}.items()):
        A[0, j] = force / (mass * V) * v[f"CY_{k}"] * scale
        moments = force * a.span_m * np.array([v[f"Cl_{k}"], v[f"Cn_{k}"]]) * scale
        A[1:3, j] = np.linalg.solve(inertia, moments)
    A[0, 1:] += [np.sin(f.alpha_rad), -np.cos(f.alpha_rad), GRAVITY_MPS2 / V]
    A[3] = 0.0, 1.0, np.tan(f.alpha_rad), 0.0
    return A


def _moving(v: Mapping[str, float], fit: CoefficientFit, a: AirframeData) -> tuple[float, float]:
    """Return airspeed and dynamic pressure times wing area, the pitot's error taken out."""
    share = 1.0 / (1.0 + v["pitot_scale"])
    return fit.flight.airspeed_mps * share**0.5, fit.flight.qbar_pa * share * a.wing_area_m2

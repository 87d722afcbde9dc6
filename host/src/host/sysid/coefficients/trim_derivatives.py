"""Stability and control derivatives at the trim, from whatever terms were fitted.

A name such as CD_alpha means the local derivative, whatever the equations are: with ``CL^2`` in the
drag equation CD_alpha and CD_de contain what lift contributes (2 CD_CL2 CL CL_alpha). From forces
in body axes those of lift and drag follow by rotation through the angle of attack (Klein & Morelli,
Aircraft System Identification, ch. 3).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from host.arrays import Array
from host.sysid.models.coefficient_model import BODY, CoefficientModel

POLAR = "CD_CL2"


@dataclass(frozen=True, slots=True)
class TrimMeans:
    """Means over the elevator maneuvers.

    Attributes
    ----------
    alpha_rad, lift, drag : float
        Angle of attack, CL and CD.
    lift_slope, drag_slope : Array, shape (n,)
        Derivatives of CL and CD by the unknowns.
    """

    alpha_rad: float
    lift: float
    drag: float
    lift_slope: Array
    drag_slope: Array


# Name to value and its derivative by the unknowns, (n,).
DerivativesAtTrim = dict[str, tuple[float, Array]]


def derivatives_at_trim(
    model: CoefficientModel,
    state: Array,
    position: Mapping[str, int],
    means: TrimMeans,
    *,
    nuisance: bool = False,
) -> DerivativesAtTrim:
    """Return every derivative that an answer reports.

    Parameters
    ----------
    model : CoefficientModel
    state : Array, shape (n,)
        All unknowns; the coefficients of the terms at `position`.
    position : mapping
    means : TrimMeans
    nuisance : bool
        Return derivatives of nuisance terms too.

    Returns
    -------
    dict
        Fitted terms in the order of the model, then what follows from them.
    """
    unit = np.eye(len(state))
    terms: DerivativesAtTrim = {name: (float(state[k]), unit[k]) for name, k in position.items()}
    left_out = () if nuisance else model.nuisance
    found = {name: terms[name] for name, _, _ in model.named() if name not in left_out}
    if set(BODY) <= model.equations.keys():
        found |= _from_body_axes(terms, means)
    if POLAR in terms:
        found |= {n: d for n, d in _with_drag_polar(terms, means).items() if n not in left_out}
    return found


def zero_lift_drag(
    model: CoefficientModel,
    state: Array,
    position: Mapping[str, int],
    means: TrimMeans,
    regressor_means: Mapping[str, float],
    found: DerivativesAtTrim,
) -> tuple[float, Array]:
    """Return the drag at zero lift, surfaces as flown, and its derivative by the unknowns, (n,).

    Parameters
    ----------
    model, state, position
        As in `derivatives_at_trim`.
    means : TrimMeans
        Its slopes may be those of the last unknowns only.
    regressor_means : mapping
        Mean of every regressor of the forces over the elevator maneuvers.
    found : dict
        From `derivatives_at_trim`.
    """
    # What the curvature of the polar adds to the mean beyond the value at the trim.
    gains = {"CD": 1.0, "CZ": -np.sin(means.alpha_rad), "CX": -np.cos(means.alpha_rad)}
    curvature = np.zeros(len(state))
    for name, equation, term in model.named():
        if equation in gains and not term.linear:
            square = means.lift**2 if name == POLAR else 0.0
            curvature[position[name]] = gains[equation] * (regressor_means[name] - square)
    # The parabola in lift with this value and slope: CD_0 = CD - CL CD_alpha / (2 CL_alpha).
    (drag_alpha, drag_alpha_slope), (lift_alpha, lift_alpha_slope) = (
        found["CD_alpha"],
        found["CL_alpha"],
    )
    share = drag_alpha / (2.0 * lift_alpha)
    lift = means.lift
    slope = (
        -curvature
        - lift / (2.0 * lift_alpha) * drag_alpha_slope
        + share * lift / lift_alpha * lift_alpha_slope
    )
    slope[-len(means.lift_slope) :] += means.drag_slope - share * means.lift_slope
    return means.drag - float(curvature @ state) - share * lift, slope


def _from_body_axes(terms: DerivativesAtTrim, means: TrimMeans) -> DerivativesAtTrim:
    """Return derivatives of lift and drag from those of body-axis forces."""
    ca, sa = float(np.cos(means.alpha_rad)), float(np.sin(means.alpha_rad))
    absent = (0.0, np.zeros_like(means.lift_slope))
    result: DerivativesAtTrim = {}
    for label in ("alpha", "q", "de", "V"):
        if label != "alpha" and not {f"{force}_{label}" for force in BODY} & terms.keys():
            continue
        (z, dz), (x, dx) = (terms.get(f"{force}_{label}", absent) for force in BODY)
        # CL = CX sin(alpha) - CZ cos(alpha), CD = -CX cos(alpha) - CZ sin(alpha).
        lift, lift_slope = sa * x - ca * z, sa * dx - ca * dz
        drag, drag_slope = -ca * x - sa * z, -ca * dx - sa * dz
        if label == "alpha":  # the wind axes rotate with alpha
            lift, lift_slope = lift - means.drag, lift_slope - means.drag_slope
            drag, drag_slope = drag + means.lift, drag_slope + means.lift_slope
        result[f"CL_{label}"] = lift, lift_slope
        if label != "q":
            result[f"CD_{label}"] = drag, drag_slope
    return result


def _with_drag_polar(terms: DerivativesAtTrim, means: TrimMeans) -> DerivativesAtTrim:
    """Return derivatives of drag where a part of it is proportional to the square of lift."""
    k, dk = terms[POLAR]
    absent = (0.0, np.zeros_like(means.lift_slope))
    result: DerivativesAtTrim = {}
    labels = ("alpha", "q", "de") if "CD_q" in terms else ("alpha", "de")
    for label in labels:
        own, own_slope = terms.get(f"CD_{label}", absent)
        lift, lift_slope = terms.get(f"CL_{label}", absent)
        slope = means.lift * (lift * dk + k * lift_slope) + k * lift * means.lift_slope
        result[f"CD_{label}"] = own + 2.0 * k * means.lift * lift, own_slope + 2.0 * slope
    return result

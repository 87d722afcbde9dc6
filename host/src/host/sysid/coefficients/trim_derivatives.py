"""Slopes at the trim, from whatever terms were fitted: what the linear motion is made of.

Names mean local derivatives, whatever the rows: with ``CL^2`` in the row of drag, CD_alpha and
CD_de hold what lift brings (2 CD_CL2 CL CL_alpha); from forces in body axes CL and CD follow by
turning them through the angle of attack.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from host.arrays import Array
from host.sysid.coefficients.coefficient_model import BODY, CoefficientModel

POLAR = "CD_CL2"


@dataclass(frozen=True, slots=True)
class Mean:
    """Angle of attack, CL and CD of the elevator's maneuvers; how both move with the state (n,)."""

    alpha_rad: float
    lift: float
    drag: float
    lift_slope: Array
    drag_slope: Array


Local = dict[str, tuple[float, Array]]


def local_derivatives(
    model: CoefficientModel, state: Array, position: Mapping[str, int], mean: Mean
) -> Local:
    """Return value and slope with the state of everything an answer tells.

    Parameters
    ----------
    model : CoefficientModel
    state : (n,) Array
        Coefficients of all terms at `position`, what else was estimated elsewhere.
    position : mapping
    mean : Mean

    Returns
    -------
    dict
        Told terms in the order of the model, then what follows from them.
    """
    unit = np.eye(len(state))
    terms: Local = {name: (float(state[k]), unit[k]) for name, k in position.items()}
    found = {name: terms[name] for name, _, _ in model.named() if name not in model.beside}
    if model.forces == BODY:
        found |= _turned(terms, mean)
    if POLAR in terms:
        found |= _through_lift(terms, mean)
    return found


def zero_lift_drag(
    model: CoefficientModel,
    state: Array,
    position: Mapping[str, int],
    mean: Mean,
    means: Mapping[str, float],
    found: Local,
) -> tuple[float, Array]:
    """Return the drag at zero lift, surfaces as flown, and its slope with the state.

    Parameters
    ----------
    model, state, position
        As in `local_derivatives`.
    mean : Mean
        Its slopes with the last entries of the state suffice.
    means : mapping
        Of every regressor of the forces over the elevator's maneuvers.
    found : dict
        Of `local_derivatives`.
    """
    # What the bends of the polar add to the mean beyond the value at the trim.
    gains = {"CD": 1.0, "CZ": -np.sin(mean.alpha_rad), "CX": -np.cos(mean.alpha_rad)}
    bent = np.zeros(len(state))
    for name, row, term in model.named():
        if row in gains and not term.linear:
            square = mean.lift**2 if name == POLAR else 0.0
            bent[position[name]] = gains[row] * (means[name] - square)
    (by_alpha, by_alpha_slope), (steep, steep_slope) = found["CD_alpha"], found["CL_alpha"]
    share = by_alpha / (2.0 * steep)
    lift = mean.lift
    slope = -bent - lift / (2.0 * steep) * by_alpha_slope + share * lift / steep * steep_slope
    slope[-len(mean.lift_slope) :] += mean.drag_slope - share * mean.lift_slope
    return mean.drag - float(bent @ state) - share * lift, slope


def _turned(terms: Local, mean: Mean) -> Local:
    """Return slopes of lift and drag from those of body-axis forces."""
    ca, sa = float(np.cos(mean.alpha_rad)), float(np.sin(mean.alpha_rad))
    nothing = (0.0, np.zeros_like(mean.lift_slope))
    result: Local = {}
    for label in ("alpha", "q", "de", "V"):
        if label != "alpha" and not {f"{row}_{label}" for row in BODY} & terms.keys():
            continue
        (z, dz), (x, dx) = (terms.get(f"{row}_{label}", nothing) for row in BODY)
        lift, lift_slope = sa * x - ca * z, sa * dx - ca * dz
        drag, drag_slope = -ca * x - sa * z, -ca * dx - sa * dz
        if label == "alpha":  # the axes turn too
            lift, lift_slope = lift - mean.drag, lift_slope - mean.drag_slope
            drag, drag_slope = drag + mean.lift, drag_slope + mean.lift_slope
        result[f"CL_{label}"] = lift, lift_slope
        if label != "q":
            result[f"CD_{label}"] = drag, drag_slope
    return result


def _through_lift(terms: Local, mean: Mean) -> Local:
    """Return slopes of drag where a part of it goes with the square of lift."""
    k, dk = terms[POLAR]
    nothing = (0.0, np.zeros_like(mean.lift_slope))
    result: Local = {}
    for label in ("alpha", "de"):
        own, own_slope = terms.get(f"CD_{label}", nothing)
        lift, lift_slope = terms.get(f"CL_{label}", nothing)
        slope = mean.lift * (lift * dk + k * lift_slope) + k * lift * mean.lift_slope
        result[f"CD_{label}"] = own + 2.0 * k * mean.lift * lift, own_slope + 2.0 * slope
    return result

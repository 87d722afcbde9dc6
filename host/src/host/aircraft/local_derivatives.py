"""Local derivatives of a simulated aircraft: the true values for one maneuver's identification."""

from __future__ import annotations

import math

import numpy as np

from host.aircraft.airframe import Airframe, Array
from host.aircraft.rigid_body import aerodynamics

FORCES = ("CL", "CD", "CY", "Cl", "Cm", "Cn")
ARGUMENTS = ("alpha", "beta", "p", "q", "r", "de", "da", "dr")


def coefficients(frame: Airframe, at: Array) -> Array:
    """Return CL, CD, CY, Cl, Cm, Cn (6,), moments about the CG.

    Parameters
    ----------
    frame : Airframe
    at : (8,) array
        alpha, beta (rad), p_hat, q_hat, r_hat, elevator, aileron, rudder (rad).
    """
    lift, drag, side, roll, pitch, yaw = aerodynamics(frame, *(float(value) for value in at))
    sa, ca = math.sin(at[0]), math.cos(at[0])
    axial, normal = -drag * ca + lift * sa, -drag * sa - lift * ca
    cx, cy, cz = frame.cg_m
    return np.array(
        [
            lift,
            drag,
            side,
            roll - (cy * normal - cz * side) / frame.span_m,
            pitch - (cz * axial - cx * normal) / frame.chord_m,
            yaw - (cx * side - cy * axial) / frame.span_m,
        ]
    )


def local_derivatives(frame: Airframe, at: Array, width_rad: float = 0.01) -> dict[str, float]:
    """Return every coefficient and its slope at one condition, under names such as ``Cm_alpha``.

    Parameters
    ----------
    frame : Airframe
    at : (8,) array
        As for `coefficients`.
    width_rad : float
        Half-width of the central difference: about the excursion of a maneuver, so that the kink
        of a table inside it counts.

    Returns
    -------
    dict
        ``CL_alpha`` ... ``Cn_dr`` per radian; rates against p_hat = pb/2V, q_hat = qc/2V, r_hat
        = rb/2V; ``CL_0`` ... the straight line's value at zero of all arguments, but ``CD_0`` the
        drag at zero lift, surfaces as flown; ``CL`` ... the value at the condition.
    """
    base = coefficients(frame, at)
    out = dict(zip(FORCES, base.tolist(), strict=True))
    slopes = np.empty((len(FORCES), len(ARGUMENTS)))
    for k, argument in enumerate(ARGUMENTS):
        shift = np.zeros(len(ARGUMENTS))
        shift[k] = width_rad
        slopes[:, k] = (coefficients(frame, at + shift) - coefficients(frame, at - shift)) / (
            2 * width_rad
        )
        for force, value in zip(FORCES, slopes[:, k], strict=True):
            out[f"{force}_{argument}"] = float(value)
    for force, value in zip(FORCES, base - slopes @ at, strict=True):
        out[f"{force}_0"] = float(value)
    # The parabola in lift that has this value and this slope.
    out["CD_0"] = out["CD"] - 0.5 * out["CL"] * out["CD_alpha"] / out["CL_alpha"]
    return out

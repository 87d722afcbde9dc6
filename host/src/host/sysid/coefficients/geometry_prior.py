"""What a drawing of the airframe adds to a fit of coefficients: arms of the control forces.

The arm between accelerometers and CG shows in the data only together with lift: a longer arm and
a larger CL_de are the same flight. Where a control surface's force acts separates the two: it acts
between a quarter of the tail's chord and the hinge line, so moment over force is an arm that a tape
measure knows. Ailerons on a straight wing make side force only by their sidewash on the fin, which
says as much about the arm along z. Lift of pitching drags by anything from nothing, where a tail
makes it, to all that the polar has for it, evenly: the elevator's drag shows in the data only
together with it, and with the tilt of the accelerometers.

Each of these is a measurement with its uncertainty (mixed estimation with prior information; Klein
& Morelli, Aircraft System Identification, ch. 5), applied by a Kalman update.
"""

from __future__ import annotations

import numpy as np

from host.aircraft.mass_properties import AirframeData
from host.arrays import Array
from host.constants import EVEN_SD
from host.sysid.coefficients.trim_derivatives import DerivativesAtTrim

# Errors of the relations.
ELEVATOR_ARM, RUDDER_ARM, SIDEWASH = "elevator_arm_share", "rudder_arm_share", "sidewash_share"
PITCHING_DRAG = "pitching_drag_share"
SIDEWASH_SHARE = 0.1  # standard deviation of CY_da over CY_beta


def apply_geometry_prior(
    state: Array, covariance: Array, at_trim: DerivativesAtTrim, airframe: AirframeData
) -> tuple[Array, Array, Array, dict[str, Array]]:
    """Update estimate and covariance with the geometry of the control surfaces.

    Parameters
    ----------
    state : Array, shape (n,)
        Estimate of the fit: coefficients, sensor errors.
    covariance : Array, shape (n, n)
    at_trim : dict
        From `derivatives_at_trim`, nuisance terms too. A relation whose derivatives are absent is
        left out.
    airframe : AirframeData
        An arm of 0 is not known and adds nothing.

    Returns
    -------
    state : Array, shape (n,)
    covariance : Array, shape (n, n)
    gain_complement : Array, shape (n, n)
        The product of all I - K H: the derivative of the updated estimate by that of the flight
        alone.
    shifts : dict of str to (n,) Array
        Shift of the updated estimate by one standard deviation of each relation: by as much the
        drawing may be wrong, in every flight alike.
    """
    a = airframe
    chord, span = a.chord_m, a.span_m
    relations: list[tuple[str, dict[str, float], float]] = []
    gain_complement = np.eye(len(state))
    if a.elevator_arm_m > 0.0 and {"CL_de", "Cm_de"} <= at_trim.keys():
        sd = a.arm_share * abs(at_trim["Cm_de"][0])
        relations.append((ELEVATOR_ARM, {"CL_de": a.elevator_arm_m / chord, "Cm_de": 1.0}, sd))
    if a.rudder_arm_m > 0.0 and {"CY_dr", "Cn_dr"} <= at_trim.keys():
        sd = a.arm_share * abs(at_trim["Cn_dr"][0])
        relations.append((RUDDER_ARM, {"CY_dr": a.rudder_arm_m / span, "Cn_dr": 1.0}, sd))
    if {"CY_da", "CY_beta"} <= at_trim.keys():
        sd = SIDEWASH_SHARE * abs(at_trim["CY_beta"][0])
        relations.append((SIDEWASH, {"CY_da": 1.0}, sd))
    if {"CD_q", "CD_alpha", "CL_alpha", "CL_q"} <= at_trim.keys():
        half = 0.5 * at_trim["CD_alpha"][0] / at_trim["CL_alpha"][0]
        sd = EVEN_SD * abs(half * at_trim["CL_q"][0])
        relations.append((PITCHING_DRAG, {"CD_q": 1.0, "CL_q": -half}, sd))
    shifts: dict[str, Array] = {}
    start = state
    for error, weights, sd in relations:
        # One row h of H: the relation sum(weight * derivative) = 0 is measured with variance sd^2.
        h = sum((w * at_trim[name][1] for name, w in weights.items()), np.zeros(len(state)))
        value = sum(w * at_trim[name][0] for name, w in weights.items()) + h @ (state - start)
        gain = covariance @ h / (h @ covariance @ h + sd**2)
        state = state - gain * value
        complement = np.eye(len(state)) - np.outer(gain, h)
        # Joseph's form: symmetric and positive for any gain.
        covariance = complement @ covariance @ complement.T + np.outer(gain, gain) * sd**2
        gain_complement = complement @ gain_complement
        shifts = {n: np.asarray(complement @ x, dtype=np.float64) for n, x in shifts.items()}
        shifts[error] = np.asarray(gain * sd, dtype=np.float64)
    return state, covariance, gain_complement, shifts

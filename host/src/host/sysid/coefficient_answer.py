"""What a fit of coefficients says, and what the airframe's drawing adds to it.

The arm between accelerometers and CG shows in the data only together with lift: a longer arm and
a larger CL_de are the same flight. What tells them apart is where a control surface's force acts:
between a quarter of the tail's chord and the hinge line, so moment over force is an arm that a tape
measure knows. Ailerons on a straight wing make side force only by their sidewash on the fin, which
says as much of the arm along z. Both enter as measurements with their uncertainty (Kalman update).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from host.compiled import Array
from host.sysid.airframe import AirframeData

QUANTILE = 1.96
FLAG_SHARE = 0.15  # a wider half-width is named as not to be relied on
SIDEWASH_SHARE = 0.1  # standard deviation of CY_da over CY_beta


@dataclass(frozen=True, slots=True)
class Derivative:
    """A coefficient with its 95 % half-width; `flagged` if it is too wide to be relied on."""

    name: str
    value: float
    half_width: float
    flagged: bool


@dataclass(frozen=True, slots=True)
class Flight:
    """Mean condition of the maneuvers; angle of attack and CL of the longitudinal ones."""

    airspeed_mps: float
    qbar_pa: float
    alpha_rad: float
    lift: float


@dataclass(frozen=True, slots=True)
class CoefficientFit:
    """Coefficients with covariance, and the instrument's errors as value and deviation left."""

    derivatives: tuple[Derivative, ...]
    covariance: Array
    errors: dict[str, tuple[float, float]]
    flight: Flight


def informed(
    state: Array, covariance: Array, position: Mapping[str, int], airframe: AirframeData
) -> tuple[Array, Array]:
    """Return state and covariance once the airframe's drawing has been heard.

    Parameters
    ----------
    state, covariance : (n,) and (n, n) Array
        Of the fit; coefficients at `position`.
    position : mapping
    airframe : AirframeData
        Arms of 0 are not known and say nothing.
    """
    a = airframe
    chord, span = a.chord_m, a.span_m
    known: list[tuple[dict[str, float], float]] = []
    if a.elevator_arm_m > 0.0:
        sd = a.arm_share * abs(state[position["Cm_de"]])
        known.append(({"CL_de": a.elevator_arm_m / chord, "Cm_de": 1.0}, sd))
    if a.rudder_arm_m > 0.0:
        sd = a.arm_share * abs(state[position["Cn_dr"]])
        known.append(({"CY_dr": a.rudder_arm_m / span, "Cn_dr": 1.0}, sd))
    known.append(({"CY_da": 1.0}, SIDEWASH_SHARE * abs(state[position["CY_beta"]])))
    for weights, sd in known:
        row = np.zeros(len(state))
        for name, weight in weights.items():
            row[position[name]] = weight
        gain = covariance @ row / (row @ covariance @ row + sd**2)
        state = state - gain * (row @ state)
        keep = np.eye(len(state)) - np.outer(gain, row)
        covariance = keep @ covariance @ keep.T + np.outer(gain, gain) * sd**2
    return state, covariance


def derivatives(values: Mapping[str, float], covariance: Array) -> tuple[Derivative, ...]:
    """Return coefficients with intervals and flags, in the order of the covariance."""
    halves = QUANTILE * np.sqrt(np.maximum(np.diag(covariance), 0.0))
    return tuple(
        Derivative(name, value, float(half), bool(half > FLAG_SHARE * abs(value)))
        for (name, value), half in zip(values.items(), halves, strict=True)
    )

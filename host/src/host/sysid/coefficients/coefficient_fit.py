"""The result of a fit of coefficients: derivatives, sensor errors, mean condition, histories."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from host.arrays import Array, IntArray
from host.constants import CARE_SHARE, NORMAL_95, SMALL_SHARE
from host.instrument.error_sources import ErrorSource
from host.sysid.coefficients.deletion_diagnostics import CrossValidation
from host.sysid.numerics.maneuver_agreement import ManeuverAgreement

METHOD = "equation error with instrument errors"


@dataclass(frozen=True, slots=True)
class Derivative:
    """A coefficient with its 95 % half-width.

    Attributes
    ----------
    name : str
    value, half_width : float
    reference : float
        What the width is judged against: the value, or what would contribute 5 % of the largest
        term of its equation, if that is more.
    """

    name: str
    value: float
    half_width: float
    reference: float

    @property
    def share(self) -> float:
        """Half-width over the reference."""
        return self.half_width / max(self.reference, 1e-300)

    @property
    def flagged(self) -> bool:
        """Whether it is too wide to be relied on."""
        return self.share > CARE_SHARE


@dataclass(frozen=True, slots=True)
class ThrustEffect:
    """Thrust at the mean condition.

    Attributes
    ----------
    thrust_n : float
    slope_npmps : float
        Its derivative by airspeed, rotor speed settled.
    arm_m : float
        Pitching moment per newton.
    """

    thrust_n: float
    slope_npmps: float
    arm_m: float


@dataclass(frozen=True, slots=True)
class MeanCondition:
    """Mean condition of the maneuvers.

    Attributes
    ----------
    airspeed_mps, qbar_pa : float
        Means of all maneuvers.
    alpha_rad, lift, drag : float
        Angle of attack, CL and CD of the longitudinal maneuvers.
    thrust_effect : ThrustEffect
    alpha_range_rad : tuple of float
        Least and largest angle of attack of the longitudinal maneuvers.
    airspeed_ratio : tuple of float
        Airspeed of the longitudinal and of the lateral maneuvers over that of all.
    """

    airspeed_mps: float
    qbar_pa: float
    alpha_rad: float
    lift: float
    drag: float
    thrust_effect: ThrustEffect
    alpha_range_rad: tuple[float, float]
    airspeed_ratio: tuple[float, float]


@dataclass(frozen=True, slots=True)
class CoefficientHistory:
    """One coefficient over all its maneuvers, end to end.

    Attributes
    ----------
    measured, model : Array, shape (n,)
        A constant and a slope in time of each maneuver are fitted to the model.
    """

    measured: Array
    model: Array

    @property
    def nrmse(self) -> float:
        """Rms of the difference over the standard deviation of what was measured."""
        return float(np.std(self.measured - self.model) / np.std(self.measured))


@dataclass(frozen=True, slots=True)
class CoefficientFit:
    """The result of a fit of coefficients.

    Attributes
    ----------
    derivatives : tuple of Derivative
    covariance : Array, shape (derivatives + errors, derivatives + errors)
        Covariance of all derivatives, and behind them all sensor errors.
    errors : dict
        Sensor error to its estimate and standard deviation.
    condition : MeanCondition
    histories : dict
        The force and moment coefficients in time.
    prediction : CrossValidation or None
        Prediction of single maneuvers by all others, in the last step.
    maneuver_agreement : ManeuverAgreement
        Scatter of the maneuvers about the joint estimate, in the last step.
    error_sources : tuple of ErrorSource
        Each sensor error before the flight; empty of several flights.
    error_shifts : dict of str to (derivatives,) Array
        Shift of the derivatives by one standard deviation of each error of sensors and of the
        drawing; empty of several flights. Noise is not in it, as it is in `covariance`.
    """

    derivatives: tuple[Derivative, ...]
    covariance: Array
    errors: dict[str, tuple[float, float]]
    condition: MeanCondition
    histories: dict[str, CoefficientHistory]
    prediction: CrossValidation | None
    maneuver_agreement: ManeuverAgreement
    error_sources: tuple[ErrorSource, ...] = ()
    error_shifts: dict[str, Array] = field(default_factory=dict)


def derivatives_with_intervals(
    values: Mapping[str, float], covariance: Array, regressor_rms: Mapping[str, float]
) -> tuple[Derivative, ...]:
    """Return coefficients with intervals, in the order of the covariance.

    Parameters
    ----------
    values : mapping
    covariance : Array, shape (P, P)
    regressor_rms : mapping
        Rms of each coefficient's regressor; a coefficient without is judged by its value alone.
    """
    halves = NORMAL_95 * np.sqrt(np.maximum(np.diag(covariance), 0.0))
    largest: dict[str, float] = {}
    for name, rms in regressor_rms.items():
        equation = name.split("_")[0]
        contribution = abs(values.get(name, 0.0)) * rms
        largest[equation] = max(largest.get(equation, 0.0), contribution)
    found = []
    for (name, value), half in zip(values.items(), halves, strict=True):
        least = 0.0
        if regressor_rms.get(name, 0.0) > 0.0:
            least = SMALL_SHARE * largest[name.split("_")[0]] / regressor_rms[name]
        found.append(Derivative(name, value, float(half), float(max(abs(value), least))))
    return tuple(found)


def coefficient_history(
    response: Array, model: Array, windows: Sequence[IntArray]
) -> CoefficientHistory:
    """Return a measured and a modelled coefficient, (n,) each, over the samples of some windows."""
    measured, fitted = [], []
    for samples in windows:
        residual = response[samples] - model[samples]
        trend = np.linspace(-1.0, 1.0, len(samples))[:, None] ** np.arange(2)
        measured.append(response[samples])
        fitted.append(model[samples] + trend @ np.linalg.lstsq(trend, residual, rcond=None)[0])
    return CoefficientHistory(np.concatenate(measured), np.concatenate(fitted))

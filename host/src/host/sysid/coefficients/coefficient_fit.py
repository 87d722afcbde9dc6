"""The result of a fit of coefficients: derivatives, sensor errors, mean condition, histories."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from host.arrays import Array, IntArray
from host.constants import NORMAL_95
from host.sysid.coefficients.deletion_diagnostics import Prediction
from host.sysid.numerics.maneuver_agreement import ManeuverAgreement

METHOD = "equation error with instrument errors"
FLAG_SHARE = 0.12  # up to it an error beyond 15 % is a case of one in seventy
SMALL_SHARE = 0.05  # of the row's largest contribution


@dataclass(frozen=True, slots=True)
class Derivative:
    """A coefficient with its 95 % half-width; `flagged` if it is too wide to be relied on.

    Widths are judged against `reference`: the value, or what would contribute 5 % of the row's
    largest term, if that is more.
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
        return self.share > FLAG_SHARE


@dataclass(frozen=True, slots=True)
class Pull:
    """Mean thrust (N), its slope with airspeed at constant rotor speed, pitching moment per N."""

    thrust_n: float
    slope_npmps: float
    arm_m: float


@dataclass(frozen=True, slots=True)
class Flight:
    """Mean condition of the maneuvers; angle of attack with its range, CL and CD of the
    longitudinal ones.

    `faster` is the airspeed of the longitudinal and of the lateral ones over that of all.
    """

    airspeed_mps: float
    qbar_pa: float
    alpha_rad: float
    lift: float
    drag: float
    pull: Pull
    alpha_range_rad: tuple[float, float]
    faster: tuple[float, float]


@dataclass(frozen=True, slots=True)
class Trace:
    """One coefficient over all its maneuvers end to end, each (n,); the model's constant and slope
    of each maneuver are fitted."""

    measured: Array
    model: Array

    @property
    def nrmse(self) -> float:
        """Rms of the difference over the standard deviation of what was measured."""
        return float(np.std(self.measured - self.model) / np.std(self.measured))


@dataclass(frozen=True, slots=True)
class CoefficientFit:
    """Coefficients, and the instrument's errors as value and deviation left.

    `covariance` is of all derivatives and behind them all errors, in their order; `traces` are the
    six force and moment coefficients in time, measured and by the derivatives; `prediction` is that
    of single maneuvers by all others, `repeats` how they scatter, both of the last step.
    """

    derivatives: tuple[Derivative, ...]
    covariance: Array
    errors: dict[str, tuple[float, float]]
    flight: Flight
    traces: dict[str, Trace]
    prediction: Prediction | None
    repeats: ManeuverAgreement


def derivatives(
    values: Mapping[str, float], covariance: Array, sizes: Mapping[str, float]
) -> tuple[Derivative, ...]:
    """Return coefficients with intervals, in the order of the covariance.

    `sizes` is the rms of each coefficient's regressor; one without is judged by its value alone.
    """
    halves = NORMAL_95 * np.sqrt(np.maximum(np.diag(covariance), 0.0))
    largest: dict[str, float] = {}
    for name, size in sizes.items():
        row = name.split("_")[0]
        largest[row] = max(largest.get(row, 0.0), abs(values.get(name, 0.0)) * size)
    found = []
    for (name, value), half in zip(values.items(), halves, strict=True):
        least = 0.0
        if sizes.get(name, 0.0) > 0.0:
            least = SMALL_SHARE * largest[name.split("_")[0]] / sizes[name]
        found.append(Derivative(name, value, float(half), float(max(abs(value), least))))
    return tuple(found)


def trace(left: Array, model: Array, windows: Sequence[IntArray]) -> Trace:
    """Return measured and modelled coefficient (n,) over the samples of some windows."""
    measured, fitted = [], []
    for samples in windows:
        gap = left[samples] - model[samples]
        line = np.linspace(-1.0, 1.0, len(samples))[:, None] ** np.arange(2)
        gone = line @ np.linalg.lstsq(line, gap, rcond=None)[0]
        measured.append(left[samples])
        fitted.append(model[samples] + gone)
    return Trace(np.concatenate(measured), np.concatenate(fitted))

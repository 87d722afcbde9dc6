"""What identification must know of the airframe, and turning derivatives into coefficients.

Conversions are written at the trim of the maneuvers; the uncertainty of mass, inertia, dynamic
pressure and reference sizes is carried into the intervals beside that of the fit.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from host.aircraft.gains import dimensional_name, from_dimensional
from host.aircraft.mass_properties import AirframeData, Condition
from host.arrays import Array
from host.sysid.models.result import FitResult
from host.sysid.models.templates import Trim


@dataclass(frozen=True, slots=True)
class Coefficient:
    """A non-dimensional derivative: value, standard error of the fit alone, 95 % half-width with
    everything."""

    name: str
    value: float
    fit_error: float
    half_width: float


@dataclass(frozen=True, slots=True)
class CoefficientTable:
    """Coefficients of one kind of maneuver: ``longitudinal``, ``lateral`` or another template."""

    template: str
    method: str
    alpha_rad: float
    coefficients: tuple[Coefficient, ...]


@dataclass(frozen=True, slots=True)
class Moved:
    """An estimate (P,) with one deviation of a sensor's error in it, and its condition then.

    `airspeed_gain` and `qbar_gain` are over those of the answer.
    """

    error: str
    estimate: Array
    airspeed_gain: float
    qbar_gain: float


def coefficients(
    result: FitResult,
    airframe: AirframeData,
    condition: Condition,
    moved: Sequence[Moved] = (),
) -> tuple[Coefficient, ...]:
    """Convert dimensional derivatives of the templates to coefficients.

    Parameters
    ----------
    result : FitResult
        Of a model whose parameters carry the template names (Z_alpha, M_q, L_p ...).
    airframe : AirframeData
        Mass properties and sizes.
    condition : Condition
        Airspeed and dynamic pressure of the maneuvers.
    moved : sequence of Moved
        By errors of sensors.

    Returns
    -------
    tuple of Coefficient
        The interval adds mass, inertia, dynamic pressure, upwash and what moved it to the fit's
        own. Errors of pitot and vanes are what pressure and upwash allow for: the larger counts.
    """

    def converted(derivatives: Array, a: AirframeData, at: Condition) -> dict[str, float]:
        return from_dimensional(dict(zip(result.names, derivatives.tolist(), strict=True)), a, at)

    found = converted(result.estimate, airframe, condition)
    # Coefficients go with derivatives in proportion.
    slopes = [converted(row, airframe, condition) for row in np.eye(len(result.names))]
    wrong = {
        cause: (share, converted(result.estimate, a, at))
        for cause, (share, a, at) in _assumed(airframe, condition).items()
    }
    elsewhere = []
    for m in moved:
        there = Condition(condition.airspeed_mps * m.airspeed_gain, condition.qbar_pa * m.qbar_gain)
        elsewhere.append((SHARED.get(m.error, m.error), converted(m.estimate, airframe, there)))
    quantile = result.half_width() / np.maximum(result.standard_error, 1e-300)
    answer = []
    for name, value in found.items():
        slope = np.array([row[name] for row in slopes])
        fit_error = float(np.sqrt(slope @ result.covariance @ slope))
        allowed = {
            cause: ((other[name] - value) / WIGGLE * share) ** 2
            for cause, (share, other) in wrong.items()
        }
        if name.endswith(("_alpha", "_beta")):
            allowed[VANE] = (value * airframe.upwash * airframe.upwash_share) ** 2
        by_sensors: dict[str, float] = {}
        for cause, other in elsewhere:
            by_sensors[cause] = by_sensors.get(cause, 0.0) + (other[name] - value) ** 2
        extra = sum(max(part, by_sensors.pop(cause, 0.0)) for cause, part in allowed.items())
        extra += sum(by_sensors.values())
        main = float(quantile[result.names.index(dimensional_name(name))])
        half = float(np.hypot(main * fit_error, 1.96 * np.sqrt(extra)))
        answer.append(Coefficient(name, value, fit_error, half))
    return tuple(answer)


WIGGLE = 1e-4  # share by which what is known is moved, to see what that does
QBAR, VANE = "dynamic pressure", "vanes"
SHARED = {"pitot_scale": QBAR, "pitot_zero_pa": QBAR, "alpha_scale": VANE, "beta_scale": VANE}


def _assumed(a: AirframeData, at: Condition) -> dict[str, tuple[float, AirframeData, Condition]]:
    """Return what is known to what share, and airframe and condition with it moved."""
    more = 1.0 + WIGGLE
    return {
        "mass": (a.mass_share, replace(a, mass_kg=a.mass_kg * more), at),
        "Ixx": (a.inertia_share, replace(a, ixx_kgm2=a.ixx_kgm2 * more), at),
        "Iyy": (a.inertia_share, replace(a, iyy_kgm2=a.iyy_kgm2 * more), at),
        "Izz": (a.inertia_share, replace(a, izz_kgm2=a.izz_kgm2 * more), at),
        QBAR: (a.pressure_share, a, replace(at, qbar_pa=at.qbar_pa * more)),
    }


def trim_of(columns: dict[str, Array]) -> tuple[Trim, Condition]:
    """Return trim and condition as means of a cut of a flight table."""
    mean = {name: float(np.mean(values)) for name, values in columns.items()}
    speed = mean["airspeed_mps"]
    qbar = mean.get("qbar_pa", 0.5 * mean.get("density_kgpm3", 1.225) * speed**2)
    return (
        Trim(speed, mean.get("alpha_rad", 0.0), mean.get("theta_rad", mean.get("alpha_rad", 0.0))),
        Condition(speed, qbar),
    )

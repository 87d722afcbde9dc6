"""What identification must know of the airframe, and turning derivatives into coefficients.

Conversions are written at the trim of the maneuvers; the uncertainty of mass, inertia, dynamic
pressure and reference sizes is carried into the intervals beside that of the fit.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from host.compiled import Array
from host.sysid.aircraft.gains import dimensional_name, from_dimensional
from host.sysid.models.result import FitResult
from host.sysid.models.templates import Trim


@dataclass(frozen=True, slots=True)
class AirframeData:
    """Mass, inertia, reference sizes, sensor positions with their relative uncertainties.

    Positions are in metres from the CG, x forward, y right, z down; relative numbers are standard
    deviations. `upwash` is the share by which the vanes over-read. Arms reach from the nominal CG
    back to where a tail surface's control force acts; 0 is not known.
    """

    name: str
    mass_kg: float
    ixx_kgm2: float
    iyy_kgm2: float
    izz_kgm2: float
    ixz_kgm2: float
    wing_area_m2: float
    span_m: float
    chord_m: float
    mass_share: float = 0.01
    inertia_share: float = 0.05
    pressure_share: float = 0.02
    imu_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
    vanes_m: tuple[tuple[float, float, float], ...] = ()
    upwash: float = 0.0
    upwash_share: float = 0.2
    elevator_arm_m: float = 0.0
    rudder_arm_m: float = 0.0
    arm_share: float = 0.06


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
class Condition:
    """Where a coefficient is taken: mean over the maneuvers."""

    airspeed_mps: float
    qbar_pa: float


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


def corrected(columns: dict[str, Array], airframe: AirframeData) -> dict[str, Array]:
    """Move vanes and accelerometers to the CG.

    A vane at r sees the air of the CG plus omega x r, and over-reads by the upwash; an
    accelerometer at r feels omega' x r + omega x (omega x r) more than the CG. The mean of the
    vanes is corrected for the mean of their positions: roll cancels between two tips.
    """
    result = dict(columns)
    still = np.zeros(len(columns["t_s"]))  # a record of one axis has not all rates
    rates = [columns.get(f"{a}_radps", still) for a in "pqr"]
    p, q, r = rates
    if airframe.vanes_m:
        x, y, z = np.mean(airframe.vanes_m, axis=0)
        speed = np.maximum(columns["airspeed_mps"], 1.0)
        if "alpha_rad" in columns:
            result["alpha_rad"] = (
                columns["alpha_rad"] / (1.0 + airframe.upwash) + (q * x - p * y) / speed
            )
        if "beta_rad" in columns:
            result["beta_rad"] = columns["beta_rad"] - (r * x - p * z) / speed
    if any(airframe.imu_m):
        x, y, z = airframe.imu_m
        dt_s = float(np.median(np.diff(columns["t_s"])))
        dp, dq, dr = (np.gradient(rate, dt_s) for rate in rates)
        felt = {
            "ax_mps2": dq * z - dr * y + q * (p * y - q * x) - r * (r * x - p * z),
            "ay_mps2": dr * x - dp * z + r * (q * z - r * y) - p * (p * y - q * x),
            "az_mps2": dp * y - dq * x + p * (r * x - p * z) - q * (q * z - r * y),
        }
        result |= {name: columns[name] - more for name, more in felt.items() if name in columns}
    return result

"""Coefficients of a linear answer from its dimensional derivatives, with intervals.

Conversions are at the trim of the maneuvers, thrust taken off. The uncertainty of mass, inertia,
dynamic pressure and reference sizes is added to that of the fit.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from host.aircraft.gains import coefficient_slopes, dimensional_name
from host.aircraft.mass_properties import AirframeData, Condition
from host.arrays import Array
from host.constants import NORMAL_95, STEEPEST_SINE
from host.instrument.deviations import dynamic_pressure_share
from host.instrument.error_list import QBAR, conversion_cause
from host.instrument.instrument_errors import InstrumentErrors, standard_errors
from host.sysid.aerodynamics.coefficient import Coefficient
from host.sysid.aerodynamics.path_thrust import PathThrust
from host.sysid.models.fit_result import FitResult
from host.sysid.models.templates import Trim
from host.sysid.models.uncertainty import consider_covariance, dominant_error_source


@dataclass(frozen=True, slots=True)
class ShiftedEstimate:
    """An estimate (P,) with one deviation of a sensor's error in it, and its condition then.

    `airspeed_gain` and `qbar_gain` are over those of the answer.
    """

    error: str
    estimate: Array
    airspeed_gain: float
    qbar_gain: float


@dataclass(frozen=True)
class CoefficientParts:
    """Coefficients of a linear answer and, apart, all that they may be wrong by.

    Attributes
    ----------
    names : tuple of str
    values : Array, shape (K,)
    statistical : Array, shape (K, K)
        Covariance by the fit alone.
    quantile : Array, shape (K,)
        Quantile of a two-sided 95 % interval, in standard errors: Student's where maneuvers are
        few.
    assumed : dict of str to (K,) Array
        Shift by one standard deviation of mass, inertia, thrust and upwash, and of the pitots where
        `sensed` has nothing of them, by error.
    sensed : tuple of (str, (K,) Array)
        Shift by one standard deviation of each sensor error.
    """

    names: tuple[str, ...]
    values: Array
    statistical: Array
    quantile: Array
    assumed: dict[str, Array]
    sensed: tuple[tuple[str, Array], ...]


def coefficient_parts(
    result: FitResult,
    airframe: AirframeData,
    condition: Condition,
    shifts: Sequence[ShiftedEstimate] = (),
    errors: InstrumentErrors | None = None,
    thrust: PathThrust | None = None,
) -> CoefficientParts:
    """Convert dimensional derivatives of the templates to coefficients.

    Parameters
    ----------
    result : FitResult
        Fit of a model whose parameters carry the template names (Z_alpha, M_q, L_p ...).
    airframe : AirframeData
        Mass properties and sizes.
    condition : Condition
        Airspeed and dynamic pressure of the maneuvers.
    shifts : sequence of ShiftedEstimate
        Shifts of the derivatives, by one deviation of each sensor error.
    errors : InstrumentErrors, optional
        What the pitots may be wrong by, where `shifts` has nothing of them; standard ones without.
    thrust : PathThrust, optional
        Thrust of the maneuvers, which is in the derivatives; none without.
    """
    path_thrust = thrust or PathThrust(0.0, 0.0)
    # Coefficients go with derivatives in proportion.
    names, slopes = coefficient_slopes(result.names, airframe, condition)

    def converted(
        derivatives: Array, a: AirframeData, at: Condition, path_thrust: PathThrust = path_thrust
    ) -> Array:
        by_thrust = path_thrust.in_derivatives(a.mass_kg, at.airspeed_mps)
        of_thrust = np.array([by_thrust.get(name, 0.0) for name in result.names])
        here = a is airframe and at == condition
        by_derivative = slopes if here else coefficient_slopes(result.names, a, at)[1]
        return np.asarray(by_derivative @ (derivatives - of_thrust))

    value = converted(result.estimate, airframe, condition)
    assumed: dict[str, Array] = {
        error: (converted(result.estimate, a, at) - value) / PERTURBATION * share
        for error, (share, a, at) in _perturbed_mass_properties(airframe, condition).items()
    }
    if path_thrust.deviation_n > 0.0:
        more = replace(path_thrust, along_n=path_thrust.along_n + path_thrust.deviation_n)
        assumed["thrust_share"] = converted(result.estimate, airframe, condition, more) - value
    if not any(conversion_cause(m.error) == QBAR for m in shifts):
        # Coefficients go with dynamic pressure inversely.
        assumed["pitot_scale"] = -value * dynamic_pressure_share(
            errors or standard_errors(), condition.qbar_pa
        )
    # An angle that accelerations determine saw no vane, and no upwash.
    seen = [f"_{y.removesuffix('_rad')}" for y in ANGLES if y in result.model.outputs]
    of_flow_angle = np.array([name.endswith(tuple(seen)) for name in names])
    assumed["upwash_share"] = np.asarray(
        of_flow_angle * value * airframe.upwash * airframe.upwash_share
    )
    sensed = []
    for m in shifts:
        there = Condition(condition.airspeed_mps * m.airspeed_gain, condition.qbar_pa * m.qbar_gain)
        sensed.append((m.error, converted(m.estimate, airframe, there) - value))
    quantile = result.half_width() / np.maximum(result.standard_error, 1e-300)
    return CoefficientParts(
        tuple(names),
        value,
        slopes @ result.covariance @ slopes.T,
        np.array([quantile[result.names.index(dimensional_name(name))] for name in names]),
        assumed,
        tuple(sensed),
    )


def coefficients(parts: CoefficientParts) -> tuple[Coefficient, ...]:
    """Return coefficients with intervals of everything.

    Mass, inertia, dynamic pressure, upwash and errors of sensors add to the fit's own. Errors of
    the vanes are what upwash allows for: the larger counts.
    """
    sensed: dict[str, list[Array]] = {}
    for error, shift in parts.sensed:
        sensed.setdefault(conversion_cause(error), []).append(shift)
    variances = _variances(parts.assumed, sensed)
    extra = sum(variances.values(), np.zeros(len(parts.names)))
    fit_error = np.sqrt(np.diag(parts.statistical))
    half = np.hypot(parts.quantile * fit_error, NORMAL_95 * np.sqrt(extra))
    return tuple(
        Coefficient(
            name,
            float(parts.values[k]),
            float(fit_error[k]),
            float(half[k]),
            dominant_error_source(
                {cause: float(part[k]) for cause, part in variances.items()},
                float(fit_error[k] ** 2 + extra[k]),
            ),
        )
        for k, name in enumerate(parts.names)
    )


def _variances(assumed: dict[str, Array], sensed: dict[str, list[Array]]) -> dict[str, Array]:
    """Return the variance of all coefficients by cause.

    Errors of the vanes are what upwash allows for: the larger counts.
    """
    found = {
        cause: np.diag(consider_covariance(np.stack(shifts))) for cause, shifts in sensed.items()
    }
    for error, shift in assumed.items():
        cause = conversion_cause(error)
        allowed = np.diag(consider_covariance(shift[None]))
        found[cause] = np.maximum(allowed, found.get(cause, 0.0))
    return found


PERTURBATION = 1e-4  # share by which a mass property is changed for its sensitivity
ANGLES = ("alpha_rad", "beta_rad")


def _perturbed_mass_properties(
    a: AirframeData, at: Condition
) -> dict[str, tuple[float, AirframeData, Condition]]:
    """Return tolerance, airframe and condition with each mass property perturbed, by its error."""
    more = 1.0 + PERTURBATION
    return {
        "mass_share": (a.mass_share, replace(a, mass_kg=a.mass_kg * more), at),
        "ixx_share": (a.inertia_share, replace(a, ixx_kgm2=a.ixx_kgm2 * more), at),
        "iyy_share": (a.inertia_share, replace(a, iyy_kgm2=a.iyy_kgm2 * more), at),
        "izz_share": (a.inertia_share, replace(a, izz_kgm2=a.izz_kgm2 * more), at),
    }


def trim_of(columns: dict[str, Array]) -> tuple[Trim, Condition]:
    """Return trim and condition as means of a cut of a flight table.

    Without `airspeed_mps` the airspeed is NaN: not known. Without `alpha_rad` the angle of attack
    is the pitch over the path, which `v_down_mps` tells, or level flight.
    """
    mean = {name: float(np.mean(values)) for name, values in columns.items()}
    speed = mean.get("airspeed_mps", float("nan"))
    qbar = mean.get("qbar_pa", 0.5 * mean.get("density_kgpm3", 1.225) * speed**2)
    alpha = mean["alpha_rad"] if "alpha_rad" in mean else _pitch_over_path(mean, speed)
    return Trim(speed, alpha, mean.get("theta_rad", alpha)), Condition(speed, qbar)


def _pitch_over_path(mean: Mapping[str, float], airspeed_mps: float) -> float:
    """Return the angle of attack by pitch and path; zero if nothing tells."""
    if not airspeed_mps > 0.0 or "theta_rad" not in mean:
        return 0.0
    sine = -mean.get("v_down_mps", 0.0) / airspeed_mps
    return float(mean["theta_rad"] - np.arcsin(np.clip(sine, -STEEPEST_SINE, STEEPEST_SINE)))

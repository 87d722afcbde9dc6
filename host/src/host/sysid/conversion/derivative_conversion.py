"""Dimensional derivatives to coefficients and back, with consider covariance.

Mass, inertias, place of the CG and the scales of pitot, vanes and surface pots are uncertain. Each
is a consider parameter: one more quantity of value 0 with its deviation in the joint covariance. A
wrong mass therefore changes a coefficient, and the conversion back undoes the change.

Dimensional derivatives are those of the templates, at the CG, per unit of the sensor readings.
Coefficients are per unit of the true quantities, with moments about the nominal CG. Etkin & Reid,
Dynamics of Flight, ch. 4; Klein & Morelli, Aircraft System Identification, ch. 3.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from host.aircraft.gains import (
    coefficient_name,
    dimensional_gains,
    dimensional_name,
    from_dimensional,
)
from host.aircraft.mass_properties import AirframeData, Condition
from host.arrays import Array
from host.constants import GRAVITY_MPS2
from host.errors import IdentificationError
from host.instrument.deviations import SensorErrorModel, deviations
from host.instrument.error_list import conversion_errors

SENSOR_SCALES = {
    "alpha": "alpha_scale", "beta": "beta_scale", "de": "elevator_scale", "da": "aileron_scale",
    "dr": "rudder_scale",
}  # fmt: skip
TEMPLATE_TERMS = {
    "Z": ("alpha", "q", "de"), "D": ("alpha", "de"), "M": ("alpha", "q", "de"),
    **dict.fromkeys(("Y", "L", "N"), ("beta", "p", "r", "da", "dr")),
}  # fmt: skip
# The derivatives that can be converted, and their coefficients in the same order.
DERIVATIVES = tuple(f"{row}_{label}" for row, labels in TEMPLATE_TERMS.items() for label in labels)
COEFFICIENTS = tuple(map(coefficient_name, DERIVATIVES))
STEP = 1e-4  # of a deviation, at least of 1e-6 of the value
Table = dict[str, float]


@dataclass(frozen=True, slots=True)
class Quantities:
    """Named numbers with their joint covariance: values (n,), covariance (n, n)."""

    names: tuple[str, ...]
    values: Array
    covariance: Array

    def value(self, name: str) -> float:
        """Return a value by name."""
        return float(self.values[self.names.index(name)])

    def deviation(self, name: str) -> float:
        """Return a standard deviation by name."""
        k = self.names.index(name)
        return float(np.sqrt(max(self.covariance[k, k], 0.0)))


@dataclass(frozen=True, slots=True)
class ConversionPoint:
    """The aircraft and flight condition of a conversion; `drag` is CD."""

    airframe: AirframeData
    condition: Condition
    alpha_rad: float = 0.0
    drag: float = 0.0


def consider_deviations(airframe: AirframeData, instrument: SensorErrorModel) -> dict[str, float]:
    """Return one standard deviation of every consider parameter of a conversion, by name."""
    every = deviations(instrument, airframe)
    return {name: every[name] for name in conversion_errors()}


def to_coefficients(
    derivatives: Quantities, point: ConversionPoint, errors: Mapping[str, float]
) -> Quantities:
    """Convert dimensional derivatives (A, B) to non-dimensional coefficients.

    Parameters
    ----------
    derivatives : Quantities
        Under the names of the templates (Z_alpha, M_q, L_p ...), SI; names of `conversion_errors()`
        among them are consider parameters, correlated with the others by the covariance. Other
        names are left out.
    point : ConversionPoint
    errors : mapping
        Standard deviations of further consider parameters (`consider_deviations`); what is absent
        is exact.

    Returns
    -------
    Quantities
        Coefficients in the order of the derivatives, then the errors.

    Raises
    ------
    IdentificationError
        If there is nothing to convert, or an error is not one of these.
    """

    def convert(values: Table) -> Table:
        own, scale = _true_point(point, values), _sensor_scale(point.airframe, values)
        found = {n: v * scale(n) for n, v in values.items() if n not in conversion_errors()}
        table = from_dimensional(found, own.airframe, own.condition)
        result = {coefficient_name(n): table[coefficient_name(n)] for n in found}
        return _transfer_moments(result, own, values, sign=1.0)

    return _converted(derivatives, DERIVATIVES, errors, convert)


def to_derivatives(
    coefficients: Quantities, point: ConversionPoint, errors: Mapping[str, float]
) -> Quantities:
    """Convert non-dimensional coefficients to the dimensional derivatives of (A, B).

    Parameters
    ----------
    coefficients : Quantities
        CL_alpha, Cm_q, Cl_p ...; the rest as in `to_coefficients`, errors too.
    point : ConversionPoint
    errors : mapping

    Returns
    -------
    Quantities
        Derivatives in the order of the coefficients, then the errors.
    """

    def convert(values: Table) -> Table:
        own, scale = _true_point(point, values), _sensor_scale(point.airframe, values)
        found = {n: v for n, v in values.items() if n not in conversion_errors()}
        found = _transfer_moments(found, own, values, sign=-1.0)
        gains = dimensional_gains(own.airframe, own.condition)
        result = {}
        for name in found:
            target = dimensional_name(name)
            total = sum(gain * found.get(c, 0.0) for c, gain in gains[target].items())
            result[target] = total / scale(target)
        return result

    return _converted(coefficients, COEFFICIENTS, errors, convert)


def _true_point(point: ConversionPoint, values: Table) -> ConversionPoint:
    """Return airframe and condition for given errors of mass, inertia, pitot and density."""
    a, at = point.airframe, point.condition
    frame = replace(
        a,
        mass_kg=a.mass_kg * (1.0 + values.get("mass_share", 0.0)),
        **{
            f"{i}_kgm2": getattr(a, f"{i}_kgm2") * (1.0 + values.get(f"{i}_share", 0.0))
            for i in ("ixx", "iyy", "izz")
        },
    )
    scale, drift_pa, density = (
        values.get(n, 0.0) for n in ("pitot_scale", "pitot_zero_pa", "density_share")
    )
    qbar_pa = (at.qbar_pa - drift_pa) / (1.0 + scale)
    share = float(np.sqrt(qbar_pa / at.qbar_pa / (1.0 + density)))
    return replace(point, airframe=frame, condition=Condition(at.airspeed_mps * share, qbar_pa))


def _sensor_scale(airframe: AirframeData, values: Table) -> Callable[[str], float]:
    """Return the ratio of sensor reading to true quantity, by the name of a derivative."""
    upwash = airframe.upwash
    over = (1.0 + upwash * (1.0 + values.get("upwash_share", 0.0))) / (1.0 + upwash)

    def scale(name: str) -> float:
        label = name.partition("_")[2]
        share = 1.0 + values.get(SENSOR_SCALES.get(label, ""), 0.0)
        return share * over if label == "alpha" else share

    return scale


def _transfer_moments(found: Table, point: ConversionPoint, values: Table, *, sign: float) -> Table:
    """Return coefficients with moments moved from the CG to the nominal CG (sign 1) or back (-1).

    M_nominal = M_cg + r x F, divided by chord or span.
    """
    x, z = (sign * values.get(f"cg_{k}_m", 0.0) for k in "xz")
    a, ca, sa = point.airframe, np.cos(point.alpha_rad), np.sin(point.alpha_rad)
    lift = a.mass_kg * GRAVITY_MPS2 / (point.condition.qbar_pa * a.wing_area_m2)
    result = dict(found)
    for name in found:
        row, _, label = name.partition("_")
        up, back, side = (found.get(f"{c}_{label}", 0.0) for c in ("CL", "CD", "CY"))
        if row == "Cm":
            if label == "alpha":  # the wind axes rotate with alpha
                up, back = up + point.drag, back - lift
            axial, normal = up * sa - back * ca, -up * ca - back * sa
            result[name] += (z * axial - x * normal) / a.chord_m
        elif row == "Cl":
            result[name] -= z * side / a.span_m
        elif row == "Cn":
            result[name] += x * side / a.span_m
    return {name: float(value) for name, value in result.items()}


def _converted(
    given: Quantities,
    known: tuple[str, ...],
    errors: Mapping[str, float],
    convert: Callable[[Table], Table],
) -> Quantities:
    """Return converted quantities and consider parameters with their joint covariance."""
    unknown = sorted(set(errors) - set(conversion_errors()))
    if unknown:
        raise IdentificationError(
            f"unknown error {', '.join(unknown)}; known are {', '.join(conversion_errors())}"
        )
    kept = [k for k, n in enumerate(given.names) if n in known or n in conversion_errors()]
    added = [n for n in conversion_errors() if n in errors and n not in given.names]
    names = [given.names[k] for k in kept] + added
    if not set(known) & set(names):
        raise IdentificationError(
            f"nothing to convert among {', '.join(given.names)}; known are such as"
            f" {', '.join(known[:4])}"
        )
    size = len(kept)
    state = np.concatenate([given.values[kept], np.zeros(len(added))])
    covariance = np.zeros((len(names), len(names)))
    covariance[:size, :size] = given.covariance[np.ix_(kept, kept)]
    covariance[range(size, len(names)), range(size, len(names))] = [errors[n] ** 2 for n in added]

    def mapped(values: Array) -> Array:
        table = dict(zip(names, values.tolist(), strict=True))
        own = {n: table[n] for n in names if n in conversion_errors()}
        return np.array([*convert(table).values(), *own.values()])

    steps = STEP * np.sqrt(np.maximum(np.diag(covariance), (1e-2 * state) ** 2 + 1e-16))
    slopes = np.stack(
        [
            (mapped(state + step * row) - mapped(state - step * row)) / (2.0 * step)
            for step, row in zip(steps, np.eye(len(names)), strict=True)
        ],
        axis=1,
    )
    table = dict(zip(names, state.tolist(), strict=True))
    converted = (*convert(table), *(n for n in names if n in conversion_errors()))
    return Quantities(converted, mapped(state), slopes @ covariance @ slopes.T)

"""Derivatives of one kind as those of the other, for `host convert`: read, converted, printed.

What is read is a model that `host identify --save-model` wrote, a table of a person's own, or what
AVL or Datcom say; what is known of the aircraft widens the intervals
(`conversion/derivative_conversion.py`).
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from host.aircraft.mass_properties import Condition, airframe_data
from host.aircraft.prior.prior_file import read_prior
from host.constants import NORMAL_95
from host.errors import IdentificationError
from host.files.quantities import Quantity
from host.files.user_text import read_toml, shown
from host.instrument.deviations import sensor_error_model
from host.instrument.error_list import conversion_errors, error_label
from host.sysid.conversion.derivative_conversion import (
    COEFFICIENTS,
    DERIVATIVES,
    ConversionPoint,
    Quantities,
    consider_deviations,
    to_coefficients,
    to_derivatives,
)
from host.sysid.models.model_file import read_model, read_trim
from host.sysid.models.parameter_units import parameter_unit
from host.sysid.models.templates import Trim, template
from host.sysid.models.uncertainty import DOMINANT_SHARE

STANDARD_KGPM3 = 1.225  # of the standard atmosphere at sea level
OTHER = dict(zip(DERIVATIVES, COEFFICIENTS, strict=True))
OTHER |= {coefficient: derivative for derivative, coefficient in OTHER.items()}
AXES = ("longitudinal", "lateral")
_LARGE = "M_alpha of an indoor model at 10 m/s: -1000 1/s2"
_VALUE = Quantity("", -1e6, 1e6, _LARGE)
_HALF_WIDTH = Quantity("", 0.0, 1e6, _LARGE)
EXPECTED = (
    "a model of host identify --save-model, TOML with [derivatives] or [coefficients], or output of"
    " AVL (ST, SB) or Datcom"
)


@dataclass(frozen=True, slots=True)
class FlightCondition:
    """Condition that the aircraft flies at; None is what the file or the aircraft says."""

    airspeed_mps: float | None = None
    alpha_rad: float | None = None
    density_kgpm3: float = STANDARD_KGPM3


@dataclass(frozen=True, slots=True)
class Conversion:
    """Numbers as they were given and what they became, errors of what is known behind both.

    `left_out` are names of the file that stand for no derivative of the templates.
    """

    source: str
    aircraft: str
    airspeed_mps: float
    alpha_rad: float
    density_kgpm3: float
    dimensional: bool
    given: Quantities
    found: Quantities
    left_out: tuple[str, ...]

    def half_width(self, name: str) -> float:
        """Return the 95 % half-width of a converted number."""
        return NORMAL_95 * self.found.deviation(name)

    def widened_by(self, name: str) -> str:
        """Return in words what known error widens a converted number most; nothing if little."""
        own = self.found.deviation(name) ** 2
        k = self.found.names.index(name)
        shares = {}
        for error in conversion_errors():
            j = self.found.names.index(error)
            part = self.found.covariance[k, j] ** 2 / max(self.found.covariance[j, j], 1e-300)
            shares[error] = part / max(own, 1e-300)
        cause = max(shares, key=shares.__getitem__)
        return error_label(cause) if shares[cause] >= DOMINANT_SHARE else ""


def convert(path: Path, aircraft: str, at: FlightCondition) -> Conversion:
    """Convert what a file says at one flight condition.

    Parameters
    ----------
    path : Path
    aircraft : str
        Name or path of an aircraft file.
    at : At

    Raises
    ------
    IdentificationError
        If the file cannot be read or holds nothing to convert.
    """
    airframe, instrument = airframe_data(aircraft), sensor_error_model(aircraft)
    values, trim = _from_toml(path) if path.suffix == ".toml" else ({}, None)
    speed = at.airspeed_mps or (trim.airspeed_mps if trim else instrument.friction_speed_mps)
    alpha = at.alpha_rad if at.alpha_rad is not None else trim.alpha_rad if trim else 0.0
    if not values:
        table = read_prior(path, speed)  # AVL, Datcom, or a table over the angle of attack
        values = {name: (value, 0.0) for name, value in table.at(alpha).items()}
    given = {n: v for n, v in values.items() if n in OTHER}
    dimensional = _dimensional(path, given)
    quantities = Quantities(
        tuple(given),
        np.array([value for value, _ in given.values()]),
        np.diag([(half / NORMAL_95) ** 2 for _, half in given.values()]),
    )
    place = ConversionPoint(airframe, Condition(speed, 0.5 * at.density_kgpm3 * speed**2), alpha)
    turn = to_coefficients if dimensional else to_derivatives
    return Conversion(
        source=str(path),
        aircraft=airframe.name,
        airspeed_mps=speed,
        alpha_rad=alpha,
        density_kgpm3=at.density_kgpm3,
        dimensional=dimensional,
        given=quantities,
        found=turn(quantities, place, consider_deviations(airframe, instrument)),
        left_out=tuple(n for n in values if n not in given),
    )


def _dimensional(path: Path, given: Collection[str]) -> bool:
    """Return whether names are those of derivatives; refuse both kinds in one file, and none."""
    dimensional = [n for n in given if n in DERIVATIVES]
    if dimensional and len(dimensional) < len(given):
        raise IdentificationError(f"{path}: both derivatives and coefficients, expected one kind")
    if not given:
        raise IdentificationError(f"{path}: nothing to convert; expected {EXPECTED}")
    return bool(dimensional)


def _from_toml(path: Path) -> tuple[dict[str, tuple[float, float]], Trim | None]:
    """Return values with half-widths, and what they are about; nothing of a table over alpha."""
    document = read_toml(path, IdentificationError)
    if "states" in document:
        model = read_model(path)
        fit = document.get("fit", {})
        if not isinstance(fit, dict):
            raise IdentificationError(f"{path}: fit is {shown(fit)}, expected a table")
        values = {p.name: _pair(path, p.name, fit.get(p.name, p.start)) for p in model.parameters}
        return values, read_trim(path) if "trim" in document else None
    if "alpha_deg" in document:
        return {}, None
    tables = [document.get(key, {}) for key in ("derivatives", "coefficients")]
    if not any(tables):
        raise IdentificationError(f"{path}: nothing to convert; expected {EXPECTED}")
    if not all(isinstance(table, dict) for table in tables):
        raise IdentificationError(f"{path}: expected lines such as M_q = -12.0 in [derivatives]")
    return {n: _pair(path, n, x) for table in tables for n, x in table.items()}, None


def saved_values(path: Path) -> dict[str, tuple[float, float]]:
    """Return every parameter of a saved model with its 95 % half-width, 0 where it has none.

    Raises
    ------
    IdentificationError
        The file is no model, or holds no pair of numbers where one belongs.
    """
    return _from_toml(path)[0]


def _pair(path: Path, name: str, entry: object) -> tuple[float, float]:
    """Return value and half-width of ``4.1`` or ``[4.1, 0.2]``."""
    listed = entry if isinstance(entry, list) else [entry, 0.0]
    where = f"{path}: {name}"
    if len(listed) != 2 or isinstance(listed[0], str):
        raise IdentificationError(
            f"{where} is {shown(entry)}, expected a number or [value, 95 % half-width]"
        )
    return (
        _VALUE.check(where, listed[0], IdentificationError),
        _HALF_WIDTH.check(f"{where}: half-width", listed[1], IdentificationError),
    )


def _unit(name: str) -> str:
    """Return the unit of a derivative of the templates; nothing of a coefficient."""
    units = (parameter_unit(template(axis, Trim(1.0, 0.0, 0.0)), name) for axis in AXES)
    return next(filter(None, units), "")


def conversion_lines(done: Conversion) -> list[str]:
    """Return the conversion as a table for people."""
    kinds = ("derivatives", "coefficients")
    before, after = kinds if done.dimensional else kinds[::-1]
    lines = [
        f"{done.source}: {before} to {after} of {done.aircraft} at {done.airspeed_mps:.2f} m/s,"
        f" alpha {np.degrees(done.alpha_rad):.1f} deg, {done.density_kgpm3:.3f} kg/m3;"
        " value and 95 % half-width"
    ]
    for name in done.given.names:
        other = OTHER[name]
        half = NORMAL_95 * done.given.deviation(name)
        lines.append(
            f"  {name:9s} {done.given.value(name):10.4g} +- {half:8.2g} {_unit(name):6s}"
            f"  {other:9s} {done.found.value(other):10.4g} +- {done.half_width(other):8.2g}"
            f" {_unit(other):6s}  {done.widened_by(other)}".rstrip()
        )
    lines.append(
        "  half-widths hold mass, inertia, place of the CG and calibration; the file's own count as"
        " independent of each other; last: what of it widens most"
    )
    if done.left_out:
        lines.append(f"  left out, no derivative of the templates: {', '.join(done.left_out)}")
    return lines


def conversion_document(done: Conversion) -> dict[str, Any]:
    """Return the conversion for programs."""
    return {
        "source": done.source,
        "aircraft": done.aircraft,
        "airspeed_mps": done.airspeed_mps,
        "alpha_rad": done.alpha_rad,
        "density_kgpm3": done.density_kgpm3,
        "to": "coefficients" if done.dimensional else "derivatives",
        "given": {
            n: {"value": done.given.value(n), "half_width": NORMAL_95 * done.given.deviation(n)}
            for n in done.given.names
        },
        "converted": {
            n: {
                "value": done.found.value(n),
                "half_width": done.half_width(n),
                "widened_by": done.widened_by(n),
            }
            for n in (OTHER[name] for name in done.given.names)
        },
        "standard_deviations": {n: done.found.deviation(n) for n in conversion_errors()},
        "left_out": list(done.left_out),
    }

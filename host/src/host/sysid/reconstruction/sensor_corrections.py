"""Correct a flight's columns by reconstructed sensor errors; what remains uncertain.

Errors that the data do not inform are left as calibrated; their uncertainty stays in the intervals.
"""

from __future__ import annotations

import textwrap
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from host.arrays import Array
from host.constants import NORMAL_95
from host.people_units import people_name
from host.sysid.reconstruction.flight_path import AIR, DELAYS, FLOW, INERTIAL, PITOT
from host.sysid.reconstruction.path_preparation import density_share
from host.sysid.reconstruction.reconstruction import Compatibility

RATES = tuple(f"{a}_radps" for a in "pqr")
FORCES = tuple(f"a{a}_mps2" for a in "xyz")
ATTITUDE = ("phi_rad", "theta_rad")
# An error of density and dynamic pressure that leaves V squared as it is: nothing observes it.
DENSITY = "density_share"
INSTANTANEOUS_ERRORS = (*INERTIAL, *FLOW, *PITOT, DENSITY)  # without delays
# The pitot's delay is not corrected: even a survey flight tells it to 7 ms only.
DELAYED_COLUMNS = {DELAYS[0]: AIR[1:]}
CORRECTABLE = (*INSTANTANEOUS_ERRORS, *DELAYED_COLUMNS)
LEAST_PRESSURE_SHARE = 0.1


@dataclass(frozen=True, slots=True)
class Correction:
    """One corrected error: value, its 95 % half-width, and that of the calibration."""

    name: str
    value: float
    half_width: float
    calibration_half_width: float


def corrections(found: Compatibility) -> tuple[Correction, ...]:
    """Return the errors that the data inform and that columns can be corrected for."""
    return tuple(
        Correction(f.name, f.value, f.half_width, f.prior_half_width)
        for f in found.findings
        if f.data_informed and f.name in CORRECTABLE
    )


def without_estimated_delays(found: Compatibility) -> Compatibility:
    """Return a check with the delays of the aircraft file in place of estimated ones."""
    return replace(
        found,
        findings=tuple(
            replace(f, data_informed=False, reason="not asked for")
            if f.name in DELAYED_COLUMNS
            else f
            for f in found.findings
        ),
    )


def residual_deviations(found: Compatibility) -> dict[str, float]:
    """Return the standard deviation that remains of every error: estimated or calibrated."""
    remaining = {
        f.name: (f.half_width if f.data_informed else f.prior_half_width) / NORMAL_95
        for f in found.findings
        if f.name in CORRECTABLE
    }
    if PITOT[0] in remaining:
        remaining[DENSITY] = _density_given_airspeed(found)
    return remaining


def pressure_share(found: Compatibility) -> float:
    """Return the share of an error of V squared that is due to the pitot, not to density."""
    total = found["pitot_scale"].prior_half_width / NORMAL_95
    density = density_share(found.instrument)
    if not density > 0.0:
        return 1.0
    return max(1.0 - (density / max(total, density)) ** 2, LEAST_PRESSURE_SHARE)


def _density_given_airspeed(found: Compatibility) -> float:
    """Return the standard deviation of density once V squared is known.

    Scales of pitot and density make V squared together. What they leave it to be is one error,
    `pitot_scale`, of which dynamic pressure has `pressure_share`. How it divides between the two
    is another, independent of it. Without that dynamic pressure counts as known to 1.8 % where
    the pitot's scale is known to 2.
    """
    return float(np.sqrt(pressure_share(found))) * density_share(found.instrument)


def pressure_scale(found: Compatibility) -> tuple[float, float] | None:
    """Return the share by which dynamic pressure reads high, and its 95 % half-width.

    None where the data do not tell the pitot's scale; what of it is density is not in it, and its
    uncertainty is.
    """
    scale = next((f for f in found.findings if f.name == "pitot_scale" and f.data_informed), None)
    if scale is None:
        return None
    part, density = pressure_share(found), NORMAL_95 * _density_given_airspeed(found)
    return part * scale.value, float(np.hypot(part * scale.half_width, density))


def correct_columns(
    columns: Mapping[str, Array], errors: Mapping[str, float], part: float = 1.0
) -> dict[str, Array]:
    """Return columns corrected for errors of scale, zero, bias and misalignment.

    A sensor reads s = (1 + scale) x + bias in the IMU's own, misaligned axes; the pitot likewise
    for V squared (EQUATIONS.md, eq. 12). Attitude is that of the IMU, and turns with it.

    Parameters
    ----------
    columns : mapping of (n,) arrays
        SI, already at the CG.
    errors : mapping
        Names of `INSTANTANEOUS_ERRORS` to values; others are ignored.
    part : float
        Share of ``pitot_scale`` that is due to dynamic pressure; the rest is density.
    """
    result = dict(columns)
    at = errors.get
    tilt = np.array([at(f"imu_tilt_{a}_rad", 0.0) for a in "xyz"])
    for names, offset, gain in (
        (RATES, "gyro_{}_bias_radps", "gyro_{}_scale"),
        (FORCES, "accel_{}_bias_mps2", "accel_{}_scale"),
    ):
        own = [pattern.format(a) for pattern in (offset, gain) for a in "xyz"]
        unmoved = not (tilt.any() or any(at(name) for name in own))
        if unmoved or not all(name in columns for name in names):
            continue
        corrected = np.stack(
            [
                (columns[name] - at(offset.format(a), 0.0)) / (1.0 + at(gain.format(a), 0.0))
                for name, a in zip(names, "xyz", strict=True)
            ]
        )
        result |= zip(names, corrected + np.cross(tilt, corrected, axisb=0, axisc=0), strict=True)
    for name in ("alpha", "beta"):
        zero, scale = at(f"{name}_zero_rad", 0.0), at(f"{name}_scale", 0.0)
        if f"{name}_rad" in columns and (zero or scale):
            result[f"{name}_rad"] = (columns[f"{name}_rad"] - zero) / (1.0 + scale)
    return result | _level_attitude(columns, tilt) | _correct_pitot(columns, errors, part)


def _level_attitude(columns: Mapping[str, Array], tilt: Array) -> dict[str, Array]:
    """Return the attitude of the aircraft in place of that of an IMU with a small tilt in it.

    Where no vane measured it, the angle of attack of the trim is pitch over path: with a tilt left
    in it, rates about other axes than those of the angle pass for a false N_p.
    """
    if not (tilt.any() and all(name in columns for name in ATTITUDE)):
        return {}
    phi, theta = (columns[name] for name in ATTITUDE)
    about_y = tilt[1] * np.cos(phi) - tilt[2] * np.sin(phi)
    about_z = tilt[1] * np.sin(phi) + tilt[2] * np.cos(phi)
    level = (phi - tilt[0] - about_z * np.tan(theta), theta - about_y)
    return dict(zip(ATTITUDE, level, strict=True))


def _correct_pitot(
    columns: Mapping[str, Array], errors: Mapping[str, float], part: float
) -> dict[str, Array]:
    scale, zero, density_error = (errors.get(name, 0.0) for name in (*PITOT, DENSITY))
    density = columns.get("density_kgpm3", np.array(1.225))
    corrected = {}
    if AIR[0] in columns:
        square = columns[AIR[0]] ** 2 - 2.0 * zero / density
        corrected[AIR[0]] = np.sqrt(np.maximum(square, 0.0) / (1.0 + scale))
    if "qbar_pa" in columns:
        corrected["qbar_pa"] = (
            (columns["qbar_pa"] - zero) / (1.0 + part * scale) / (1.0 + density_error)
        )
    if "density_kgpm3" in columns:
        corrected["density_kgpm3"] = (
            density * (1.0 + scale) / (1.0 + part * scale) / (1.0 + density_error)
        )
    return corrected


def advance_delayed(columns: Mapping[str, Array], delays: Mapping[str, float]) -> dict[str, Array]:
    """Return columns advanced by their sensors' delays (s) behind the IMU."""
    result = dict(columns)
    for delay, names in DELAYED_COLUMNS.items():
        for name in names:
            if name in columns and delay in delays:
                t = columns["t_s"]
                result[name] = np.interp(t + delays[delay], t, columns[name])
    return result


def correction_lines(taken: Sequence[Correction]) -> list[str]:
    """Return the verdict's lines on the corrections."""
    if not taken:
        return []
    parts = ", ".join(
        f"{name} {factor * c.value:.3g} +- {factor * c.half_width:.2g}"
        for c, (name, factor) in ((c, people_name(c.name)) for c in taken)
    )
    return textwrap.wrap(
        f"sensor errors corrected in the columns of linear fits: {parts}",
        100,
        subsequent_indent="  ",
        break_on_hyphens=False,
    )


def correction_document(taken: Sequence[Correction]) -> dict[str, dict[str, float]]:
    """Return the corrections for JSON."""
    return {
        c.name: {
            "value": c.value,
            "half_width": c.half_width,
            "calibration_half_width": c.calibration_half_width,
        }
        for c in taken
    }

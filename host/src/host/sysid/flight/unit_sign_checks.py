"""Units and signs that cannot be: gravity, kinematics and damping tell what a map forgot.

A column in degrees or an axis turned round still fits some model well. What physics forbids is
refused, what another convention could mean is a note.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from host.arrays import Array
from host.constants import GRAVITY_MPS2
from host.sysid.flight.kinematic_checks import BLOCK_S, FEWEST, HINT, SURE, block_means, consistent
from host.sysid.identification_error import IdentificationError

BOUNDED = ("alpha_rad", "beta_rad", "theta_rad")
DOUBTFUL_RAD = 1.0  # of such an angle in flight, and of a surface at any moment
IDLE_RAD = 0.0035  # a surface that swings less between its ends excites nothing
STRONG = 10.0  # deviations
DENSITY = (0.4, 1.6)
STATIC_PA = (2e4, 1.2e5)
THROTTLE = (-0.2, 1.2)
PITOT = (0.5, 2.0)
# Left side, regressors beside the surface, expected sign: elevator positive trailing edge down.
SURFACES = {
    "elevator_rad": ("q_radps", ("alpha_rad", "q_radps"), -1.0, "pitch the nose up"),
    "aileron_rad": ("p_radps", ("beta_rad", "p_radps", "r_radps", "rudder_rad"), 1.0, "roll left"),
    "rudder_rad": (
        "r_radps", ("beta_rad", "p_radps", "r_radps", "aileron_rad"), -1.0, "yaw the nose right",
    ),
}  # fmt: skip


def check(columns: Mapping[str, Array]) -> list[str]:
    """Return what looks like a forgotten unit or sign.

    Parameters
    ----------
    columns : mapping
        SI columns on an even grid.

    Raises
    ------
    IdentificationError
        If columns contradict physics or each other.
    """
    dt_s = float(columns["t_s"][1] - columns["t_s"][0])
    flying = np.ones(len(columns["t_s"]), dtype=bool)
    if "airspeed_mps" in columns:
        speed = columns["airspeed_mps"]
        flying = speed > 0.5 * float(np.median(speed))
    flown = {k: v[flying] for k, v in columns.items()}
    if len(flown["t_s"]) < FEWEST:
        return []
    notes = _angles(flown)
    notes += _gravity(flown)
    _air(flown)
    notes += _surface_sizes(flown)
    means = block_means(flown, max(1, round(BLOCK_S / dt_s)))
    if len(means["t_s"]) >= FEWEST:
        _forces(means)
        notes += _surfaces(means)
    return notes + consistent(flown, dt_s)


def _angles(flown: Mapping[str, Array]) -> list[str]:
    notes = []
    for name in BOUNDED:
        if name not in flown:
            continue
        size = float(np.quantile(np.abs(flown[name]), 0.95))
        if size > np.pi:
            raise IdentificationError(
                f"{name} reaches {size:.3g} rad in flight: in degrees? {HINT}"
            )
        if size > DOUBTFUL_RAD:
            notes.append(f"{name} reaches {size:.2f} rad in flight: in degrees? {HINT}")
    return notes


def _surface_sizes(flown: Mapping[str, Array]) -> list[str]:
    """Look at the ends of surfaces: at rest for most of a flight, no quantile shows their unit."""
    notes = []
    for name in SURFACES:
        if name not in flown:
            continue
        low, high = np.quantile(flown[name], (0.001, 0.999))
        size, swing = max(-float(low), float(high)), float(high - low)
        if size > 0.5 * np.pi:
            raise IdentificationError(
                f"{name} reaches {size:.3g} rad in flight: in degrees? {HINT}"
            )
        if size > DOUBTFUL_RAD:
            notes.append(f"{name} reaches {size:.2f} rad in flight: in degrees? {HINT}")
        elif 0.0 < swing < IDLE_RAD:
            notes.append(
                f"{name} moves by {np.rad2deg(swing):.2g} deg in all: idle, or in radians already"
                f" where the map says degrees?"
            )
    return notes


def _gravity(flown: Mapping[str, Array]) -> list[str]:
    if "az_mps2" not in flown:
        return []
    axes = [flown[k] for k in ("ax_mps2", "ay_mps2", "az_mps2") if k in flown]
    size = float(np.median(np.sqrt(sum(a**2 for a in axes))))
    down = float(np.median(flown["az_mps2"]))
    for unit, one in (("g", 1.0), ("ft/s2", GRAVITY_MPS2 / 0.3048), ("mg", 1000.0)):
        for name, found in (("specific force", size), ("az_mps2", abs(down))):
            if 0.7 * one < found < 1.4 * one:
                raise IdentificationError(
                    f"{name} is {found:.3g} m/s2 in the median of the flight, not 9.8:"
                    f" in {unit}? {HINT}"
                )
    if down > 0.5 * GRAVITY_MPS2:
        raise IdentificationError(
            f"az_mps2 is {down:+.3g} m/s2 in the median of the flight: the axis points up, ours"
            f" down; {HINT}"
        )
    if not 0.5 * GRAVITY_MPS2 < size < 2.0 * GRAVITY_MPS2:
        return [
            f"specific force is {size:.3g} m/s2 in the median of the flight, not 9.8: accelerations"
            " without gravity, or another unit?"
        ]
    return []


def _air(flown: Mapping[str, Array]) -> None:
    if "airspeed_mps" in flown and float(np.median(flown["airspeed_mps"])) <= 0.0:
        raise IdentificationError(f"airspeed_mps is not above zero in flight: {HINT}")
    for name, (least, most), unit in (
        ("static_pa", STATIC_PA, "Pa"), ("throttle", THROTTLE, "of full"),
    ):  # fmt: skip
        middle = float(np.median(flown[name])) if name in flown else least
        if not least <= middle <= most:
            raise IdentificationError(f"{name} is {middle:.4g} {unit}: {HINT}")
    density = 1.225
    if "density_kgpm3" in flown:
        density = float(np.median(flown["density_kgpm3"]))
        if not DENSITY[0] < density < DENSITY[1]:
            raise IdentificationError(f"density_kgpm3 is {density:.3g} kg/m3: {HINT}")
    if "airspeed_mps" in flown and "qbar_pa" in flown:
        expected = 0.5 * density * float(np.median(flown["airspeed_mps"] ** 2))
        ratio = float(np.median(flown["qbar_pa"])) / max(expected, 1e-9)
        if not PITOT[0] < ratio < PITOT[1]:
            raise IdentificationError(
                f"qbar_pa is {ratio:.3g} times what airspeed_mps makes of it: one of them has"
                f" another unit; {HINT}"
            )


def _forces(means: Mapping[str, Array]) -> None:
    """Hold the wind angles against the forces they make."""
    for angle, force in (("alpha_rad", "az_mps2"), ("beta_rad", "ay_mps2")):
        if angle in means and force in means:
            agreement, _ = _correlation(np.diff(means[angle]), np.diff(means[force]))
            if agreement > SURE:
                raise IdentificationError(
                    f"{angle} and {force} rise together (correlation {agreement:.2f}), where lift"
                    f" and side force oppose: one of them has the wrong sign; {HINT}"
                )


def _surfaces(means: Mapping[str, Array]) -> list[str]:
    """Regress angular accelerations on surfaces; a note, for a canard may mean it."""
    notes = []
    for surface, (rate, beside, expected, wrong) in SURFACES.items():
        needed = (surface, rate, beside[0])  # without the wind angle its moment is the surface's
        if any(name not in means for name in needed):
            continue
        others = [means[k] for k in beside if k in means]
        left = np.gradient(means[rate], means["t_s"])
        X = np.column_stack([means[surface], *others, np.ones(len(left))])
        size = np.maximum(np.abs(X).max(axis=0), 1e-12)
        beta, *_ = np.linalg.lstsq(X / size, left, rcond=None)
        spread = float(np.sum((left - X / size @ beta) ** 2)) / max(len(left) - X.shape[1], 1)
        own = float(np.linalg.pinv((X / size).T @ (X / size))[0, 0])
        if expected * beta[0] < -STRONG * np.sqrt(spread * own):
            notes.append(
                f"{surface} positive seems to {wrong}, against our sign"
                " (elevator trailing edge down, rudder trailing edge left, aileron rolls right):"
                f" {HINT}"
            )
    return notes


def _correlation(x: Array, y: Array) -> tuple[float, float]:
    """Return the correlation, and how many times larger y swings than x."""
    x, y = x - x.mean(), y - y.mean()
    across = float(np.sqrt(np.sum(x**2) * np.sum(y**2)))
    if across < 1e-12 * len(x):
        return 0.0, 1.0
    return float(np.sum(x * y)) / across, float(
        np.sqrt(np.sum(y**2) / max(float(np.sum(x**2)), 1e-300))
    )

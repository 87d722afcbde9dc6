"""Units and signs that cannot be: gravity, kinematics and damping tell what a map forgot.

A column in degrees or an axis turned round still fits some model well. What physics forbids is
refused, what another convention could mean is a note.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from host.compiled import Array
from host.sysid.errors import IdentificationError
from host.sysid.models.templates import GRAVITY_MPS2

BOUNDED = ("alpha_rad", "beta_rad", "theta_rad", "elevator_rad", "aileron_rad", "rudder_rad")
DOUBTFUL_RAD = 1.0  # of such an angle in flight
BLOCK_S = 0.1  # slopes and correlations are those of means over this long
SURE = 0.5  # correlation
FACTOR = 2.0  # between attitude and rate: one of them is in another unit
STRONG = 10.0  # deviations
DENSITY = (0.4, 1.6)
PITOT = (0.5, 2.0)
# Left side, regressors beside the surface, expected sign: elevator positive trailing edge down.
SURFACES = {
    "elevator_rad": ("q_radps", ("alpha_rad", "q_radps"), -1.0, "pitch the nose up"),
    "aileron_rad": ("p_radps", ("beta_rad", "p_radps", "r_radps", "rudder_rad"), 1.0, "roll left"),
    "rudder_rad": (
        "r_radps", ("beta_rad", "p_radps", "r_radps", "aileron_rad"), -1.0, "yaw the nose right",
    ),
}  # fmt: skip
HINT = "give its unit or sign in the map (--map)"


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
    if len(flown["t_s"]) < 32:
        return []
    notes = _angles(flown)
    notes += _gravity(flown)
    _air(flown)
    means = _means(flown, max(1, round(BLOCK_S / dt_s)))
    if len(means["t_s"]) < 32:
        return notes
    _kinematics(means)
    _forces(means)
    return notes + _surfaces(means)


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


def _gravity(flown: Mapping[str, Array]) -> list[str]:
    if "az_mps2" not in flown:
        return []
    axes = [flown[k] for k in ("ax_mps2", "ay_mps2", "az_mps2") if k in flown]
    size = float(np.median(np.sqrt(sum(a**2 for a in axes))))
    down = float(np.median(flown["az_mps2"]))
    for unit, one in (("g", 1.0), ("ft/s2", GRAVITY_MPS2 / 0.3048), ("mg", 1000.0)):
        if 0.7 * one < size < 1.4 * one:
            raise IdentificationError(
                f"specific force is {size:.3g} m/s2 in the median of the flight, not 9.8:"
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


def _means(flown: Mapping[str, Array], block: int) -> dict[str, Array]:
    count = len(flown["t_s"]) // block
    return {k: v[: count * block].reshape(count, block).mean(axis=1) for k, v in flown.items()}


def _kinematics(means: Mapping[str, Array]) -> None:
    """Hold rates against the attitude they turn."""
    zero = np.zeros(len(means["t_s"]))
    phi, theta = means.get("phi_rad", zero), means.get("theta_rad", zero)
    p, q, r = (means.get(f"{k}_radps") for k in "pqr")
    pairs = []
    if q is not None and "theta_rad" in means:
        pairs.append(
            ("q_radps", "theta_rad", q * np.cos(phi) - (0.0 if r is None else r) * np.sin(phi))
        )
    if p is not None and "phi_rad" in means:
        turn = (0.0 if q is None else q) * np.sin(phi) + (0.0 if r is None else r) * np.cos(phi)
        pairs.append(("p_radps", "phi_rad", p + np.tan(np.clip(theta, -1.2, 1.2)) * turn))
    if r is not None and "psi_rad" in means:
        turn = (0.0 if q is None else q) * np.sin(phi) + r * np.cos(phi)
        pairs.append(("r_radps", "psi_rad", turn / np.cos(np.clip(theta, -1.2, 1.2))))
    for rate, angle, expected in pairs:
        step_s = np.diff(means["t_s"])
        seen, told = np.diff(means[angle]) / step_s, 0.5 * (expected[1:] + expected[:-1])
        calm = step_s < 2.0 * float(np.median(step_s))
        agreement, slope = _correlation(told[calm], seen[calm])
        if agreement < -SURE:
            raise IdentificationError(
                f"{rate} and {angle} turn opposite ways (correlation {agreement:.2f}): one of them"
                f" has the wrong sign; {HINT}"
            )
        if agreement > SURE and not 1.0 / FACTOR < slope < FACTOR:
            raise IdentificationError(
                f"{angle} turns {slope:.3g} times as fast as {rate} says: one of them has another"
                f" unit; {HINT}"
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

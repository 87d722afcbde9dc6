"""Units and signs that cannot be: gravity, kinematics and damping tell what a map forgot.

A column in degrees or an axis turned round still fits some model well. What physics forbids proves
a wrong unit or sign; what another convention could mean is only in doubt.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from host.arrays import Array
from host.constants import CERTAIN_SD, GRAVITY_MPS2
from host.sysid.checks.data_finding import HINT, Finding
from host.sysid.checks.identity_factors import SIGN_CORRELATION, correlation
from host.sysid.checks.kinematic_checks import consistent
from host.sysid.checks.kinematic_identities import BLOCK_S, FEWEST, block_means
from host.sysid.maneuvers.free_response import MOVED_RAD
from host.sysid.maneuvers.maneuver_detection import FLYING_SHARE, THROTTLE

BOUNDED = ("alpha_rad", "beta_rad", "theta_rad")
DOUBTFUL_RAD = 1.0  # of such an angle in flight, and of a surface at any moment
NUMERICAL_RAD = 1e-9  # that a simulation moves one by that nobody moved
SIGN_DEVIATIONS = 10.0  # deviations
RATES = ("p_radps", "q_radps", "r_radps")
WITHOUT_GRAVITY = 0.5  # of the size: with less along z, weight is not in it
DENSITY = (0.4, 1.6)
STATIC_PA = (2e4, 1.2e5)
PRESSURE_RATIO = (0.5, 2.0)
# Left side, auxiliary regressors, expected sign: elevator positive trailing edge down.
SURFACES = {
    "elevator_rad": ("q_radps", ("alpha_rad", "q_radps"), -1.0, "pitch the nose up"),
    "aileron_rad": ("p_radps", ("beta_rad", "p_radps", "r_radps", "rudder_rad"), 1.0, "roll left"),
    "rudder_rad": (
        "r_radps", ("beta_rad", "p_radps", "r_radps", "aileron_rad"), -1.0, "yaw the nose right",
    ),
}  # fmt: skip


def check(columns: Mapping[str, Array]) -> list[Finding]:
    """Return a finding for each column whose unit or sign looks wrong.

    Parameters
    ----------
    columns : mapping
        SI columns on an even grid.
    """
    flown, dt_s = airborne(columns)
    if len(flown["t_s"]) < FEWEST:
        return []
    findings = [*_angles(flown), *_gravity(flown), *_air(flown), *_surface_sizes(flown)]
    means = block_means(flown, max(1, round(BLOCK_S / dt_s)))
    if len(means["t_s"]) >= FEWEST:
        findings += [*_forces(means), *_surfaces(means), *_exchanged(means)]
    weighed = not any(f.check == "gravity" for f in findings)
    return _unique_findings([*findings, *consistent(flown, dt_s, weighed=weighed)])


def airborne(columns: Mapping[str, Array]) -> tuple[dict[str, Array], float]:
    """Return the columns in flight where they were measured, and the time between samples, s."""
    dt_s = float(columns["t_s"][1] - columns["t_s"][0])
    flying = np.ones(len(columns["t_s"]), dtype=bool)
    if "airspeed_mps" in columns:
        speed = np.abs(columns["airspeed_mps"])
        flying = speed > FLYING_SHARE * float(np.median(speed))
    flying &= ~(columns.get("bridged", np.zeros(len(flying))) > 0.0)
    return {k: v[flying] for k, v in columns.items()}, dt_s


def _unique_findings(findings: list[Finding]) -> list[Finding]:
    """Return the first finding of each check about the same columns."""
    return list({(f.check, f.channels): f for f in reversed(findings)}.values())[::-1]


def _degrees(check: str, name: str, size: float, *, sure: bool) -> Finding:
    return Finding(
        check,
        (name,),
        f"{name} reaches {size:.3g} rad in flight",
        (f"degrees: {HINT}",),
        wrong_unit=sure,
    )


def _angles(flown: Mapping[str, Array]) -> list[Finding]:
    sizes = {k: float(np.quantile(np.abs(flown[k]), 0.95)) for k in BOUNDED if k in flown}
    return [
        _degrees("angle-size", name, size, sure=size > np.pi)
        for name, size in sizes.items()
        if size > DOUBTFUL_RAD
    ]


def _surface_sizes(flown: Mapping[str, Array]) -> list[Finding]:
    """Check the unit of surfaces by their ends: at rest most of the time, no quantile shows it."""
    findings = []
    for name in SURFACES:
        if name not in flown:
            continue
        low, high = np.quantile(flown[name], (0.001, 0.999))
        size, swing = max(-float(low), float(high)), float(high - low)
        if size > DOUBTFUL_RAD:
            findings.append(_degrees("surface-size", name, size, sure=size > 0.5 * np.pi))
        elif NUMERICAL_RAD < swing < MOVED_RAD:
            text = f"{name} moves by {np.rad2deg(swing):.2g} deg in all"
            causes = ("a surface that was left alone", "radians that the map takes for degrees")
            findings.append(Finding("surface-idle", (name,), text, causes))
    return findings


def _gravity(flown: Mapping[str, Array]) -> list[Finding]:
    """Compare specific force with weight: in level flight it is as large and points up."""
    names = tuple(k for k in ("ax_mps2", "ay_mps2", "az_mps2") if k in flown)
    if "az_mps2" not in names:
        return []
    size = float(np.median(np.sqrt(sum(flown[k] ** 2 for k in names))))
    down = float(np.median(flown["az_mps2"]))
    weighed = (abs(down), size if abs(down) > WITHOUT_GRAVITY * size else 0.0)
    # Weight is always there, lift changes about it: of accelerations without it nothing is steady.
    low, high = np.quantile(flown["az_mps2"], (0.25, 0.75))
    if float(high - low) > WITHOUT_GRAVITY * abs(down):
        weighed = (0.0, 0.0)
    for unit, one in (("g", 1.0), ("ft/s2", GRAVITY_MPS2 / 0.3048), ("mg", 1000.0)):
        if any(0.7 * one < found < 1.4 * one for found in weighed):
            text = f"az_mps2 is {down:.3g} m/s2 in the median of the flight, not -9.8"
            return [Finding("gravity", names, text, (f"{unit}: {HINT}",), wrong_unit=True)]
    if down > 0.5 * GRAVITY_MPS2:
        text = f"az_mps2 is {down:+.3g} m/s2 in the median of the flight, not -9.8"
        up = f"an axis that points up, ours down: {HINT}"
        return [Finding("gravity", ("az_mps2",), text, (up,), wrong_unit=True)]
    if not 0.5 * GRAVITY_MPS2 < size < 2.0 * GRAVITY_MPS2:
        text = f"specific force is {size:.3g} m/s2 in the median of the flight, not 9.8"
        causes = ("accelerations without gravity", "deviations from trim", f"a unit: {HINT}")
        return [Finding("gravity", names, text, causes)]
    return []


def _air(flown: Mapping[str, Array]) -> list[Finding]:
    findings: list[Finding] = []
    if "airspeed_mps" in flown and float(np.median(flown["airspeed_mps"])) <= 0.0:
        text, sign = "airspeed_mps is not above zero in flight", f"its sign: {HINT}"
        findings.append(Finding("airspeed-sign", ("airspeed_mps",), text, (sign,), wrong_unit=True))
    for check, name, (least, most), unit in (
        ("static-pressure", "static_pa", STATIC_PA, "Pa"),
        ("throttle", "throttle", THROTTLE, "of full"),
        ("density", "density_kgpm3", DENSITY, "kg/m3"),
    ):
        middle = float(np.median(flown[name])) if name in flown else least
        if not least <= middle <= most:
            text = f"{name} is {middle:.4g} {unit}"
            findings.append(Finding(check, (name,), text, (f"a unit: {HINT}",), wrong_unit=True))
    if "airspeed_mps" in flown and "qbar_pa" in flown:
        density = float(np.median(flown["density_kgpm3"])) if "density_kgpm3" in flown else 1.225
        density = density if DENSITY[0] <= density <= DENSITY[1] else 1.225
        expected = 0.5 * density * float(np.median(flown["airspeed_mps"] ** 2))
        ratio = float(np.median(flown["qbar_pa"])) / max(expected, 1e-9)
        if not PRESSURE_RATIO[0] < ratio < PRESSURE_RATIO[1]:
            text = f"qbar_pa is {ratio:.3g} times what airspeed_mps makes of it"
            pair, cause = ("qbar_pa", "airspeed_mps"), f"another unit of one of them: {HINT}"
            findings.append(
                Finding("airspeed-against-pressure", pair, text, (cause,), wrong_unit=True)
            )
    return findings


def _forces(means: Mapping[str, Array]) -> list[Finding]:
    """Compare wind angles with the forces they make."""
    findings = []
    for check, angle, force in (
        ("alpha-against-az", "alpha_rad", "az_mps2"),
        ("beta-against-ay", "beta_rad", "ay_mps2"),
    ):
        if angle in means and force in means:
            agreement = correlation(np.diff(means[angle]), np.diff(means[force]))
            if agreement > SIGN_CORRELATION:
                text = (
                    f"{angle} and {force} rise together (correlation {agreement:.2f}), where lift"
                    " and side force oppose"
                )
                causes = (f"the wrong sign of one of them: {HINT}",)
                findings.append(Finding(check, (angle, force), text, causes, wrong_unit=True))
    return findings


def _surfaces(means: Mapping[str, Array]) -> list[Finding]:
    """Regress angular accelerations on surfaces; no proof, for a canard may mean it."""
    findings = []
    for surface, (rate, auxiliary, expected, wrong) in SURFACES.items():
        needed = (surface, rate, auxiliary[0])  # without the wind angle its moment is the surface's
        if any(name not in means for name in needed) or np.ptp(means[surface]) < MOVED_RAD:
            continue
        others = [means[k] for k in auxiliary if k in means]
        left = np.gradient(means[rate], means["t_s"])
        X = np.column_stack([means[surface], *others, np.ones(len(left))])
        size = np.maximum(np.abs(X).max(axis=0), 1e-12)
        beta, *_ = np.linalg.lstsq(X / size, left, rcond=None)
        spread = float(np.sum((left - X / size @ beta) ** 2)) / max(len(left) - X.shape[1], 1)
        own = float(np.linalg.pinv((X / size).T @ (X / size))[0, 0])
        if expected * beta[0] < -SIGN_DEVIATIONS * np.sqrt(spread * own):
            text = (
                f"{surface} positive seems to {wrong}, against our sign (elevator trailing edge"
                " down, rudder trailing edge left, aileron rolls right)"
            )
            causes = (f"the other sign: {HINT}", "feedback", "a canard")
            findings.append(Finding("surface-sign", (surface,), text, causes))
    return findings


def _exchanged(means: Mapping[str, Array]) -> list[Finding]:
    """Hold each surface against the rate that another one should drive.

    A mixer or a dihedral lets a surface drive two rates. Where each of two columns drives the
    other's rate more than its own, one stands under the other's name.
    """
    names = [s for s in SURFACES if s in means and SURFACES[s][0] in means]
    found = []
    for k, one in enumerate(names):
        for other in names[k + 1 :]:
            pair = (one, other)
            ahead = [_ahead(means, SURFACES[own][0], own, pair) for own in pair]
            if all(deviations < -CERTAIN_SD for deviations in ahead):
                text = f"{one} drives what {other} should, and {other} what {one} should"
                causes = (f"two columns exchanged: {HINT}",)
                found.append(Finding("surface-exchanged", pair, text, causes))
    return found


def _ahead(means: Mapping[str, Array], rate: str, own: str, pair: tuple[str, str]) -> float:
    """Return by how many deviations a surface drives its rate more than the other one does."""
    other = pair[1] if own == pair[0] else pair[0]
    if any(np.ptp(means[s]) < MOVED_RAD for s in pair):
        return 0.0
    auxiliary = [means[s] for s in ("alpha_rad", "beta_rad", *RATES) if s in means]
    left = np.gradient(means[rate], means["t_s"])
    X = np.column_stack([means[own], means[other], *auxiliary, np.ones(len(left))])
    size = np.maximum(np.abs(X).max(axis=0), 1e-12)
    beta, *_ = np.linalg.lstsq(X / size, left, rcond=None)
    beta = beta / size
    spread = float(np.sum((left - X @ beta) ** 2)) / max(len(left) - X.shape[1], 1)
    inverse = np.linalg.pinv((X / size).T @ (X / size)) / np.outer(size, size)
    signs = np.array([np.sign(beta[0]), -np.sign(beta[1])])
    variance = float(signs @ inverse[:2, :2] @ signs) * spread
    return float((abs(beta[0]) - abs(beta[1])) / np.sqrt(max(variance, 1e-300)))

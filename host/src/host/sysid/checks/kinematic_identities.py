"""Identities of motion that hold for every aircraft, over the means of a record.

How an angle turns follows from the rates, how the wind angles and the speed change from the rates
and the specific force. Each is a difference on the left and an integral on the right, so that noise
does not grow with the sampling rate.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from types import MappingProxyType

import numpy as np

from host.arrays import Array
from host.constants import GRAVITY_MPS2, STEEPEST_SINE
from host.physical.sampling import GAP_FACTOR
from host.sysid.checks.identity_factors import Identity, correlation, factors, may_be_one, without

ANGLE_EXPLAINED = 0.3  # of an angle's rate that the gyro explains: less is another signal
WIND_ANGLE_EXPLAINED = 0.05  # the same of a wind angle, which gusts turn too
BLOCK_S, SLOW_S = 0.1, 0.5  # slopes are those of means over this long; slow: pitot and GPS
FEWEST = 32  # means
STEEPEST_RAD = 1.2  # attitude rates are singular at a pitch of 90 deg
ALONG, ACROSS = ("elevator_rad",), ("aileron_rad", "rudder_rad")  # what drives which
DRIVING_RAD = 0.05  # a surface that swings less is a hand that answers, not a test input
# Right sensors: tilt of an IMU, zero of a vane, delay of a pitot, one deviation each; and thrust
# that a forward force does not feel, at full throttle.
TILT_RAD, ZERO_RAD, PITOT_DELAY_S, THRUST_MPS2 = 0.03, 0.05, 0.3, 10.0
SHEAR_PER_S = 0.05  # of a head wind with height, one deviation: light by ICAO is below 0.067


def identities(flown: Mapping[str, Array], dt_s: float) -> Iterator[Identity]:
    """Return all identities that the columns allow."""
    for length_s, laws in ((BLOCK_S, _fast), (SLOW_S, _slow)):
        means = means_over(flown, dt_s, length_s)
        if len(means["t_s"]) < FEWEST:
            continue
        yield from laws(means)


def means_over(flown: Mapping[str, Array], dt_s: float, length_s: float) -> dict[str, Array]:
    """Return means over a time, or over less where the record is short."""
    # A record whose clock runs too fast is short, and must not escape by that.
    short_s = dt_s * len(flown["t_s"]) / (4 * FEWEST)
    return block_means(flown, max(1, round(min(length_s, short_s) / dt_s)))


def block_means(flown: Mapping[str, Array], block: int) -> dict[str, Array]:
    """Return the means of successive blocks of samples."""
    count = len(flown["t_s"]) // block
    return {k: v[: count * block].reshape(count, block).mean(axis=1) for k, v in flown.items()}


def _fast(m: Mapping[str, Array]) -> Iterator[Identity]:
    """Return the identities of attitude and wind angles."""
    zero = np.zeros(len(m["t_s"]))
    phi, theta = m.get("phi_rad", zero), m.get("theta_rad", zero)
    alpha, beta = m.get("alpha_rad", zero), m.get("beta_rad", zero)
    steep = np.clip(theta, -STEEPEST_RAD, STEEPEST_RAD)
    p, q, r = (m.get(f"{k}_radps", zero) for k in "pqr")
    # What is small in level flight is auxiliary: too little to be judged itself.
    roll_yaw = np.sin(phi) * q + np.cos(phi) * r
    laws: tuple[tuple[str, str, Array, Array], ...] = (
        ("theta_rad", "q_radps", np.cos(phi) * q, np.sin(phi) * r),
        ("psi_rad", "r_radps", np.cos(phi) * r / np.cos(steep), np.sin(phi) * q / np.cos(steep)),
        ("phi_rad", "p_radps", p, np.tan(steep) * roll_yaw),
    )
    for name, rate, part, auxiliary in laws:
        if name in m and rate in m:
            yield _law(name, m, {rate: part}, (auxiliary,), explained_share=ANGLE_EXPLAINED)
    yield from _wind_angles(m, phi, theta, alpha, beta, (p, q, r))


def _wind_angles(
    m: Mapping[str, Array],
    phi: Array,
    theta: Array,
    alpha: Array,
    beta: Array,
    rates: tuple[Array, Array, Array],
) -> Iterator[Identity]:
    """Return the identities of the wind angles: by rates, and by forces where measured."""
    p, q, r = rates
    # Kinematic equations of the wind angles (EQUATIONS.md, eq. 6).
    pitch = q - beta * (np.cos(alpha) * p + np.sin(alpha) * r)
    yaw = np.sin(alpha) * p - np.cos(alpha) * r
    zero = np.zeros(len(alpha))
    # Without a force stands what makes it: it is about linear in that. With it the weight is in
    # one term: alone, the side force drowns in errors of the bank angle.
    speed = np.maximum(m.get("airspeed_mps", zero), 1.0)
    known = "theta_rad" in m and "airspeed_mps" in m
    if "alpha_rad" in m and "q_radps" in m:
        if known and "az_mps2" in m:
            along = m.get("ax_mps2", GRAVITY_MPS2 * np.sin(theta)) - GRAVITY_MPS2 * np.sin(theta)
            down = m["az_mps2"] + GRAVITY_MPS2 * np.cos(theta) * np.cos(phi)
            lift = (np.cos(alpha) * down - np.sin(alpha) * along) / speed
            parts = {"q_radps": pitch, "az_mps2 over airspeed_mps": lift}
            yield _law(
                "alpha_rad",
                m,
                parts,
                force=m["az_mps2"],
                inputs=ALONG,
                explained_share=WIND_ANGLE_EXPLAINED,
            )
        else:
            made = _lift_and_weight(m, alpha, phi)
            yield _law("alpha_rad", m, {"q_radps": pitch}, made)
    if "beta_rad" in m and "r_radps" in m:
        if known and "ay_mps2" in m:
            side = (m["ay_mps2"] + GRAVITY_MPS2 * np.cos(theta) * np.sin(phi)) / speed
            yield _law(
                "beta_rad",
                m,
                {"r_radps": yaw, "ay_mps2 over airspeed_mps": side},
                terms={"ay_mps2": m["ay_mps2"] / speed},
                force=m["ay_mps2"],
                inputs=ACROSS if "phi_rad" in m else (),  # without bank the weight is missing
                sensors=(ZERO_RAD * p, TILT_RAD * m.get("az_mps2", zero) / speed),
                explained_share=WIND_ANGLE_EXPLAINED,
            )
        else:
            yield _law("beta_rad", m, {"r_radps": yaw}, (beta, phi, m.get("rudder_rad", zero)))


def _lift_and_weight(m: Mapping[str, Array], alpha: Array, phi: Array) -> tuple[Array, ...]:
    """Return what turns the path where no force was measured, but for factors.

    In a slow exchange of height and speed q follows the path, and alpha moves as speed lets lift
    and weight differ. Without an airspeed its changes are those of height, of about one slope.
    """
    elevator = m.get("elevator_rad", np.zeros(len(alpha)))
    step_s = np.gradient(m["t_s"])
    theta = m["theta_rad"] if "theta_rad" in m else np.cumsum(m["q_radps"] * step_s)
    if "airspeed_mps" in m:
        speed = np.maximum(m["airspeed_mps"], 1.0)
        weight = np.cos(theta - alpha) * np.cos(phi) / speed
        return speed, speed * alpha, speed * elevator, weight
    return alpha, elevator, m["t_s"], np.cumsum((theta - alpha) * step_s)


def _slow(m: Mapping[str, Array]) -> Iterator[Identity]:
    """Return the identities of speed and height."""
    if all(f"a{k}_mps2" in m for k in "xz") and "theta_rad" in m and "airspeed_mps" in m:
        zero = np.zeros(len(m["t_s"]))
        theta, phi = m["theta_rad"], m.get("phi_rad", zero)
        alpha = m["alpha_rad"] if "alpha_rad" in m else _pitch_over_path(m)
        fall = np.sin(alpha) * np.cos(theta) * np.cos(phi) - np.cos(alpha) * np.sin(theta)
        # Without a vane the path is a guess, which would take the force's part.
        climb = m["airspeed_mps"] * np.sin(theta - alpha) if "alpha_rad" in m else zero
        along = {"ax_mps2": np.cos(alpha) * m["ax_mps2"]}
        known = GRAVITY_MPS2 * fall + np.sin(alpha) * m["az_mps2"]
        known = known + _shear(_law("airspeed_mps", m, along, (climb,), known=known)) * climb
        # An IMU that is tilted in the aircraft lets lift and side force lean into ax. Vanes show
        # the angle; without them 1.7 deg make speed move 1.5 times as fast as ax says.
        lean = (m["az_mps2"], m.get("ay_mps2", zero))
        tilted = list(factors(_law("airspeed_mps", m, along, lean, known=known)))
        right = bool(tilted) and all(map(may_be_one, tilted))
        if "alpha_rad" in m or not right:
            weight = GRAVITY_MPS2 * np.cos(theta)
            sensors = (
                *(TILT_RAD * force for force in lean),
                ZERO_RAD * (lean[0] + weight * np.cos(phi)),
                ZERO_RAD * (lean[1] + weight * np.sin(phi)),
                THRUST_MPS2 * m.get("throttle", zero),
                SHEAR_PER_S * climb,
            )
            pitot = {"": PITOT_DELAY_S}
            yield _law(
                "airspeed_mps", m, along, known=known, inputs=ALONG, sensors=sensors, delays_s=pitot
            )
    if "altitude_m" in m and "v_down_mps" in m:
        yield _law("altitude_m", m, {"v_down_mps": -m["v_down_mps"]})


def _shear(law: Identity) -> float:
    """Return the likeliest change of head wind with height, 1/s, with any factor of the force.

    It is the rest after the only part of the identity, within what shear usually is: a force
    that is turned round stays one.
    """
    (part,), (climb,) = law.parts.values(), law.auxiliary
    columns = np.column_stack([np.ones(len(climb)), part, climb])
    noise = max(float(np.mean(without(law.rate, columns) ** 2)), 1e-12)
    x, y = (without(v, columns[:, :2]) for v in (climb, law.rate))
    return float(x @ y) / (float(x @ x) + noise / SHEAR_PER_S**2)


def _pitch_over_path(m: Mapping[str, Array]) -> Array:
    """Return the angle of attack that no vane measured; zero where nothing tells it."""
    if "v_down_mps" not in m:
        return np.zeros(len(m["t_s"]))
    climb = -m["v_down_mps"] / np.maximum(m["airspeed_mps"], 1.0)
    return np.asarray(m["theta_rad"] - np.arcsin(np.clip(climb, -STEEPEST_SINE, STEEPEST_SINE)))


def _law(
    name: str,
    m: Mapping[str, Array],
    parts: Mapping[str, Array],
    auxiliary: tuple[Array, ...] = (),
    *,
    known: Array | None = None,
    terms: Mapping[str, Array] = MappingProxyType({}),
    force: Array | None = None,
    inputs: tuple[str, ...] = (),
    sensors: tuple[Array, ...] = (),
    delays_s: Mapping[str, float] = MappingProxyType({}),
    explained_share: float = 0.0,
) -> Identity:
    """Return the identity over each step: a difference on the left, an integral on the right."""
    step_s = np.diff(m["t_s"])
    # Between two stretches of flight is a jump.
    even = step_s < GAP_FACTOR * float(np.median(step_s))
    even = even[:-2] & even[1:-1] & even[2:]

    def over(x: Array) -> Array:
        """Average over a step by the cubic through four points."""
        return np.asarray((13.0 * (x[1:-2] + x[2:-1]) - x[:-3] - x[3:]) / 24.0)[even]

    return Identity(
        name,
        (np.diff(m[name]) / step_s)[1:-1][even] - (0.0 if known is None else over(known)),
        {k: over(v) for k, v in parts.items()},
        terms={k: over(v) for k, v in terms.items()},
        auxiliary=tuple(over(b) for b in auxiliary),
        opposed=0.0 if force is None else correlation(np.diff(over(m[name])), np.diff(over(force))),
        inputs=tuple(over(m[u]) for u in inputs if u in m and np.ptp(m[u]) > 0.0),
        driven=any(u in m and np.ptp(m[u]) > DRIVING_RAD for u in inputs),
        sensors=tuple(over(s) for s in sensors),
        delays_s=delays_s,
        step_s=float(np.median(step_s)),
        explained_share=explained_share,
    )

"""Identities of motion that hold for every aircraft: a column in another unit breaks them.

How an angle turns follows from the rates, how the wind angles and the speed change from the rates
and the specific force. Each column that moves one of them must do so with a factor of one. Noise
on either side only widens the range of factors that a regression allows, from both directions;
what lies outside as a whole is a unit, a scale, a sign or another clock. Of speed against forward
force it may as well be thrust that a sensor does not feel, wind that changes with height, or a slow
pitot. Gusts change angles and speed as no force says; what surfaces drive is judged apart.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from types import MappingProxyType

import numpy as np

from host.arrays import Array
from host.constants import GRAVITY_MPS2
from host.readers.column_map import UNITS
from host.sysid.checks.data_finding import AS_IT_IS, HINT, Finding
from host.sysid.checks.driven_motion import (
    DrivenFactor,
    driven_factors,
    driven_misfit,
    likelier_factor,
    shared_factor,
)
from host.sysid.checks.identity_factors import (
    FACTOR_CORRELATION,
    LARGEST_FACTOR,
    SIGN_CORRELATION,
    Factor,
    Identity,
    correlation,
    factors,
    without,
)
from host.sysid.checks.side_force import unlikely_factors

UNIT_MARGIN = 1.1  # about the range of factors: a unit's outside it is none
MOTION_SHARE = 0.3  # of what a law leaves: with less it is noise
ANGLE_EXPLAINED = 0.3  # of an angle's rate that the gyro explains: less is another signal
WIND_ANGLE_EXPLAINED = 0.05  # the same of a wind angle, which gusts turn too
UNDRIVEN_EXPLAINED = 0.75  # of a wind angle that no surface drives: of less the slope is gusts'
QUIET_RADPS = 0.02  # noise of a still sensor follows nothing
BLOCK_S, SLOW_S = 0.1, 0.5  # slopes are those of means over this long; slow: pitot and GPS
FEWEST = 32  # means
CHANCE = 3.0  # deviations, of a slope of the speed, which gusts along the path change too
OVER_AIRSPEED = " over airspeed_mps"  # ends the name of a part that the airspeed divides
ALONG, ACROSS = ("elevator_rad",), ("aileron_rad", "rudder_rad")  # what drives which
DRIVING_RAD = 0.05  # a surface that swings less is a hand that answers, not a test input
# Right sensors: tilt of an IMU, zero of a vane, delay of a pitot, one deviation each; and thrust
# that a forward force does not feel, at full throttle.
TILT_RAD, ZERO_RAD, PITOT_DELAY_S, THRUST_MPS2 = 0.03, 0.05, 0.3, 10.0
SHEAR_PER_S = 0.05  # of a head wind with height, one deviation: light by ICAO is below 0.067
UNIT_OF_FORCE = 5.0  # speed against force: thrust, wind and a slow pitot stay below, g is 9.8
# What is compared, by the column that changes and what it is held against.
CHECK_OF = {
    ("theta_rad", "q_radps"): "theta-against-q",
    ("phi_rad", "p_radps"): "phi-against-p",
    ("psi_rad", "r_radps"): "psi-against-r",
    ("alpha_rad", "q_radps"): "alpha-against-q",
    ("beta_rad", "r_radps"): "beta-against-r",
    ("alpha_rad", "az_mps2 over airspeed_mps"): "alpha-against-az",
    ("beta_rad", "ay_mps2 over airspeed_mps"): "beta-against-ay",
    ("beta_rad", "ay_mps2"): "beta-against-ay",
    ("airspeed_mps", "ax_mps2"): "airspeed-against-ax",
    ("altitude_m", "v_down_mps"): "altitude-against-climb",
}
UNIT = "another unit of one of them"
SPEED_CAUSES = (
    "thrust that is not in ax_mps2", "wind that changes with height", "a slow pitot", UNIT,
)  # fmt: skip


def consistent(flown: Mapping[str, Array], dt_s: float, *, weighed: bool = True) -> list[Finding]:
    """Return a finding for each column that breaks a kinematic identity, or keeps it only scaled.

    Parameters
    ----------
    flown : mapping
        SI columns in flight, every `dt_s`.
    weighed : bool
        Whether gravity is in the specific forces as it must be: else what surfaces drive of an
        identity with them tells nothing more.
    """
    findings: list[Finding] = []
    laws = list(identities(flown, dt_s))
    for law in laws:
        if found := _unrelated(law):
            if law.opposed > -SIGN_CORRELATION:
                findings.append(found)
                continue
            # Gusts turn this wind angle, where no surface does: no rate says so.
        else:
            findings += [one for f in _told(law) if (one := _judge(f)) is not None]
        findings += map(_judge_driven, driven_factors(law) if weighed else ())
    if weighed and not any(f.wrong_unit for f in findings):
        findings += _judge_airspeed(laws) or _judge_units(laws, _means(flown, dt_s, BLOCK_S))
    return findings


def misfit(flown: Mapping[str, Array], dt_s: float) -> float:
    """Return how many deviations squared the identities are broken: what tells readings apart."""
    total = 0.0
    for law in identities(flown, dt_s):
        driven = driven_misfit(law)
        total += sum(f.misfit for f in factors(law)) if driven is None else driven
    return total


def related(
    flown: Mapping[str, Array], dt_s: float, least: float = FACTOR_CORRELATION
) -> dict[tuple[str, str], float]:
    """Return what moves with what, a column and a part of its identity, and how closely."""
    laws = identities(flown, dt_s)
    return {(law.name, f.name): f.explained**0.5 for law in laws for f in factors(law, least)}


def _told(law: Identity) -> Iterator[Factor]:
    """Return the factors that no gusts made.

    An aircraft turns into the gusts that turn its wind angles, slower than they do: a rate that
    only answers them explains little of the angle, and the slope between both is no scale. An
    airliner's sideslip of a flight without rudder moved 2.3 to 2.7 times as fast as its yaw rate.
    """
    gusty = law.opposed < -SIGN_CORRELATION and not law.driven
    return (f for f in factors(law) if not gusty or f.explained >= UNDRIVEN_EXPLAINED)


def identities(flown: Mapping[str, Array], dt_s: float) -> Iterator[Identity]:
    """Return all identities that the columns allow."""
    for length_s, laws in ((BLOCK_S, _fast), (SLOW_S, _slow)):
        means = _means(flown, dt_s, length_s)
        if len(means["t_s"]) < FEWEST:
            continue
        yield from laws(means)


def _means(flown: Mapping[str, Array], dt_s: float, length_s: float) -> dict[str, Array]:
    """Return means over a time, or over less where the record is short."""
    # A record whose clock runs too fast is short, and must not escape by that.
    short_s = dt_s * len(flown["t_s"]) / (4 * FEWEST)
    return block_means(flown, max(1, round(min(length_s, short_s) / dt_s)))


def block_means(flown: Mapping[str, Array], block: int) -> dict[str, Array]:
    """Return the means of successive blocks of samples."""
    count = len(flown["t_s"]) // block
    return {k: v[: count * block].reshape(count, block).mean(axis=1) for k, v in flown.items()}


def _unrelated(law: Identity) -> Finding | None:
    """Return the finding of a column that does not follow its kinematic identity."""
    own = np.column_stack([np.ones(len(law.rate)), *law.beside])
    rate = without(law.rate, own)
    left = without(law.rate, np.column_stack([own, *law.parts.values()]))
    noise = _difference_noise(left)
    power, unexplained = float(rate @ rate) - noise, float(left @ left) - noise
    moved = min(float(np.std(law.rate)), max(float(np.std(v)) for v in law.parts.values()))
    if unexplained <= MOTION_SHARE * float(left @ left):
        return None
    if moved <= QUIET_RADPS or power == 0.0 or unexplained <= (1.0 - law.explained_share) * power:
        return None
    names = list(law.parts)
    return Finding(
        CHECK_OF[law.name, names[0]],
        _channels(law.name, *names),
        f"{law.name} does not follow {' and '.join(names)}"
        f" ({100.0 * (1.0 - unexplained / power):.0f} % of its motion)",
        ("another column", "another clock", "noise", f"a unit: {HINT}"),
    )


def _difference_noise(rate: Array) -> float:
    """Return how much of the power of a slope is noise of what it is the slope of.

    White noise that is differenced turns back from step to step: its first autocovariance is minus
    half of its power. Motion does not.
    """
    return max(-2.0 * float(rate[1:] @ rate[:-1]), 0.0)


def _judge(f: Factor) -> Finding | None:
    """Return the finding of a scale factor; None if it may be one."""
    check, speed = CHECK_OF[f.law.name, f.name], f.law.name == "airspeed_mps"
    channels = _channels(f.law.name, f.name)
    if f.high < 0.0:
        if not f.certain:
            return None
        return Finding(
            check,
            channels,
            f"{f.law.name} and {f.name} turn opposite ways (factor {f.high:.2g} where 1 is right)",
            (f"the wrong sign of one of them: {HINT}",),
            wrong_unit=True,
        )
    within = LARGEST_FACTOR * (1.0 + (CHANCE * f.chance if speed else 0.0))
    if f.low <= within and f.high >= 1.0 / within:
        return None
    times = f.low if f.low > 1.0 else f.high
    return Finding(
        check,
        channels,
        f"{f.law.name} moves {times:.3g} times as fast as {f.name} says",
        SPEED_CAUSES if speed else _factor_causes(f),
        wrong_unit=not speed or not 1.0 / UNIT_OF_FORCE < times < UNIT_OF_FORCE,
    )


def _judge_driven(f: DrivenFactor) -> Finding:
    """Return the finding of a factor that what surfaces drive tells."""
    speed = f.law.name == "airspeed_mps"
    turned = f"{f.law.name} and {f.name} turn opposite ways"
    times = f"{f.law.name} moves about {f.slope:.2g} times as fast as {f.name} says"
    return Finding(
        CHECK_OF[f.law.name, f.name],
        _channels(f.law.name, f.name),
        f"{turned if f.slope < 0.0 else times} in what surfaces drive",
        SPEED_CAUSES if speed else (f"{UNIT}: {HINT}",),
        wrong_unit=not speed or not 1.0 / UNIT_OF_FORCE < f.slope < UNIT_OF_FORCE,
    )


def _judge_airspeed(laws: Sequence[Identity]) -> list[Finding]:
    """Return the finding of an airspeed whose unit only lift and side force together tell."""
    parts = _over_airspeed(laws)
    gains = [gain for gain in UNITS["mps"].values() if gain != 1.0]
    times = shared_factor(parts, [*gains, *(1.0 / gain for gain in gains)])
    if times is None:
        return []
    channels = dict.fromkeys(c for _, name in parts for c in reversed(_channels(name)))
    text = f"airspeed_mps is about {times:.2g} times what forces make of it in what surfaces drive"
    causes = (f"{UNIT}: {HINT}", "scales of vanes or airspeed")
    return [Finding("alpha-against-az", (*channels,), text, causes, wrong_unit=True)]


def _over_airspeed(laws: Sequence[Identity]) -> list[tuple[Identity, str]]:
    return [(law, name) for law in laws for name in law.parts if name.endswith(OVER_AIRSPEED)]


def _judge_units(laws: Sequence[Identity], means: Mapping[str, Array]) -> list[Finding]:
    """Return the findings of an airspeed and a side force that another unit would suit better."""
    by_speed = {1.0 / gain: unit for unit, gain in UNITS["mps"].items() if gain != 1.0}
    # One in mg is proven; to read it so is to leave the side force out.
    by_force = {UNITS["mps2"][unit]: unit for unit in ("g", "ft/s2")}
    sides = [(law, "ay_mps2") for law in laws if "ay_mps2" in law.terms]
    unlikely = unlikely_factors(means, (1.0, *by_force))
    return [
        *_likelier_unit("airspeed_mps", _over_airspeed(laws), by_speed, {}),
        *_likelier_unit("ay_mps2", sides, by_force, unlikely),
    ]


def _likelier_unit(
    name: str,
    shares: Sequence[tuple[Identity, str]],
    units: Mapping[float, str],
    unlikely: Mapping[float, float],
) -> list[Finding]:
    """Return the finding of a column that nothing proves wrong, but agrees better in another unit.

    Gusts may leave it open whether an airspeed is in m/s or in knots. That is no reading, but what
    the column scales is not to be trusted.
    """
    likelier = likelier_factor(shares, units, unlikely)
    if likelier is None:
        return []
    law, part = next((law, part) for law, part in shares if law.driven)
    check = CHECK_OF[law.name, part]
    text = f"{name} would agree better with what surfaces drive if it were in {units[likelier]}"
    causes = (f"its unit: {HINT}", "gusts", *(("an unusual side force",) if unlikely else ()))
    done = f"{AS_IT_IS}, but by no linear answer" if name == "ay_mps2" else AS_IT_IS
    return [Finding(check, (name,), text, causes, done)]


def _factor_causes(f: Factor) -> tuple[str, ...]:
    """Return a unit where one makes such a factor, else scales and the clock."""
    ratios = {
        ratio
        for column in _channels(f.law.name, f.name)
        for gain in UNITS.get(column.rsplit("_", 1)[-1], {}).values()
        for ratio in (gain, 1.0 / gain)
        if ratio != 1.0
    }
    if any(f.low / UNIT_MARGIN <= ratio <= f.high * UNIT_MARGIN for ratio in ratios):
        return (f"{UNIT}: {HINT}",)
    scales = (f"{f.name} of {1.0 / f.low:.2g}", f"{f.law.name} of {f.low:.2g}")
    return (*(f"a scale of {scale}" for scale in scales), "another clock")


def _channels(*names: str) -> tuple[str, ...]:
    """Return the columns behind the names of what is compared."""
    return tuple(part for name in names for part in name.split(" over "))


def _fast(m: Mapping[str, Array]) -> Iterator[Identity]:
    """Attitude and wind angles."""
    zero = np.zeros(len(m["t_s"]))
    phi, theta = m.get("phi_rad", zero), m.get("theta_rad", zero)
    alpha, beta = m.get("alpha_rad", zero), m.get("beta_rad", zero)
    steep = np.clip(theta, -1.2, 1.2)
    p, q, r = (m.get(f"{k}_radps", zero) for k in "pqr")
    # What is small in level flight goes beside: too little to be judged itself.
    roll_yaw = np.sin(phi) * q + np.cos(phi) * r
    laws: tuple[tuple[str, str, Array, Array], ...] = (
        ("theta_rad", "q_radps", np.cos(phi) * q, np.sin(phi) * r),
        ("psi_rad", "r_radps", np.cos(phi) * r / np.cos(steep), np.sin(phi) * q / np.cos(steep)),
        ("phi_rad", "p_radps", p, np.tan(steep) * roll_yaw),
    )
    for name, rate, part, beside in laws:
        if name in m and rate in m:
            yield _law(name, m, {rate: part}, (beside,), explained_share=ANGLE_EXPLAINED)
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
    """Speed and height."""
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
        # the angle; without them 1.7 deg made speed move 1.5 times as fast as ax said.
        lean = (m["az_mps2"], m.get("ay_mps2", zero))
        tilted = list(factors(_law("airspeed_mps", m, along, lean, known=known)))
        right = bool(tilted) and all(_judge(f) is None for f in tilted)
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
    """Return the likeliest change of head wind with height, 1/s, beside any factor of the force.

    It is what stands beside the only part of the identity, within what shear usually is: a force
    that is turned round stays one.
    """
    (part,), (climb,) = law.parts.values(), law.beside
    columns = np.column_stack([np.ones(len(climb)), part, climb])
    noise = max(float(np.mean(without(law.rate, columns) ** 2)), 1e-12)
    x, y = (without(v, columns[:, :2]) for v in (climb, law.rate))
    return float(x @ y) / (float(x @ x) + noise / SHEAR_PER_S**2)


def _pitch_over_path(m: Mapping[str, Array]) -> Array:
    """Return the angle of attack that no vane measured; zero where nothing tells it."""
    if "v_down_mps" not in m:
        return np.zeros(len(m["t_s"]))
    climb = -m["v_down_mps"] / np.maximum(m["airspeed_mps"], 1.0)
    return np.asarray(m["theta_rad"] - np.arcsin(np.clip(climb, -0.5, 0.5)))


def _law(
    name: str,
    m: Mapping[str, Array],
    parts: Mapping[str, Array],
    beside: tuple[Array, ...] = (),
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
    even = step_s < 1.5 * float(np.median(step_s))  # between two stretches of flight is a jump
    even = even[:-2] & even[1:-1] & even[2:]

    def over(x: Array) -> Array:
        """Average over a step by the cubic through four points."""
        return np.asarray((13.0 * (x[1:-2] + x[2:-1]) - x[:-3] - x[3:]) / 24.0)[even]

    return Identity(
        name,
        (np.diff(m[name]) / step_s)[1:-1][even] - (0.0 if known is None else over(known)),
        {k: over(v) for k, v in parts.items()},
        terms={k: over(v) for k, v in terms.items()},
        beside=tuple(over(b) for b in beside),
        opposed=0.0 if force is None else correlation(np.diff(over(m[name])), np.diff(over(force))),
        inputs=tuple(over(m[u]) for u in inputs if u in m and np.ptp(m[u]) > 0.0),
        driven=any(u in m and np.ptp(m[u]) > DRIVING_RAD for u in inputs),
        sensors=tuple(over(s) for s in sensors),
        delays_s=delays_s,
        step_s=float(np.median(step_s)),
        explained_share=explained_share,
    )

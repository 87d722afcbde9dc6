"""Identities of motion that hold for every aircraft: a column in another unit breaks them.

How an angle turns follows from the rates, how the wind angles and the speed change from the rates
and the specific force. Each column that moves one of them must do so with a factor of one. Noise on
either side only widens the range of factors that a regression allows, from both directions; what
lies outside as a whole is a unit, a scale, a sign or another clock. Between speed and forward force
it may as well be thrust that a sensor does not feel, wind that changes with height, or a slow
pitot. Gusts change angles and speed as no force says; what surfaces drive is judged apart.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from host.arrays import Array
from host.readers.column_map import UNITS
from host.sysid.checks.data_finding import AS_IT_IS, HINT, Finding
from host.sysid.checks.driven_motion import (
    DrivenFactor,
    DrivenTest,
    driven_factors,
    driven_misfit,
    driven_test,
    likelier_factor,
    shared_factor,
)
from host.sysid.checks.identity_factors import (
    FACTOR_CORRELATION,
    SIGN_CORRELATION,
    Factor,
    Identity,
    factors,
    may_be_one,
    without,
)
from host.sysid.checks.kinematic_identities import BLOCK_S, identities, means_over
from host.sysid.checks.side_force import unlikely_factors

UNIT_MARGIN = 1.1  # about the range of factors: a unit's outside it is none
MOTION_SHARE = 0.3  # of what a law leaves: with less it is noise
UNDRIVEN_EXPLAINED = 0.75  # of a wind angle that no surface drives: of less the slope is gusts'
QUIET_RADPS = 0.02  # noise of a still sensor follows nothing
OVER_AIRSPEED = " over airspeed_mps"  # ends the name of a part that the airspeed divides
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
_Tested = tuple[Identity, DrivenTest | None]
_Share = tuple[Identity, DrivenTest | None, str]  # and the part of the identity
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
    tested = [(law, driven_test(law) if weighed else None) for law in identities(flown, dt_s)]
    for law, test in tested:
        if found := _unrelated(law):
            if law.opposed > -SIGN_CORRELATION:
                findings.append(found)
                continue
            # Gusts turn this wind angle, where no surface does: no rate says so.
        else:
            findings += [one for f in _without_gusts(law) if (one := _judge(f)) is not None]
        findings += map(_judge_driven, driven_factors(law, test) if test else ())
    if weighed and not any(f.wrong_unit for f in findings):
        findings += _judge_airspeed(tested) or _judge_units(
            tested, means_over(flown, dt_s, BLOCK_S)
        )
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


def _without_gusts(law: Identity) -> Iterator[Factor]:
    """Return the factors that no gusts made.

    An aircraft turns into the gusts that turn its wind angles, slower than they do: a rate that
    only answers them explains little of the angle, and the slope between both is no scale. An
    airliner's sideslip of a flight without rudder moves 2.3 to 2.7 times as fast as its yaw rate.
    """
    gusty = law.opposed < -SIGN_CORRELATION and not law.driven
    return (f for f in factors(law) if not gusty or f.explained >= UNDRIVEN_EXPLAINED)


def _unrelated(law: Identity) -> Finding | None:
    """Return the finding of a column that does not follow its kinematic identity."""
    own = np.column_stack([np.ones(len(law.rate)), *law.auxiliary])
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
    if may_be_one(f):
        return None
    if f.high < 0.0:
        return Finding(
            check,
            channels,
            f"{f.law.name} and {f.name} turn opposite ways (factor {f.high:.2g} where 1 is right)",
            (f"the wrong sign of one of them: {HINT}",),
            wrong_unit=True,
        )
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


def _judge_airspeed(tested: Sequence[_Tested]) -> list[Finding]:
    """Return the finding of an airspeed whose unit only lift and side force together tell."""
    parts = _over_airspeed(tested)
    gains = [gain for gain in UNITS["mps"].values() if gain != 1.0]
    times = shared_factor(_tests(parts), [*gains, *(1.0 / gain for gain in gains)])
    if times is None:
        return []
    channels = dict.fromkeys(c for _, _, name in parts for c in reversed(_channels(name)))
    text = f"airspeed_mps is about {times:.2g} times what forces make of it in what surfaces drive"
    causes = (f"{UNIT}: {HINT}", "scales of vanes or airspeed")
    return [Finding("alpha-against-az", (*channels,), text, causes, wrong_unit=True)]


def _over_airspeed(tested: Sequence[_Tested]) -> list[_Share]:
    found = [(law, test, name) for law, test in tested for name in law.parts]
    return [share for share in found if share[2].endswith(OVER_AIRSPEED)]


def _tests(shares: Sequence[_Share]) -> list[tuple[DrivenTest, str]]:
    return [(test, name) for _, test, name in shares if test]


def _judge_units(tested: Sequence[_Tested], means: Mapping[str, Array]) -> list[Finding]:
    """Return the findings of an airspeed and a side force that another unit would suit better."""
    by_speed = {1.0 / gain: unit for unit, gain in UNITS["mps"].items() if gain != 1.0}
    # One in mg is proven; to read it so is to leave the side force out.
    by_force = {UNITS["mps2"][unit]: unit for unit in ("g", "ft/s2")}
    sides = [(law, test, "ay_mps2") for law, test in tested if "ay_mps2" in law.terms]
    unlikely = unlikely_factors(means, (1.0, *by_force))
    return [
        *_likelier_unit("airspeed_mps", _over_airspeed(tested), by_speed, {}),
        *_likelier_unit("ay_mps2", sides, by_force, unlikely),
    ]


def _likelier_unit(
    name: str,
    shares: Sequence[_Share],
    units: Mapping[float, str],
    unlikely: Mapping[float, float],
) -> list[Finding]:
    """Return the finding of a column that nothing proves wrong, but agrees better in another unit.

    Gusts may leave it open whether an airspeed is in m/s or in knots. That is no reading, but what
    the column scales is not to be trusted.
    """
    likelier = likelier_factor(_tests(shares), units, unlikely)
    if likelier is None:
        return []
    law, part = next((law, part) for law, _, part in shares if law.driven)
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

"""Yaw damper and turn coordination around tuned roll gains."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from host.constants import NORMAL_95
from host.control.lateral_pair import PairProblem, PairScenarios, draw_pair
from host.control.loop_design import DRAWN, ROUNDS, STEP_SHARE, SURFACE_SHARE
from host.control.margins import Margins
from host.control.verification import UNSEEN, Required

TRIED = 16  # values of a gain between none and the largest that holds


@dataclass(frozen=True)
class PairMargins:
    """What unseen aircraft say of both loops, worst of each.

    Attributes
    ----------
    aileron, rudder : tuple of float
        Gain (dB) and phase margin (degrees) at each actuator, the other loop closed.
    joint_disk : float
        Disk margin of both changed together.
    stable : bool
    yaw_radps, before_yaw_radps : float
        Yaw rate in side gusts of 1 m/s, rms, with these gains and with the rudder at rest.
    sideslip, before_sideslip : float
        Rms over demanded bank.
    """

    aileron: tuple[float, float]
    rudder: tuple[float, float]
    joint_disk: float
    stable: bool
    yaw_radps: float
    before_yaw_radps: float
    sideslip: float
    before_sideslip: float

    @property
    def worst(self) -> tuple[float, float]:
        """Gain and phase margin of either."""
        return min(self.aileron[0], self.rudder[0]), min(self.aileron[1], self.rudder[1])


@dataclass(frozen=True)
class YawDesign:
    """Gains of the rudder, or None, with what was proven of them."""

    gains: dict[str, float] | None
    margins: PairMargins
    rounds: int


def design_yaw(problem: PairProblem, *, seed: int = 0) -> YawDesign:
    """Return the damper with least yaw in gusts and the mix with least sideslip in a roll.

    Both keep 6 dB and 45 degrees at both surfaces over aircraft that no step has seen. Gains are
    None where no damper holds: the rudder then stays as it was.

    Parameters
    ----------
    problem : PairProblem
    seed : int
        Seed of the aircraft drawn.
    """
    required = asked = Required()
    for k in range(ROUNDS):
        first = 1000 * seed + 500 + 2 * k
        gains = search_yaw(draw_pair(problem, seed=first, count=DRAWN), asked)
        found = verify_yaw(problem, gains or at_rest(problem), seed=first + 1)
        gain_db, phase_deg = found.worst
        if gains is None:
            break
        if found.stable and gain_db >= required.gain_db and phase_deg >= required.phase_deg:
            return YawDesign(gains, found, k + 1)
        asked = asked.tightened(found.worst, STEP_SHARE)
    return YawDesign(None, found, k + 1)


def at_rest(problem: PairProblem) -> dict[str, float]:
    """Return gains of a rudder that does nothing."""
    return {**problem.yaw.completed(0.0, 0.0, 0.0), "FF": 0.0}


def search_yaw(seen: PairScenarios, asked: Required) -> dict[str, float] | None:
    """Return the best damper with the best mix that keep what is asked, or None."""
    yaw, ahead = seen.problem.yaw, seen.problem.feed_forward
    limit = SURFACE_SHARE * seen.problem.rudder.rate_limit_radps / NORMAL_95

    def holds(gains: Mapping[str, float]) -> bool:
        aileron, rudder, _ = seen.judged(gains)
        if asked.missing(aileron) + asked.missing(rudder) > 0.0 or not seen.stable(gains):
            return False
        return float(np.max(seen.yaw_in_gusts_radps(gains)[1])) <= limit

    damper, mixed = yaw.settings[yaw.damper], yaw.settings["MIX"]

    def damped(steps: int) -> dict[str, float]:
        return yaw.completed(steps * damper.step, 0.0, ahead)

    last, rung = round(damper.highest / damper.step), 1
    while rung < last and holds(damped(rung)):
        rung *= 2
    tried = np.unique(np.round(np.linspace(0, min(rung, last), TRIED + 1)).astype(int))[1:]
    kept = [one for steps in tried if holds(one := damped(int(steps)))]
    if not kept:
        return None
    best = min(kept, key=lambda one: float(np.max(seen.yaw_in_gusts_radps(one)[0])))
    shares = np.linspace(mixed.lowest, mixed.highest, TRIED + 1)
    ranked = sorted(
        ({**best, "MIX": mixed.rounded(float(one))} for one in shares),
        key=lambda one: float(np.max(seen.sideslip(one))),
    )
    return next((one for one in ranked if holds(one)), best)


def verify_yaw(problem: PairProblem, gains: Mapping[str, float], *, seed: int) -> PairMargins:
    """Return what unseen aircraft say of both loops."""
    unseen = draw_pair(problem, seed=seed, count=UNSEEN)
    aileron, rudder, disk = unseen.judged(gains)
    rest = at_rest(problem)
    yaw, rested = (float(np.max(unseen.yaw_in_gusts_radps(one)[0])) for one in (gains, rest))
    slip, before = (float(np.max(unseen.sideslip(one))) for one in (gains, rest))
    return PairMargins(
        _least(aileron), _least(rudder), float(np.min(disk)), unseen.stable(gains),
        yaw, rested, slip, before,
    )  # fmt: skip


def _least(found: Margins) -> tuple[float, float]:
    return float(np.min(found.gain_db)), float(np.min(found.phase_deg))

"""The fastest gains of one axis that keep their margins over every aircraft drawn."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache

import numpy as np

from host.arrays import Array
from host.constants import NORMAL_95
from host.control.plant import RATES
from host.control.scenarios import Problem, Scenarios, draw
from host.control.verification import Required, Verification, verify

DRAWN = 40  # aircraft that a design sees; the verification's are others
ROUNDS = 4  # designs until gains are refused
STEP_SHARE = 0.08  # of a margin that lacked: least by which the next design asks for more
SURFACE_SHARE = 0.5  # of the servo's rate, 95 % of the time in gusts of 1 m/s


@dataclass(frozen=True)
class Design:
    """Gains of one axis and what was proven of them.

    Attributes
    ----------
    gains : dict of str to float, or None
        By their role; None where none hold.
    verification : Verification
        Verification of these gains, or of the softest where none hold.
    rounds : int
        Designs until one held on aircraft that none had seen.
    """

    gains: dict[str, float] | None
    verification: Verification
    rounds: int


def design(problem: Problem, *, seed: int = 0, asked: Required | None = None) -> Design:
    """Return the fastest gains that hold, verified on aircraft that no step has seen.

    Raises nothing: an axis without gains is an answer.

    Parameters
    ----------
    problem : Problem
    seed : int
        Seed of the aircraft drawn.
    asked : Required, optional
        Margins of the first design, where they are more than what is required.
    """
    required = Required()
    asked = asked or required
    verification = None
    for k in range(ROUNDS):
        found = search(problem, draw(problem, seed=1000 * seed + 2 * k, count=DRAWN), asked)
        if found is None:
            break
        verification = verify(problem, found, seed=1000 * seed + 2 * k + 1, required=required)
        if verification.holds:
            return Design(found, verification, k + 1)
        asked = asked.tightened(
            (verification.worst_gain_db, verification.worst_phase_deg), STEP_SHARE
        )
    if verification is None:
        verification = verify(problem, softest(problem), seed=1000 * seed + 1, required=required)
    return Design(None, verification, k + 1)


def search(problem: Problem, seen: Scenarios, asked: Required) -> dict[str, float] | None:
    """Return the gains of highest crossover on the parameters' own steps, or None."""
    from scipy.optimize import Bounds, differential_evolution

    settings = problem.structure.settings
    roles = tuple(problem.structure.searched)
    highest = [_reach(problem, seen, role) for role in roles]

    def steps_of(shares: Array) -> tuple[int, ...]:
        # By the logarithm: half of all tries lie below the root of the largest.
        steps = (np.array(highest) + 1.0) ** shares - 1.0
        return tuple(round(float(n)) for n in steps)

    def gains_of(steps: tuple[int, ...]) -> dict[str, float]:
        chosen = {
            role: _least(problem, role) + n * settings[role].step
            for role, n in zip(roles, steps, strict=True)
        }
        return problem.structure.completed(chosen, feed_forward(problem))

    @cache  # of all tries nearly half fall on steps that were tried
    def worth(steps: tuple[int, ...]) -> float:
        return _worth(seen, gains_of(steps), asked)

    def cost(shares: Array) -> float:
        return -worth(steps_of(shares))

    found = differential_evolution(
        cost,
        Bounds([0.0] * len(roles), [1.0] * len(roles)),
        seed=0,
        popsize=8,
        maxiter=25,
        polish=False,
    )
    best = steps_of(found.x)
    return gains_of(best) if worth(best) > 0.0 else None


def softest(problem: Problem) -> dict[str, float]:
    """Return the least gains that the parameters' ranges allow."""
    settings = problem.structure.settings
    chosen = {
        role: settings[role].highest if role == "TC" else _least(problem, role)
        for role in problem.structure.searched
    }
    return problem.structure.completed(chosen, feed_forward(problem))


def _reach(problem: Problem, seen: Scenarios, role: str) -> int:
    """Return the steps of a parameter above its least until a loop of the drawn turns unstable.

    The documented range ends it where it comes first; PX4's reach to a hundred times what flies.
    Aircraft that the least gains leave unstable, as a spiral is, say nothing of too large ones.
    """
    setting, least = problem.structure.settings[role], _least(problem, role)
    last = round((setting.highest - least) / setting.step)
    own = {one: _least(problem, one) for one in problem.structure.searched}

    def stable(steps: int) -> Array:
        gains = {**own, role: least + steps * setting.step}
        return seen.stable(problem.structure.completed(gains, feed_forward(problem)))

    before, steps = stable(0), 1
    while steps < last:
        if np.any(before > stable(steps)):
            return steps
        steps *= 2
    return last


def _least(problem: Problem, role: str) -> float:
    # A derivative gain may stay off, whatever its documented range says of one that is on.
    return 0.0 if role == "D" else problem.structure.settings[role].lowest


def _worth(seen: Scenarios, gains: Mapping[str, float], asked: Required) -> float:
    """Return the least crossover (rad/s) where all is kept, else minus what is missing."""
    inner, outer = seen.judged(gains)
    missing = asked.missing(inner) + asked.missing(outer)
    if missing > 0.0:
        return -missing
    limit = SURFACE_SHARE * seen.problem.actuator.rate_limit_radps / NORMAL_95
    slew = seen.problem.structure.slew_limit_per_s / NORMAL_95
    surface, output = (float(np.max(one)) for one in seen.moving(gains))
    over = max(surface / limit, output / slew) - 1.0
    if over > 0.0:
        return -over
    wanted = {"actuator": inner, "attitude": outer}[seen.problem.structure.fastest]
    return float(np.min(wanted.crossover_radps)) if seen.stable(gains).all() else -1e3


def feed_forward(problem: Problem) -> float:
    """Return the share of travel that holds 1 rad/s at the trim.

    Roll: L_p over L_da. Pitch: that of the short period, whose rate follows alpha.
    """
    axis = problem.axis
    a, b, states = axis.matrices(axis.mean, axis.trim.airspeed_mps)
    fast = [k for k, s in enumerate(states) if s in (RATES[axis.axis], "alpha_rad")]
    rate = fast.index(states.index(RATES[axis.axis]))
    steady = np.linalg.solve(-a[np.ix_(fast, fast)], b[fast, 0])[rate]
    return float(1.0 / (abs(steady) * problem.actuator.travel_rad))

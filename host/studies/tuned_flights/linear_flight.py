"""Linear aircraft drawn from an answer's covariance, flown by the law with its limits."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np
from host.arrays import Array
from host.control.scenarios import Problem, draw, padded

from studies.tuned_flights.closed_loop_flight import BANK_RAD, PITCH_RAD, Demand, Flown


def fly_linear(
    problem: Problem, gains: Mapping[str, float], demand: Demand, *, seed: int, count: int
) -> Iterator[tuple[float, list[Flown]]]:
    """Yield each airspeed with the flights of aircraft drawn, one after the step of the demand.

    What the law asks stands for the surface, in mean travel. Travel ends it, and the integral its
    limit; the servo has no rate limit here.

    Parameters
    ----------
    problem : Problem
    gains : mapping of str to float
        By role.
    demand : Demand
        A step of the problem's axis.
    seed, count : int
        Seed and number of the aircraft drawn.
    """
    axis = problem.axis.axis
    size_rad = demand.bank_rad if axis == "roll" else demand.pitch_rad
    furthest = BANK_RAD if axis == "roll" else PITCH_RAD
    seen = draw(problem, seed=seed, count=count)
    for airspeed, row in zip(problem.airspeeds_mps, seen.of_speed, strict=True):
        plants = [one.plant for one in row]
        states = max(len(one.a) for one in plants)
        a, b, c = (
            np.stack([padded(one.a, states, states) for one in plants]),
            np.stack([padded(one.b, states, 1) for one in plants])[..., 0],
            np.stack([padded(one.c, 2, states) for one in plants]),
        )
        law = problem.structure.loop(gains, airspeed)
        steps = round(demand.seconds / law.period_s)
        t = law.period_s * np.arange(steps)
        x: Array = np.zeros((count, states))
        kept: Array = np.zeros((count, law.states))
        angle, output = np.empty((count, steps)), np.empty((count, steps))
        for k in range(steps):
            angle[:, k], rate = np.einsum("nij,nj->in", c, x)
            asked = size_rad * (t[k] >= demand.at_s)
            kept, out = law.step(kept, asked - angle[:, k], rate)
            output[:, k] = np.clip(out, -1.0, 1.0)
            x = np.einsum("nij,nj->ni", a, x) + b * output[:, k, None]
        surface = problem.actuator.travel_rad * output
        lost = ~(np.max(np.abs(angle), axis=1) < furthest)  # no number is lost too
        yield airspeed, [_flown(axis, *one) for one in zip([t] * count, angle, output, surface,
                                                           lost, strict=True)]  # fmt: skip


def _flown(axis: str, t: Array, angle: Array, output: Array, surface: Array, lost: bool) -> Flown:
    return Flown(t, {axis: angle}, {axis: output}, {axis: output}, {axis: surface}, bool(lost))

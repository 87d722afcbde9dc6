"""NAVION maneuvers with the noise of the accuracy study: white, a given ratio of variances."""

import numpy as np

from host.compiled import Array
from host.sysid.maneuver import Maneuver
from host.sysid.problem import OutputProblem
from host.sysid.study.aircraft import navion, navion_structured
from host.sysid.study.inputs import SHAPES

AMPLITUDE_RAD = 0.05
TRUTH = navion_structured().start


def clean(
    dt_s: float = 0.05, duration_s: float = 20.0, shape: str = "3-2-1-1"
) -> tuple[Array, Array]:
    """Return input and states without noise, (samples, 1) and (samples, 4)."""
    model = navion_structured()
    u = SHAPES[shape](AMPLITUDE_RAD, dt_s, duration_s)
    problem = OutputProblem(model, [Maneuver(dt_s, u, np.zeros((len(u), 4)))])
    response = problem.respond(np.concatenate([model.start, np.zeros(4)]))
    assert response is not None
    return u, response[0].y.T


def noisy(
    seed: int, dt_s: float = 0.05, *, snr: float = 10.0, duration_s: float = 20.0
) -> Maneuver:
    """Return a maneuver with white noise on the states."""
    u, y = clean(dt_s, duration_s)
    rng = np.random.default_rng(seed)
    return Maneuver(
        dt_s, u, y + np.sqrt(np.mean(y**2, axis=0) / snr) * rng.standard_normal(y.shape)
    )


def with_rates(
    seed: int, dt_s: float = 0.05, *, snr: float = np.inf, shape: str = "3-2-1-1"
) -> Maneuver:
    """Return a maneuver whose analytic state rates were measured too."""
    u, y = clean(dt_s, shape=shape)
    A, B = navion()
    rates = y @ A.T + u @ B.T
    rng = np.random.default_rng(seed)
    deviation = [np.sqrt(np.mean(x**2, axis=0) / snr) for x in (y, rates)]
    return Maneuver(
        dt_s,
        u,
        y + deviation[0] * rng.standard_normal(y.shape),
        rates=rates + deviation[1] * rng.standard_normal(y.shape),
    )

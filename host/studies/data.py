"""NAVION maneuvers: white noise of a given ratio of variances, or gusts and light sensor noise.

Gusts reach the linear NAVION through the angle of attack; their spectrum is first-order, of the
variance and scale of the Dryden one (MIL-F-8785C).
"""

import numpy as np
from host.arrays import Array
from host.sysid.models import Maneuver
from host.sysid.numerics import OutputProblem
from scipy import linalg

from studies.inputs import SHAPES
from studies.navion import FOOT_M, SPEED_FTPS, navion, navion_structured

AMPLITUDE_RAD = 0.05
TRUTH = navion_structured().start
SPEED_MPS = SPEED_FTPS * FOOT_M
SCALE_M = 150.0  # of vertical gusts at the height of a light aircraft's test, m
SENSOR_SHARE = 0.02  # noise over rms of each clean signal
FINE = 4  # integration steps per sample
PILOT_GAIN = (0.15, 0.05)  # elevator per theta and q: a pilot who holds the attitude


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


def gusty(seed: int, dt_s: float, *, intensity_mps: float = 0.5, pilot: bool = False) -> Maneuver:
    """Return one flight of the NAVION through gusts.

    Parameters
    ----------
    seed : int
        Seed of gust and sensor noise.
    dt_s : float
        Sample period, s.
    intensity_mps : float
        Standard deviation of the vertical gust, m/s.
    pilot : bool
        Whether attitude and rate feed back to the elevator on top of the test input.
    """
    u, y = clean(dt_s)
    A, B = navion()
    rng = np.random.default_rng([20260401, seed])
    rate = SPEED_MPS / SCALE_M
    wide = np.zeros((5, 5))
    wide[:4, :4] = A
    wide[:3, 4] = A[:3, 1]  # a gust is an angle of attack to the forces and moments
    wide[4, 4] = -rate
    step = dt_s / FINE
    push = np.vstack([B, [[0.0]]])
    block = linalg.expm(np.block([[wide, push], [np.zeros((1, 6))]]) * step)
    F, G = block[:5, :5], block[:5, 5]
    sigma = intensity_mps / SPEED_MPS
    kick = sigma * np.sqrt(1.0 - np.exp(-2.0 * rate * step))
    x = np.zeros(5)
    x[4] = sigma * rng.standard_normal()
    states, inputs = np.zeros_like(y), u.copy()
    for k in range(len(u)):
        if pilot:
            inputs[k, 0] += PILOT_GAIN[0] * x[3] + PILOT_GAIN[1] * x[2]
        states[k] = x[:4]
        states[k, 1] += x[4]  # the vane sees the gust
        for _ in range(FINE):
            x = F @ x + G * inputs[k, 0]
            x[4] += kick * rng.standard_normal()
    deviation = SENSOR_SHARE * np.sqrt(np.mean(y**2, axis=0))
    return Maneuver(
        dt_s, inputs, states + deviation * rng.standard_normal(y.shape), name=f"gusts, seed {seed}"
    )

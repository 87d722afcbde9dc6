"""A linear aircraft with a law between its states and a surface: columns of one flight."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from host.arrays import Array
from host.sysid.models import LinearModel, Trim, template
from numpy.random import Generator
from studies.wrong_flights import NOISE_SD, TRUTH

DT_S, FINE = 0.02, 4
GUST_RAD, GUST_S = 0.012, 1.0


@dataclass(frozen=True)
class Law:
    """surface = sum of gains times states, behind a delay, a lag and a wash-out."""

    surface: str
    gains: dict[str, float]
    delay_s: float = 0.04
    lag_s: float = 0.0
    washout_s: float = np.inf


def flown(name: str, inputs: dict[str, Array], law: Law | None, seed: int) -> dict[str, Array]:
    """Return the columns of a flight of a template in light gusts, by the rule of midpoints."""
    rng = np.random.default_rng(seed)
    model = template(name, Trim(17.0, 0.06, 0.06))
    A, B, C, D = model.matrices(np.array([TRUTH[name][p.name] for p in model.parameters]))
    count, dt = len(next(iter(inputs.values()))) * FINE, DT_S / FINE
    vane = model.states.index("alpha_rad" if "alpha_rad" in model.states else "beta_rad")
    gust = np.zeros(count)
    for k in range(1, count):
        gust[k] = gust[k - 1] * (1.0 - dt / GUST_S)
        gust[k] += GUST_RAD * np.sqrt(2.0 * dt / GUST_S) * rng.standard_normal()
    moved = np.zeros((count, len(model.inputs)))  # within each fine step
    given = np.zeros_like(moved[::FINE])
    for surface, values in inputs.items():
        at = model.inputs.index(surface)
        given[:, at] = values
        middles = (np.arange(count) + 0.5) / FINE
        moved[:, at] = np.interp(middles, np.arange(len(values)), values)
    own = np.zeros(count)
    winds = np.outer(gust, A[:, vane]) + moved @ B.T
    ahead = np.eye(len(A)) + 0.5 * dt * A  # by the wind; by the state one more of it
    F, G = np.eye(len(A)) + dt * A @ ahead, dt * ahead
    x, lagged, slow = np.zeros((count + 1, len(A))), 0.0, 0.0
    for k in range(count):
        if law is not None:
            then = max(k - round(law.delay_s / dt), 0)
            value = sum(g * x[then, model.states.index(s)] for s, g in law.gains.items())
            lagged += (value - lagged) * (dt / law.lag_s if law.lag_s else 1.0)
            slow += (lagged - slow) * dt / law.washout_s
            own[k] = lagged - slow
            winds[k] += B[:, model.inputs.index(law.surface)] * own[k]
        x[k + 1] = F @ x[k] + G @ winds[k]
    if law is not None:
        given[:, model.inputs.index(law.surface)] += own[::FINE]
    states = x[:-1:FINE].copy()
    states[:, vane] += gust[::FINE]
    return _recorded(model, (C, D), states, given, rng)


def _recorded(
    model: LinearModel, CD: tuple[Array, Array], states: Array, given: Array, rng: Generator
) -> dict[str, Array]:
    """Return the columns that noisy sensors make of states and inputs."""
    noise = np.array([NOISE_SD[o] for o in model.outputs])
    y = states @ CD[0].T + given @ CD[1].T
    y += noise * rng.standard_normal(y.shape)
    steady = {"airspeed_mps": 17.0, "alpha_rad": 0.06, "theta_rad": 0.06, "ax_mps2": 0.0}
    columns = {"t_s": DT_S * np.arange(len(y))}
    columns |= {k: np.full(len(y), v) for k, v in steady.items()}
    columns |= {o: y[:, k] for k, o in enumerate(model.outputs)}
    return columns | {i: given[:, k] for k, i in enumerate(model.inputs)}


def doublets(samples: int, starts: tuple[int, ...], side_s: float, size_rad: float) -> Array:
    """Return doublets of an input, (samples,)."""
    u, side = np.zeros(samples), round(side_s / DT_S)
    for start in starts:
        u[start : start + side] = size_rad
        u[start + side : start + 2 * side] = -size_rad
    return u

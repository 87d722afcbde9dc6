"""Gusts in body axes by dead reckoning, and their effect on the rates of the flow.

A gust written in body axes (MIL-F-8785C) turns with the aircraft, so that speeds through the air
follow the rates by more than they do in still air: a gust along the path of a tenth of the airspeed
makes the angle of attack follow the pitch rate by a tenth more. Velocity over the ground comes from
accelerometers, attitude and rates; less the velocity through the air it is the gust, but for what
it was at the start. That start is a velocity which stays with the ground, so three constants in a
flight of perfect sensors. Gusts that stay with the ground altogether do not turn with the aircraft:
which of both it is belongs to the unknowns.

Titterton & Weston, Strapdown Inertial Navigation Technology, 2nd ed., ch. 3, for the reckoning.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from host.arrays import Array
from host.constants import GRAVITY_MPS2

AXES = ("x", "y", "z")


def gust_motion(columns: Mapping[str, Array], dt_s: float) -> tuple[Array, Array]:
    """Return the gust in body axes as far as the flight tells it, and what it does not tell.

    Parameters
    ----------
    columns : mapping
        SI, each (samples,): airspeed, flow angles, rates, bank, pitch, specific forces at the CG.
    dt_s : float

    Returns
    -------
    gust : Array, shape (samples, 3)
        m/s, its constant over the ground chosen so that least is left.
    steady : Array, shape (samples, 3, 3)
        A constant velocity over the ground, given in the body axes of the start, in those of every
        sample: the gust is known but for ``steady @ constant``.
    """
    speed, alpha, beta = (columns[c] for c in ("airspeed_mps", "alpha_rad", "beta_rad"))
    flow = speed[:, None] * np.column_stack(
        [np.cos(alpha) * np.cos(beta), np.sin(beta), np.sin(alpha) * np.cos(beta)]
    )
    theta, phi = columns["theta_rad"], columns["phi_rad"]
    weight = GRAVITY_MPS2 * np.column_stack(
        [-np.sin(theta), np.cos(theta) * np.sin(phi), np.cos(theta) * np.cos(phi)]
    )
    force = weight + np.column_stack([columns[c] for c in ("ax_mps2", "ay_mps2", "az_mps2")])
    rates = np.column_stack([columns[c] for c in ("p_radps", "q_radps", "r_radps")])
    moved = _reckoned(rates, force, dt_s)
    steady = np.ascontiguousarray(moved[:, :, :3])
    miss = moved[:, :, 3] - flow
    constant = np.linalg.lstsq(steady.reshape(-1, 3), -miss.ravel(), rcond=None)[0]
    return miss + steady @ constant, steady


def turning(columns: Mapping[str, Array], motion: Array) -> dict[str, Array]:
    """Return the part of the flow angles' rates that moving air causes while the aircraft turns.

    Parameters
    ----------
    columns : mapping
        As for `gust_motion`.
    motion : Array, shape (samples, 3)
        Body axes, m/s.

    Returns
    -------
    dict
        Rates of ``airspeed_mps``, ``alpha_rad`` and ``beta_rad``.
    """
    p, q, r = (columns[c] for c in ("p_radps", "q_radps", "r_radps"))
    speed, alpha, beta = (columns[c] for c in ("airspeed_mps", "alpha_rad", "beta_rad"))
    sa, ca, sb, cb = np.sin(alpha), np.cos(alpha), np.sin(beta), np.cos(beta)
    u = r * motion[:, 1] - q * motion[:, 2]
    v = p * motion[:, 2] - r * motion[:, 0]
    w = q * motion[:, 0] - p * motion[:, 1]
    along = ca * u + sa * w
    return {
        "airspeed_mps": cb * along + sb * v,
        "alpha_rad": (ca * w - sa * u) / (speed * cb),
        "beta_rad": (cb * v - sb * along) / speed,
    }


def _reckoned(rates: Array, force: Array, dt_s: float) -> Array:
    """Return, in body axes, three unit velocities of the start and the velocity forces make.

    (samples, 3, 4); rates and forces between samples are the mean of their ends, the turn is
    Cayley's, which keeps lengths.
    """
    p, q, r = 0.25 * dt_s * (rates[:-1] + rates[1:]).T
    still = np.zeros_like(p)
    turn = np.array([[still, r, -q], [-r, still, p], [q, -p, still]]).transpose(2, 0, 1)
    push = 0.5 * dt_s * (force[:-1] + force[1:])
    back = np.linalg.inv(np.eye(3) - turn)
    turns, pushes = back @ (np.eye(3) + turn), np.einsum("kij,kj->ki", back, push)
    steps = np.tile(np.eye(4), (len(turns), 1, 1))
    steps[:, :3, :3], steps[:, :3, 3] = turns, pushes
    return _products_before(steps)[:, :3]


def _products_before(steps: Array) -> Array:
    """Return the product of all steps before each, the last of them first, (n + 1, 4, 4).

    Pieces of the record side by side, then each behind the product of all pieces before it: a loop
    over samples is slow in an interpreter.
    """
    count = len(steps)
    length = max(1, round(count**0.5))
    pieces = -(-count // length)
    parts = np.tile(np.eye(4), (pieces * length, 1, 1))
    parts[:count] = steps
    parts = parts.reshape(pieces, length, 4, 4)
    for k in range(1, length):
        parts[:, k] = parts[:, k] @ parts[:, k - 1]
    before = np.eye(4)
    for part in parts:
        part[...] = part @ before
        before = part[-1]
    return np.concatenate([np.eye(4)[None], parts.reshape(-1, 4, 4)[:count]])

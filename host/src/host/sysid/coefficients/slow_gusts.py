"""Slow gusts that a turning aircraft takes along: unknowns of every maneuver.

Gusts are stated in body axes (MIL-F-8785C 3.7.2). Speeds through such air and accelerations differ
by the rates times the gust: a mean vertical gust of 0.15 m/s at 20 m/s stands for 7 mrad between
accelerometers and vanes in all of a roll maneuver, in step with the roll rate, so that no residual
shows it as noise. How large slow gusts may be follows from the fast ones, of which the residuals of
the kinematic equations are made.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from host.arrays import Array
from host.sysid.coefficients.window_spectra import Block, Key
from host.sysid.compatibility.inverse_sensor_model import Spectrum

SHAPES = 3  # mean, slope and bend of a gust over a maneuver; faster ones are noise
# Along and vertical at 100 m over the ground, MIL-F-8785C 3.7.3.
LENGTH_M = {"u": 260.0, "w": 100.0}
RATE_SHARE = {"u": 2.0, "w": 3.0}  # Dryden rates are flat above V/L: this many sigma^2 V/L
GRID = 30  # points of a maneuver for the gust's statistics
# Of each equation: rate, sign, gust. What a slow side gust is turned into is too little.
TURNED = {
    "u": (("q", -1.0, "w"),),
    "v": (("p", 1.0, "w"), ("r", -1.0, "u")),
    "w": (("q", 1.0, "u"),),
}


def turned(signals: Mapping[str, Array], blocks: Sequence[Block]) -> dict[Key, Spectrum]:
    """Return what a gust of 1 m/s of each shape adds to the kinematic equations, (F, k) each.

    Parameters
    ----------
    signals : mapping
        ``p q r`` (n,), rad/s.
    blocks : sequence of Block
    """
    result: dict[Key, Spectrum] = {}
    for name, number in _keys(blocks):
        block = blocks[number]
        shapes = _shapes(len(block.samples))
        table = np.hstack(
            [sign * signals[k][block.samples, None] * shapes for k, sign, _ in TURNED[name]]
        )
        table -= table.mean(axis=0)
        result[name, number] = block.cosines @ table - 1j * (block.sines @ table)
    return result


def gust_strength(
    noise: Mapping[str, tuple[Array, Array]], airspeed_mps: float, dt_s: float
) -> dict[str, float]:
    """Return the standard deviation (m/s) of the gust along, ``u``, and of the vertical one, ``w``.

    Parameters
    ----------
    noise : mapping
        Spectra of residuals; those of ``u`` and ``w`` are of the rates of gusts.
    airspeed_mps, dt_s : float
    """
    return {
        gust: float(np.sqrt(np.median(noise[gust][1]) * dt_s * length_m / airspeed_mps / share))
        for (gust, length_m), share in zip(LENGTH_M.items(), RATE_SHARE.values(), strict=True)
    }


def gust_information(
    blocks: Sequence[Block], strength: Mapping[str, float], airspeed_mps: float, dt_s: float
) -> Array:
    """Return the inverse covariance of all columns of `turned`, in their order.

    One gust goes through all maneuvers: what is left of it in the next one is in it.
    """
    inverse = np.linalg.pinv(_shapes(GRID))
    at_m, of = [], []
    for name, number in _keys(blocks):
        first, last = blocks[number].samples[[0, -1]]
        for _, _, gust in TURNED[name]:
            at_m.append(np.linspace(first, last, GRID) * dt_s * airspeed_mps)
            of.append(gust)
    found = np.zeros((len(of), SHAPES, len(of), SHAPES))
    for i, gust in enumerate(of):
        for j in range(len(of)):
            if of[j] == gust:
                lag = np.abs(at_m[i][:, None] - at_m[j]) / LENGTH_M[gust]
                likeness = np.exp(-lag) * (1.0 - 0.5 * lag if gust == "w" else 1.0)
                found[i, :, j] = strength[gust] ** 2 * inverse @ likeness @ inverse.T
    size = len(of) * SHAPES
    return np.asarray(np.linalg.inv(found.reshape(size, size)), dtype=np.float64)


def _keys(blocks: Sequence[Block]) -> list[Key]:
    return [(name, k) for k, block in enumerate(blocks) for name in block.names if name in TURNED]


def _shapes(count: int) -> Array:
    at = np.linspace(-1.0, 1.0, count)
    return np.asarray(np.polynomial.legendre.legvander(at, SHAPES - 1), dtype=np.float64)

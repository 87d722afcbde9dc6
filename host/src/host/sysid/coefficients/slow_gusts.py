"""Slow gusts of a maneuver as unknowns: regressors, strength, prior covariance.

Gusts are stated in body axes (MIL-F-8785C 3.7.2), so they turn with the aircraft. Velocity through
such air and acceleration differ by the rates times the gust: a mean vertical gust of 0.15 m/s at
20 m/s is 7 mrad between accelerometers and vanes in all of a roll maneuver. It is in step with the
roll rate, so no residual shows it as noise. The strength of slow gusts follows from that of fast
ones, which are the residuals of the kinematic equations.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from host.arrays import Array
from host.sysid.coefficients.window_spectra import EquationKey, WindowTransform
from host.sysid.reconstruction.inverse_sensor_model import Spectrum

LEGENDRE_TERMS = 3  # mean, slope and curvature of a gust over a maneuver; faster ones are noise
# Scale lengths along and vertical at 100 m over the ground, MIL-F-8785C 3.7.3.
LENGTH_M = {"u": 260.0, "w": 100.0}
# Above V/L the spectrum of a Dryden gust's rate is flat: this many sigma^2 V/L.
RATE_SPECTRUM = {"u": 2.0, "w": 3.0}
GRID = 30  # points of a maneuver at which the gust's covariance is formed
# Maneuvers of two axes at one time meet the same gust: no covariance with an inverse says so. They
# may differ by a thousandth of its standard deviation.
OWN_SHARE = 1e-6
# Gust terms of each kinematic equation: rate, sign, gust component. A slow side gust is negligible.
GUST_TERMS = {
    "u": (("q", -1.0, "w"),),
    "v": (("p", 1.0, "w"), ("r", -1.0, "u")),
    "w": (("q", 1.0, "u"),),
}


def gust_regressors(
    signals: Mapping[str, Array], windows: Sequence[WindowTransform]
) -> dict[EquationKey, Spectrum]:
    """Return the regressors of slow gusts in the kinematic equations, (F, k) each.

    Each is what one Legendre polynomial of a gust of 1 m/s adds: omega x gust.

    Parameters
    ----------
    signals : mapping
        ``p q r`` (n,), rad/s.
    windows : sequence of WindowTransform
    """
    result: dict[EquationKey, Spectrum] = {}
    for name, number in _keys(windows):
        window = windows[number]
        shapes = _legendre(len(window.samples))
        table = np.hstack(
            [sign * signals[k][window.samples, None] * shapes for k, sign, _ in GUST_TERMS[name]]
        )
        table -= table.mean(axis=0)
        result[name, number] = window.cosines @ table - 1j * (window.sines @ table)
    return result


def gust_strength(
    noise: Mapping[str, tuple[Array, Array]], airspeed_mps: float, dt_s: float
) -> dict[str, float]:
    """Return the standard deviation (m/s) of the gust along, ``u``, and of the vertical one, ``w``.

    Parameters
    ----------
    noise : mapping
        Frequency (Hz) and spectra of residuals; those of ``u`` and ``w`` are of gust rates, and
        without elevator maneuvers that of ``v`` stands for them.
    airspeed_mps, dt_s : float
    """
    own = {gust: noise[gust] if gust in noise else noise["v"] for gust in LENGTH_M}
    return {
        gust: float(np.sqrt(np.median(own[gust][1]) * dt_s * length_m / airspeed_mps / share))
        for (gust, length_m), share in zip(LENGTH_M.items(), RATE_SPECTRUM.values(), strict=True)
    }


def gust_information(
    windows: Sequence[WindowTransform],
    strength: Mapping[str, float],
    airspeed_mps: float,
    dt_s: float,
) -> Array:
    """Return the inverse prior covariance of all columns of `gust_regressors`, in their order.

    One gust passes through all maneuvers, so its values in successive maneuvers are correlated.

    Parameters
    ----------
    windows : sequence of WindowTransform
    strength : mapping
        Standard deviation (m/s) by component, from `gust_strength`.
    airspeed_mps, dt_s : float

    Returns
    -------
    Array, shape (k, k)
        s2/m2.
    """
    inverse = np.linalg.pinv(_legendre(GRID))
    at_m, of = [], []
    for name, number in _keys(windows):
        first, last = windows[number].samples[[0, -1]]
        for _, _, gust in GUST_TERMS[name]:
            at_m.append(np.linspace(first, last, GRID) * dt_s * airspeed_mps)
            of.append(gust)
    found = np.zeros((len(of), LEGENDRE_TERMS, len(of), LEGENDRE_TERMS))
    for i, gust in enumerate(of):
        for j in range(len(of)):
            if of[j] == gust:
                lag = np.abs(at_m[i][:, None] - at_m[j]) / LENGTH_M[gust]
                # Dryden correlation (EQUATIONS.md, eq. 11).
                correlation = np.exp(-lag) * (1.0 - 0.5 * lag if gust == "w" else 1.0)
                found[i, :, j] = strength[gust] ** 2 * inverse @ correlation @ inverse.T
    size = len(of) * LEGENDRE_TERMS
    covariance = found.reshape(size, size)
    covariance[np.diag_indices(size)] *= 1.0 + OWN_SHARE
    return np.asarray(np.linalg.inv(covariance), dtype=np.float64)


def _keys(windows: Sequence[WindowTransform]) -> list[EquationKey]:
    return [
        (name, k)
        for k, window in enumerate(windows)
        for name in window.equations
        if name in GUST_TERMS
    ]


def _legendre(count: int) -> Array:
    at = np.linspace(-1.0, 1.0, count)
    return np.asarray(np.polynomial.legendre.legvander(at, LEGENDRE_TERMS - 1), dtype=np.float64)

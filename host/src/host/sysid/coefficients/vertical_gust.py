"""Strength of the vertical gust, from what the kinematic equations leave."""

from __future__ import annotations

import numpy as np

from host.arrays import Array

LENGTH_M = 100.0  # vertical scale length at 100 m over the ground, MIL-F-8785C 3.7.3
# Above V/L the spectrum of a Dryden gust's rate is flat: this many sigma^2 V/L (EQUATIONS.md,
# eq. 11).
RATE_SPECTRUM = 3.0


def vertical_gust_mps(rate_spectrum: Array, airspeed_mps: float, dt_s: float) -> float:
    """Return the standard deviation of the vertical gust, m/s.

    Parameters
    ----------
    rate_spectrum : Array, shape (F,)
        Spectrum of the residual of a kinematic equation, which is the gust's rate.
    airspeed_mps, dt_s : float
    """
    squared = np.median(rate_spectrum) * dt_s * LENGTH_M / airspeed_mps / RATE_SPECTRUM
    return float(np.sqrt(squared))

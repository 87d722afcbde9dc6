"""The Fourier transform of a record at frequencies of any spacing."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from host.arrays import Array

Spectrum = NDArray[np.complexfloating]


def transform(values: Array, dt_s: float, frequency_hz: Array) -> Spectrum:
    """Return the sums of values exp(-j w t) at evenly spaced frequencies, (frequencies, columns).

    EQUATIONS.md, eq. 20, by chirp-z transform: Morelli, NASA TM-1999-209120.
    """
    from scipy import signal  # takes seconds, and few answers have a spectrum

    spacing = frequency_hz[1] - frequency_hz[0]
    return np.asarray(
        signal.czt(
            values,
            m=len(frequency_hz),
            w=np.exp(-2j * np.pi * spacing * dt_s),
            a=np.exp(2j * np.pi * frequency_hz[0] * dt_s),
            axis=0,
        )
    )

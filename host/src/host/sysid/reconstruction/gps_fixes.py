"""Where GPS fixes are in columns that draw lines between them."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from host.arrays import Array, BoolArray
from host.sysid.reconstruction.flight_path import GPS

FIX_BEND_MPS = 1e-6


def gps_fixes(data: Mapping[str, Array]) -> BoolArray:
    """Return which samples are GPS fixes: between them a decoded table is linear."""
    bend = sum(np.abs(np.diff(data[name], n=2)) for name in GPS)
    bend = np.concatenate([[0.0], bend, [0.0]])
    known = bend > FIX_BEND_MPS
    peak = (bend >= np.roll(bend, 1)) & (bend > np.roll(bend, -1))
    return np.asarray(known & peak)

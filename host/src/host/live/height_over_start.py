"""Height over the place where the stream began, from pressure altitude."""

from __future__ import annotations

import numpy as np

from host.live.live_sample import Array


class HeightOverStart:
    """Takes the first altitude that is known as the start's: weather moves it by metres an hour."""

    def __init__(self) -> None:
        self._start_m = np.nan

    def of(self, altitude_m: Array) -> Array:
        """Return heights over the start, m; NaN where there is no altitude."""
        if np.isnan(self._start_m):
            known = altitude_m[np.isfinite(altitude_m)]
            if len(known):
                self._start_m = float(known[0])
        return np.asarray(altitude_m - self._start_m, np.float64)

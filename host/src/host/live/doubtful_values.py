"""Values that cannot be, named: none of them stands on the page as if it were measured."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Mapping

from host.live.live_sample import Array

_MEAN_S = 1.0  # one row is noise
_LEAST_AIRSPEED_MPS = -5.0  # three counts below zero: 4.9 Pa each (MPXV7002DP at 10 bits)
_STOPPED_DEG = 90.0  # no vane turns further: ours stops at 60, the thesis's at 90
_ALTITUDES_M = (-540.0, 5600.0)  # 108 to 50 kPa: no field lies outside
_APART_M = 60.0  # of two heights over the start: GPS 20 m, weather and wash at the port 10 m
_SIDES = {"a": "left", "b": "right"}
_WATCHED = (
    *(f"airspeed_{side}_mps" for side in _SIDES),
    *(f"{vane}_{side}_deg" for vane in ("alpha", "beta") for side in _SIDES),
    "altitude_m",
    "height_m",
)


class DoubtfulValues:
    """Means of the last second of what has limits."""

    def __init__(self) -> None:
        self._rows: deque[tuple[float, ...]] = deque()

    def take(self, rows: Mapping[str, Array]) -> None:
        """Take rows of the stream."""
        columns = (rows[name].tolist() for name in ("t_s", *_WATCHED))
        self._rows.extend(zip(*columns, strict=True))
        while self._rows and not 0.0 <= self._rows[-1][0] - self._rows[0][0] <= _MEAN_S:
            self._rows.popleft()

    def named(self, gps_height_m: float = math.nan) -> list[dict[str, str]]:
        """Return what cannot be: which figure, and why in words.

        Parameters
        ----------
        gps_height_m : float
            Height over the start by GPS; NaN without.
        """
        mean = {name: _mean([row[at] for row in self._rows]) for at, name in enumerate(_WATCHED, 1)}
        found = []
        for side, word in _SIDES.items():
            speed = mean[f"airspeed_{side}_mps"]
            if speed < _LEAST_AIRSPEED_MPS:
                why = "hoses swapped, port covered, or its zero is wrong"
                found.append(_doubt("airspeed", f"{word} pitot says {speed:.0f} m/s: {why}"))
            for vane in ("alpha", "beta"):
                angle = mean[f"{vane}_{side}_deg"]
                if abs(angle) > _STOPPED_DEG:
                    why = "past its stop: calibration or plug"
                    found.append(_doubt(vane, f"{word} {vane} vane says {angle:.0f} deg, {why}"))
        altitude, height = mean["altitude_m"], mean["height_m"]
        if altitude < _ALTITUDES_M[0] or altitude > _ALTITUDES_M[1]:
            found.append(_doubt("height", f"barometer says {altitude:.0f} m above the sea"))
        elif abs(height - gps_height_m) > _APART_M:
            both = f"barometer says {height:.0f} m over the start, GPS {gps_height_m:.0f} m"
            found.append(_doubt("height", both))
        return found


def _mean(values: list[float]) -> float:
    known = [value for value in values if math.isfinite(value)]
    return sum(known) / len(known) if known else math.nan


def _doubt(figure: str, text: str) -> dict[str, str]:
    return {"figure": figure, "text": text}

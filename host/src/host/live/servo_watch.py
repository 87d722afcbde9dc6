"""Servo jumps as they come: what the log's own rule finds in the last rows.

While the logger flies a row of its card it moves servos and nobody's stick: that is no jump.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from host.live.live_sample import LiveUpdate
from host.log.servo_jumps import LONGEST_S, servo_jumps
from host.wire.flight_card import number

SURFACES = ("elevator", "aileron", "rudder", "throttle")
_KEPT_S = 1.5  # a jump is back within 0.15 s, and 0.1 s before it is looked at
_EVERY_S = 0.25


class ServoWatch:
    """Counts jumps of each surface."""

    def __init__(self) -> None:
        self.jumps = dict.fromkeys(SURFACES, 0)
        self._counted_s = dict.fromkeys(SURFACES, -np.inf)
        self._looked_s = -np.inf
        self._rows: dict[str, NDArray[np.float64]] = {}
        self._drives: NDArray[np.bool_] = np.empty(0, bool)
        self._input_s = (-np.inf, -np.inf)  # of the last row flown by the logger

    def input_starts(self, t_s: float) -> None:
        """Take the begin of a row; lost its end, it ends where the longest does."""
        self._input_s = t_s, t_s + 1e-3 * number("card_longest_ms")

    def input_ends(self, t_s: float) -> None:
        """Take the end of a row."""
        self._input_s = self._input_s[0], t_s

    def add(self, update: LiveUpdate) -> list[str]:
        """Take more rows; return the surface of each jump found."""
        if not len(update):
            return []
        t_s = self._joined("t_s", update.rows["t_s"])
        self._drives = np.r_[self._drives, update.mega_drives]
        for surface in SURFACES:
            for name in (f"servo_{surface}_us", f"rc_{surface}_us"):
                self._joined(name, update.rows[name])
        if t_s[-1] - self._looked_s < _EVERY_S and t_s[-1] >= self._looked_s:
            return []
        self._looked_s = float(t_s[-1])
        found = [surface for surface in SURFACES for _ in range(self._new(surface))]
        keep = t_s > t_s[-1] - _KEPT_S
        self._rows = {name: column[keep] for name, column in self._rows.items()}
        self._drives = self._drives[keep]
        return found

    def _joined(self, name: str, new: NDArray[np.float64]) -> NDArray[np.float64]:
        self._rows[name] = np.r_[self._rows[name], new] if name in self._rows else new
        return self._rows[name]

    def _new(self, surface: str) -> int:
        at_s = servo_jumps(
            self._rows["t_s"],
            self._rows[f"servo_{surface}_us"],
            self._rows[f"rc_{surface}_us"],
            self._drives,
        )
        first_s, last_s = self._input_s
        flown = (at_s >= first_s - LONGEST_S) & (at_s <= last_s)
        new = at_s[(at_s > self._counted_s[surface]) & ~flown]
        if len(new):
            self._counted_s[surface] = float(new[-1])
            self.jumps[surface] += len(new)
        return len(new)

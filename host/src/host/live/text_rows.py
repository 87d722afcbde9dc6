"""Rows of text from the original logger, or from ours set to `ascii`: shown as they come.

They carry no time: each row is placed where it arrived.
"""

from __future__ import annotations

import numpy as np

from host.errors import HostError
from host.live.height_over_start import HeightOverStart
from host.live.live_sample import LIVE_UNITS, LiveUpdate
from host.original.row_table import make_table
from host.original.rows import looks_like_rows, parse_rows
from host.people_units import people_columns
from host.physical.calibration import Calibration

_LONGEST = 4096


class TextRows:
    """Bytes in any portions in, rows out.

    Parameters
    ----------
    calibration : Calibration
    """

    def __init__(self, calibration: Calibration) -> None:
        self.rows = 0
        self._calibration = calibration
        self._held = bytearray()
        self._first_s: float | None = None
        self._height = HeightOverStart()

    def feed(self, data: bytes, arrived_s: float) -> LiveUpdate | None:
        """Take more of the stream; return the rows that it completes, None without any."""
        self._held += data
        end = max(self._held.rfind(b"\r"), self._held.rfind(b"\n")) + 1
        whole = bytes(self._held[:end])
        del self._held[:end]
        del self._held[:-_LONGEST]
        if not looks_like_rows(whole):
            return None
        try:
            table = make_table(parse_rows(whole), self._calibration).columns
        except HostError:  # hardly more than fragments
            return None
        count = len(table["t_s"])
        self.rows += count
        if self._first_s is None:
            self._first_s = arrived_s
        nothing = np.full(count, np.nan)
        read = people_columns(table)
        rows = {name: np.asarray(read.get(name, nothing), float) for name in LIVE_UNITS}
        rows["airspeed_a_mps"] = np.asarray(table["airspeed_mps"], float)
        rows["height_m"] = self._height.of(rows["altitude_m"])
        rows["t_s"] = np.full(count, arrived_s - self._first_s)
        return LiveUpdate(rows, np.ones(count, bool), 0, [], arrived_s)

"""The Mega's clock: ticks of 0.5 us, with the drawn rate error."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from numpy.typing import NDArray

from host.twin.flight.fly import FlightRecord

Ticks = NDArray[np.int64]
TICKS_PER_S = 2_000_000


def clock_share(record: FlightRecord) -> float:
    """Return the share by which the Mega's clock runs fast."""
    return record.draws.scalar("clock_share") if record.card.sensors.clock_error else 0.0


def ticks(record: FlightRecord, t_s: npt.ArrayLike) -> Ticks:
    """Return Mega ticks of true times."""
    scaled = np.asarray(t_s, dtype=np.float64) * (1.0 + clock_share(record)) * TICKS_PER_S
    return np.asarray(np.round(scaled), dtype=np.int64)

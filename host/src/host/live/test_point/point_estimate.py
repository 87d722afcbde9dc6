"""What one test point tells, from the rows that the radio brought: by the estimator of its promise.

The same call as for the log of the card, on the last rows received. The 20 rows a second are drawn
to the rate of the log first: edges of an input fall between two rows, and the finder would cut its
windows at rows.
"""

from __future__ import annotations

import tempfile
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pandas as pd
from scipy.interpolate import CubicSpline

from host.arrays import Array
from host.errors import HostError
from host.log import read_log
from host.physical.sampling import GAP_FACTOR
from host.planning.point_widths import (
    point_derivatives,
    promise_points,
    single_point_card,
    single_point_widths,
)
from host.planning.predicted_widths import LIGHT_GUSTS_MPS, PredictedWidth
from host.sysid.identification_error import IdentificationError
from host.twin.testcard.cards import Card, Segment

PROMISE_FLIGHTS = 11  # half-widths scatter by 8 % from flight to flight
STEP_S = 0.01
FEWEST = 30  # rows: 1.5 s of the radio


@dataclass(frozen=True, slots=True)
class PointEstimate:
    """Half-widths that a point is promised to give, and those that it gave.

    Attributes
    ----------
    promised : tuple of PredictedWidth
        Empty where nobody can say.
    half_widths : dict of str to float
        By derivative; empty where an estimator has no answer.
    """

    promised: tuple[PredictedWidth, ...] = ()
    half_widths: dict[str, float] = field(default_factory=dict)


class PointEstimator:
    """Estimates points of one card; what they are promised to tell is reckoned once.

    Parameters
    ----------
    card : Card
    calibration : str
        TOML, counts to SI.
    promised : mapping of Segment to tuple of PredictedWidth, optional
        Promises that are known already.
    """

    def __init__(
        self,
        card: Card,
        calibration: str,
        promised: Mapping[Segment, tuple[PredictedWidth, ...]] | None = None,
    ) -> None:
        self._card, self._calibration = card, calibration
        self._promised = dict(promised or {})

    def promise(self, point: Segment) -> tuple[PredictedWidth, ...]:
        """Return what a point of the card is promised to tell: seconds of work, once."""
        if point not in self._promised:
            self._promised[point] = _promised(self._card, point)
        return self._promised[point]

    def estimate(self, point: Segment, data: bytes, last_s: float) -> PointEstimate:
        """Return what bytes tell of a point that began in their last seconds.

        Without a promise where that was not reckoned yet.
        """
        found: dict[str, float] = {}
        try:
            table = finer(self._table(data))
            widths = single_point_widths(point, table, self._card.aircraft, last_s)
            found = {name: float(width.half_width) for name, width in widths.items()}
        except HostError:
            pass  # too little of it arrived, or nothing moved
        return PointEstimate(self._promised.get(point, ()), found)

    def _table(self, data: bytes) -> pd.DataFrame:
        with tempfile.TemporaryDirectory(prefix="host-point-") as folder:
            recording, text = Path(folder) / "last.radio", Path(folder) / "calibration.toml"
            recording.write_bytes(data)
            text.write_text(self._calibration, encoding="utf-8")
            return read_log(recording, calibration=text).table()


def _promised(card: Card, point: Segment) -> tuple[PredictedWidth, ...]:
    """Return the promise; none where it cannot be flown through the recorder, as a log is."""
    gusts = card.air.turbulence_mps or LIGHT_GUSTS_MPS
    try:
        found = promise_points(single_point_card(card, point), gusts, flights=PROMISE_FLIGHTS)
    except HostError:
        return ()
    whole = [
        p for p in found if p.recorded and {w.name for w in p.widths} == {*point_derivatives(point)}
    ]
    return whole[0].widths if whole else ()


def finer(table: pd.DataFrame) -> pd.DataFrame:
    """Return a table at the rate of the card's log, curves drawn between its rows.

    Parameters
    ----------
    table : DataFrame
        SI, as `host.read_log(...).table()` returns it.

    Raises
    ------
    IdentificationError
        Too few rows.
    """
    if len(table) < FEWEST:
        raise IdentificationError(f"{len(table)} rows arrived, {FEWEST} are needed")
    t = table["t_s"].to_numpy(np.float64)
    at = np.arange(t[0], t[-1], STEP_S)
    out: dict[str, Array] = {"t_s": at}
    for name in table.columns.drop("t_s"):
        values = pd.to_numeric(table[name], errors="coerce").to_numpy(np.float64)
        known = np.isfinite(values)
        if known.sum() < FEWEST:
            continue
        own, series = t[known], values[known]
        out[name] = np.interp(at, own, series)
        gaps = np.diff(own)
        if known.mean() > 0.5:  # of every row: not those of a slower sensor
            near = gaps[np.clip(np.searchsorted(own, at) - 1, 0, len(gaps) - 1)]
            curve = CubicSpline(own, series)(at)
            even = near < GAP_FACTOR * np.median(gaps)
            out[name] = np.where(even, curve, out[name])
    return pd.DataFrame(out)

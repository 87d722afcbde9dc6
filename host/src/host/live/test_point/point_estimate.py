"""What one test point tells, from the rows that the radio brought: by the estimator of its promise.

The same call as for the log of the card, on the last rows received, drawn to the rate of the log.
Twice: weighted by the residuals of these rows, which know this point's gusts and what was missed
between two rows as well, and scatter; and by those of the flights of the promise, which do not.
"""

from __future__ import annotations

import tempfile
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path

import pandas as pd

from host.errors import HostError
from host.live.test_point.between_rows import drawn_rows
from host.log import read_log
from host.planning.aircraft_response import AircraftResponse, card_response
from host.planning.point_widths import (
    PointPromise,
    identify_single_point,
    point_derivatives,
    promise_points,
    single_point_card,
)
from host.planning.predicted_widths import LIGHT_GUSTS_MPS, FlightWidth, PredictedWidth
from host.sysid.coefficients import ResidualSpectra
from host.sysid.maneuvers import DetectedManeuver
from host.twin.testcard.cards import Card, Segment

PROMISE_FLIGHTS = 11  # half-widths scatter by 8 % from flight to flight
BEFORE_S = 3.0  # of trim before the input, from where on the aircraft's motion is followed


@dataclass(frozen=True, slots=True)
class PointEstimate:
    """Half-widths that a point is promised to give, and those that it gave.

    Attributes
    ----------
    promised : tuple of PredictedWidth
        Empty where nobody can say.
    measured : dict of str to FlightWidth
        By derivative, weighted by the residuals of the rows that came; empty without an answer.
    expected : dict of str to FlightWidth
        The same with the residuals of the flights of the promise.
    """

    promised: tuple[PredictedWidth, ...] = ()
    measured: dict[str, FlightWidth] = field(default_factory=dict)
    expected: dict[str, FlightWidth] = field(default_factory=dict)


class PointEstimator:
    """Estimates points of one card; what they are promised to tell is reckoned once.

    Parameters
    ----------
    card : Card
    calibration : str
        TOML, counts to SI.
    promised : mapping of Segment to PointPromise, optional
        Promises that are known already.
    """

    def __init__(
        self,
        card: Card,
        calibration: str,
        promised: Mapping[Segment, PointPromise] | None = None,
    ) -> None:
        self._card, self._calibration = card, calibration
        self._promised: dict[Segment, PointPromise | None] = dict(promised or {})

    @cached_property
    def _response(self) -> AircraftResponse:
        return card_response(self._card)

    def promise(self, point: Segment) -> PointPromise | None:
        """Return what a point of the card is promised to tell: seconds of work, once.

        None where nobody can say.
        """
        if point not in self._promised:
            self._promised[point] = _promised(self._card, point)
        return self._promised[point]

    def estimate(self, point: Segment, data: bytes, flown: DetectedManeuver) -> PointEstimate:
        """Return what bytes say of a point.

        Without a promise where that was not reckoned yet.

        Parameters
        ----------
        point : Segment
            The card's.
        data : bytes
            Bytes of the radio.
        flown : DetectedManeuver
            Its input, in seconds from the last row of `data`: before it they are negative.
        """
        promise = self._promised.get(point)
        try:
            table = self._table(data)
            last_s = float(table["t_s"].iloc[-1])
            known = replace(
                flown, start_s=last_s + flown.start_s, input_end_s=last_s + flown.input_end_s,
                end_s=last_s + min(flown.end_s, 0.0),
            )  # fmt: skip
            drawn = drawn_rows(table, point, self._response, known.start_s - BEFORE_S)
        except HostError:
            return PointEstimate(promise.widths if promise else ())
        if promise is None:
            return PointEstimate((), self._widths(point, drawn.by_curves, known, None))
        return PointEstimate(
            promise.widths,
            self._widths(point, drawn.by_curves, known, None),
            self._widths(point, drawn.by_motion, known, promise.noise),
        )

    def _widths(
        self,
        point: Segment,
        table: pd.DataFrame,
        known: DetectedManeuver,
        noise: ResidualSpectra | None,
    ) -> dict[str, FlightWidth]:
        """Return half-widths; none where too little arrived, or nothing moved."""
        try:
            return identify_single_point(point, table, self._card.aircraft, known, noise).widths
        except HostError:
            return {}

    def _table(self, data: bytes) -> pd.DataFrame:
        with tempfile.TemporaryDirectory(prefix="host-point-") as folder:
            recording, text = Path(folder) / "last.radio", Path(folder) / "calibration.toml"
            recording.write_bytes(data)
            text.write_text(self._calibration, encoding="utf-8")
            return read_log(recording, calibration=text).table()


def _promised(card: Card, point: Segment) -> PointPromise | None:
    """Return the promise; None where it cannot be flown through the recorder, as a log is."""
    gusts = card.air.turbulence_mps or LIGHT_GUSTS_MPS
    try:
        found = promise_points(single_point_card(card, point), gusts, flights=PROMISE_FLIGHTS)
    except HostError:
        return None
    whole = [
        p for p in found if p.recorded and {w.name for w in p.widths} == {*point_derivatives(point)}
    ]
    return whole[0] if whole else None

"""Waits for test points in the stream, has each judged when it is over, and knows what is next."""

from __future__ import annotations

import itertools
from collections import deque
from collections.abc import Callable, Mapping
from typing import Any

from host.aircraft.linear_aircraft import load
from host.live.live_sample import LiveUpdate
from host.live.test_point.card_progress import CardPoint, CardProgress
from host.live.test_point.finished_input import finished_inputs
from host.live.test_point.point_measures import measure
from host.live.test_point.point_verdict import judge_point
from host.live.test_point.recent_flight import RecentFlight
from host.live.test_point.weak_input import weak_input
from host.planning.aircraft_response import AircraftResponse
from host.planning.next_point import INPUT_NAMES
from host.planning.predicted_widths import LIGHT_GUSTS_MPS
from host.planning.wanted_input import RESPONSE_S
from host.sysid.flight.maneuver_detection import FLYING_SHARE, DetectedManeuver
from host.twin.testcard.cards import Card

LOOKED_S = 0.5  # of the stream between two looks: a verdict is that late at most
EARLY_S, LATE_S = 1.5, 6.0  # of an input, against the countdown
_SHOWN = 8


class PointWatch:
    """Judges test points as they end; `hear` is a consumer of the stream.

    Parameters
    ----------
    card : Card
        What is flown; its aircraft is the one whose modes count.
    judged : callable, optional
        Called with each verdict.

    Raises
    ------
    AircraftError, TrimError
        The card's aircraft cannot be read or trimmed.
    """

    def __init__(
        self, card: Card, judged: Callable[[Mapping[str, Any]], None] | None = None
    ) -> None:
        aircraft = load(card.aircraft)
        speed = card.flight.airspeed_mps or aircraft.scalar("trim.airspeed_mps")
        self.title = card.title
        self.progress = CardProgress(card)
        self.verdicts: deque[dict[str, Any]] = deque(maxlen=_SHOWN)
        self._response = AircraftResponse(aircraft, speed, card.flight.height_m)
        self._gusts_mps = card.air.turbulence_mps or LIGHT_GUSTS_MPS
        self._recent = RecentFlight()
        self._looked_s = self._since_s = float("-inf")
        self._number = itertools.count(1)
        self._told = judged

    def take(self, data: bytes) -> None:
        """Not the bytes: `hear` takes what the stream makes of them."""

    def tick(self) -> None:
        """Nothing to do."""

    def hear(self, update: LiveUpdate) -> None:
        """Take rows; judge what has come to its end."""
        self._recent.add(update)
        now_s = self._recent.now_s
        if not len(update) or 0.0 <= now_s - self._looked_s < LOOKED_S:
            return
        if now_s < self._looked_s:
            self._since_s = float("-inf")
        self._looked_s = now_s
        speed = self._recent.airspeed_mps
        point = self.progress.next
        if not speed > FLYING_SHARE * self._response.airspeed_mps or point is None:
            return
        self.progress.airborne(now_s)
        columns = self._recent.columns()
        wanted, speed = point.segment, self._response.airspeed_mps
        for item in finished_inputs(columns, wanted, speed, self._since_s)[:1]:
            self._judge(columns, item, point, now_s)
            return
        if columns and self.progress.due_s is not None:
            due_s = self.progress.due_s
            first_s = max(due_s - EARLY_S, self._since_s)
            weak = weak_input(columns, wanted, self._response, (first_s, due_s + LATE_S))
            if weak is not None:
                self._judge(columns, weak, point, now_s)

    def _judge(
        self, columns: dict[str, Any], item: DetectedManeuver, point: CardPoint, now_s: float
    ) -> None:
        measures = measure(
            columns, item, point.segment, self._response, self._gusts_mps, self._since_s
        )
        verdict = judge_point(measures, point.segment)
        shape = INPUT_NAMES.get(item.kind, item.kind)
        self._since_s = item.input_end_s + RESPONSE_S
        self.verdicts.append(
            {
                "number": next(self._number),
                "point": point.number,
                "what": point.text,
                "flown": f"{item.axis.removesuffix('_rad')} {shape}",
                "start_s": round(item.start_s, 2),
                "end_s": round(item.input_end_s + RESPONSE_S, 2),
                "said_s": round(now_s, 2),
                "good": verdict.good,
                "score": verdict.score,
                "text": verdict.text,
                "remarks": list(verdict.remarks),
            }
        )
        if self._told is not None:
            self._told(self.verdicts[-1])
        self.progress.judged(item.input_end_s + RESPONSE_S, good=verdict.good)

    def as_json(self) -> dict[str, Any]:
        """Return the last verdicts and what is next."""
        return {
            "card": self.title,
            "verdicts": list(self.verdicts),
            "next": self.progress.as_json(self._recent.now_s),
        }

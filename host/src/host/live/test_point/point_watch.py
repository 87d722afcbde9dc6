"""Waits for test points in the stream, has each judged when it is over, and knows what is next.

A point that is over is estimated somewhere else first, from the bytes of the last seconds; where no
answer comes in time its movement alone is judged.
"""

from __future__ import annotations

import itertools
import math
import time
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any, Protocol

from host.live.live_sample import LiveUpdate
from host.live.test_point.card_progress import CardPoint, CardProgress
from host.live.test_point.finished_input import finished_inputs
from host.live.test_point.point_estimate import PointEstimate
from host.live.test_point.point_measures import PointMeasures, measure
from host.live.test_point.point_verdict import judge_point
from host.live.test_point.recent_flight import KEPT_S, RecentFlight
from host.live.test_point.weak_input import weak_input
from host.planning.aircraft_response import card_response
from host.planning.next_point import INPUT_NAMES
from host.planning.predicted_widths import LIGHT_GUSTS_MPS
from host.planning.wanted_input import RESPONSE_S
from host.sysid.maneuvers.maneuver_detection import FLYING_SHARE, DetectedManeuver
from host.twin.testcard.cards import Card, Segment

LOOKED_S = 0.5  # of the stream between two looks: a verdict is that late at most
EARLY_S, LATE_S = 1.5, 6.0  # of an input, against the countdown
ANSWER_S = 1.0  # of the computer's clock: an estimate takes a fifth of it
AHEAD_S = 10.0  # a recording played fast is held here until the answer is there
MOST_BYTES = 1 << 17  # before a row has the time: more than the radio sends in `KEPT_S`
_SHOWN = 8


class EstimateSource(Protocol):
    """Who estimates a point, somewhere else."""

    def ask(self, point: Segment, data: bytes, flown: DetectedManeuver) -> None:
        """Ask what bytes say of a point; its input in seconds from their last row."""
        ...

    def answer(self, timeout_s: float = 0.0) -> PointEstimate | None:
        """Return the answer if it is there."""
        ...

    def close(self) -> None:
        """End."""
        ...


@dataclass(slots=True)
class _Over:
    """A point that is over and waits for its estimate."""

    item: DetectedManeuver
    point: CardPoint
    measures: PointMeasures
    asked_s: float | None = None  # of the computer's clock

    @property
    def end_s(self) -> float:
        return self.item.input_end_s + RESPONSE_S


class PointWatch:
    """Judges test points as they end; `take` and `hear` are given the stream.

    Parameters
    ----------
    card : Card
        What is flown; its aircraft is the one whose modes count.
    judged : callable, optional
        Called with each verdict.
    estimates : EstimateSource, optional
        Without, movement alone is judged.
    clock : callable
        The computer's, s.

    Raises
    ------
    AircraftError, TrimError
        The card's aircraft cannot be read or trimmed.
    """

    def __init__(
        self,
        card: Card,
        judged: Callable[[Mapping[str, Any]], None] | None = None,
        estimates: EstimateSource | None = None,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self.title = card.title
        self.progress = CardProgress(card)
        self.verdicts: deque[dict[str, Any]] = deque(maxlen=_SHOWN)
        self._response = card_response(card)
        self._gusts_mps = card.air.turbulence_mps or LIGHT_GUSTS_MPS
        self._recent = RecentFlight()
        self._looked_s = self._since_s = float("-inf")
        self._number = itertools.count(1)
        self._on_verdict, self._estimates, self._clock = judged, estimates, clock
        self._over: _Over | None = None
        self._bytes: deque[tuple[float, bytes]] = deque()

    def take(self, data: bytes) -> None:
        """Take bytes of the stream, behind `hear`: an estimate is made of the last seconds."""
        now_s = self._recent.now_s
        if self._bytes and math.isnan(self._bytes[-1][0]):  # the schema came later than its rows
            data = (self._bytes.pop()[1] + data)[-MOST_BYTES:]
        self._bytes.append((now_s, data))
        while not 0.0 <= now_s - self._bytes[0][0] < KEPT_S and len(self._bytes) > 1:
            self._bytes.popleft()
        over = self._over
        if over is not None and over.asked_s is None and self._estimates is not None:
            over.asked_s = self._clock()
            flown = replace(
                over.item, start_s=over.item.start_s - now_s,
                input_end_s=over.item.input_end_s - now_s, end_s=over.end_s - now_s,
            )  # fmt: skip
            self._estimates.ask(over.point.segment, b"".join(d for _, d in self._bytes), flown)

    def tick(self) -> None:
        """Give the verdict that an estimate was waited for."""
        self._settle(self._recent.now_s)

    def close(self) -> None:
        """End who estimates."""
        if self._estimates is not None:
            self._estimates.close()

    def hear(self, update: LiveUpdate) -> None:
        """Take rows; judge what has come to its end."""
        self._recent.add(update)
        now_s = self._recent.now_s
        if self._over is not None:
            self._settle(now_s)
            return
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
            self._ended(columns, item, point)
            return
        if columns and self.progress.due_s is not None:
            due_s = self.progress.due_s
            first_s = max(due_s - EARLY_S, self._since_s)
            weak = weak_input(columns, wanted, self._response, (first_s, due_s + LATE_S))
            if weak is not None:
                self._ended(columns, weak, point)

    def _ended(self, columns: dict[str, Any], item: DetectedManeuver, point: CardPoint) -> None:
        """Measure a point that is over; it is judged with its estimate, or without one at once."""
        measures = measure(
            columns, item, point.segment, self._response, self._gusts_mps, self._since_s
        )
        self._over = _Over(item, point, measures)
        if self._estimates is None:
            self._judge(self._over, PointEstimate())

    def _settle(self, now_s: float) -> None:
        """Judge the point that waits, with its estimate or when that has taken too long."""
        over = self._over
        if over is None or over.asked_s is None or self._estimates is None:
            return
        left_s = ANSWER_S - (self._clock() - over.asked_s)
        far = now_s - over.end_s > AHEAD_S
        estimate = self._estimates.answer(max(left_s, 0.0) if far else 0.0)
        if estimate is not None or left_s <= 0.0:
            self._judge(over, estimate or PointEstimate())

    def _judge(self, over: _Over, estimate: PointEstimate) -> None:
        item, point = over.item, over.point
        verdict = judge_point(over.measures, point.segment, estimate)
        shape = INPUT_NAMES.get(item.kind, item.kind)
        self._over, self._since_s = None, over.end_s
        self.verdicts.append(
            {
                "number": next(self._number),
                "point": point.number,
                "what": point.text,
                "flown": f"{item.axis.removesuffix('_rad')} {shape}",
                "start_s": round(item.start_s, 2),
                "end_s": round(over.end_s, 2),
                "said_s": round(self._recent.now_s, 2),
                "good": verdict.good,
                "score": verdict.score,
                "estimated": verdict.estimated,
                "text": verdict.text,
                "remarks": list(verdict.remarks),
            }
        )
        if self._on_verdict is not None:
            self._on_verdict(self.verdicts[-1])
        self.progress.judged(over.end_s, good=verdict.good)

    def as_json(self) -> dict[str, Any]:
        """Return the last verdicts and what is next."""
        return {
            "card": self.title,
            "verdicts": list(self.verdicts),
            "next": self.progress.as_json(self._recent.now_s),
        }

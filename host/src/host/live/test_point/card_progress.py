"""What is next on the flight card, and when."""

from __future__ import annotations

from dataclasses import dataclass

from host.planning.next_point import INPUT_NAMES, in_words
from host.planning.point_widths import point_derivatives
from host.planning.wanted_input import RESPONSE_S
from host.twin.testcard.cards import Card, Segment, length_s, turns_home

AGAIN_S = 3.0  # more than before a new point: trim again, think


@dataclass(frozen=True, slots=True)
class CardPoint:
    """One test point of a card.

    Attributes
    ----------
    number : int
        From 1.
    segment : Segment
    gap_s : float
        From the end of what was before to its input.
    before : str
        What the card flies until then.
    """

    number: int
    segment: Segment
    gap_s: float
    before: str

    @property
    def text(self) -> str:
        """In the words of the knee board."""
        return in_words(self.segment)


def card_points(card: Card) -> list[CardPoint]:
    """Return the test points of a card that are judged, with what lies between them."""
    found: list[CardPoint] = []
    between: list[Segment] = []
    for s in card.segments:
        if s.kind in ("trim", "turn") or not point_derivatives(s):
            between.append(s)
            continue
        rest_s = sum(length_s(card, one) for one in between) + s.before_s
        if found:
            rest_s += card.pilot.hands_off_s - RESPONSE_S
        others = [_words(one) for one in between if one.kind != "trim"]
        found.append(CardPoint(len(found) + 1, s, max(rest_s, 0.0), ", ".join(others)))
        between = []
    return found


def _words(s: Segment) -> str:
    if turns_home(s):
        return "turn home"
    if s.kind == "turn":
        return f"turn of {s.duration_s:g} s"
    return f"{' and '.join(s.axes)} {INPUT_NAMES.get(s.kind, s.kind)}"


class CardProgress:
    """Where on the card the flight is.

    Parameters
    ----------
    card : Card
    """

    def __init__(self, card: Card) -> None:
        self.points = card_points(card)
        self._at = 0
        self.due_s: float | None = None  # when the next point's input is to begin

    @property
    def next(self) -> CardPoint | None:
        """The point that is to be flown; None behind the last."""
        return self.points[self._at] if self._at < len(self.points) else None

    def airborne(self, now_s: float) -> None:
        """Start the countdown of the first point."""
        if self.due_s is None and self.points:
            self.due_s = now_s + self.points[0].gap_s

    def judged(self, end_s: float, *, good: bool) -> None:
        """Go on to the next point, or to the same again, from the end of one."""
        self._at += good
        point = self.next
        if point is not None:
            again_s = point.segment.before_s + AGAIN_S
            self.due_s = end_s + (point.gap_s if good else again_s)

    def as_json(self, now_s: float) -> dict[str, object] | None:
        """Return what is next: number, of how many, words, seconds to go."""
        point = self.next
        if point is None:
            return None
        in_s = None if self.due_s is None else round(max(self.due_s - now_s, 0.0), 1)
        return {
            "number": point.number,
            "of": len(self.points),
            "text": point.text,
            "before": point.before,
            "in_s": in_s,
        }

"""The verdict of one test point: its measures in, a score and words for the pilot out.

The score is the half-width that the card promises over the one that is to be expected of what was
flown, 100 at best. Which flights fixed the constants: `studies/point_verdicts.md`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from host.live.test_point.point_measures import PointMeasures
from host.twin.testcard.cards import Segment

GOOD = 77  # 1.3 times the promised half-width
# Share of a promised variance that the movement makes smaller; tolerances are the rest of it, and
# more of it the longer an input is.
NOISE_SHARE = {
    ("elevator", "3211"): 0.17, ("elevator", "doublet"): 0.23,
    ("aileron", "doublet"): 0.38, ("rudder", "doublet"): 0.15,
}  # fmt: skip
OTHER_SHARE = 0.3
WEAK, LOUD = 0.7, 1.5  # of the wanted amplitude
SHORT, LONG = 0.75, 1.35  # of the wanted length
ROUND = 1.25  # times the card's deviation: what there is to say where nothing else is wrong
NOTHING_TOLD = 5.0  # times the promised
LEAST_EDGE = 1.15  # of what `host maneuvers` takes for an input: below, nobody finds it afterwards
UNQUIET = 0.25
OTHERS = 0.5
CORRECTED, CORRECTED_MUCH = 0.6, 1.0
OFF_SPEED, SPEED_CHANGE = 0.12, 0.6
GUSTY = {"elevator": 2.0, "aileron": 2.0, "rudder": 2.7}  # times the card's
LOST = 0.25


@dataclass(frozen=True, slots=True)
class PointVerdict:
    """What is said of a test point.

    Attributes
    ----------
    score : int
        0 to 100; `GOOD` and more is good.
    remarks : tuple of str
        What is wrong, the worst first.
    """

    score: int
    remarks: tuple[str, ...]

    @property
    def good(self) -> bool:
        """Whether the point need not be flown again."""
        return self.score >= GOOD

    @property
    def text(self) -> str:
        """Such as ``good 86`` or ``repeat: amplitude 40 % of what is wanted``."""
        if self.good:
            return f"good {self.score}"
        return "repeat: " + "; ".join(self.remarks[:2] or (f"{self.score} of 100",))


def judge_point(measures: PointMeasures, wanted: Segment) -> PointVerdict:
    """Judge one test point.

    Parameters
    ----------
    measures : PointMeasures
    wanted : Segment
        The card's.
    """
    score = round(min(100.0, 100.0 / expected_width(measures, wanted)))
    return PointVerdict(score, _remarks(measures, wanted))


def expected_width(m: PointMeasures, wanted: Segment) -> float:
    """Return the half-width to expect over the promised one.

    The information of the movement counts as far as noise does. What the linear model does not see
    is a factor: a pilot or a gust moves the aircraft besides.
    """
    if not m.axis_wanted or m.edge < LEAST_EDGE:
        return NOTHING_TOLD
    shares = [NOISE_SHARE.get((axis, wanted.kind), OTHER_SHARE) for axis in wanted.axes]
    deviation = float(np.exp(np.mean(np.log(np.maximum(m.deviations, 1.0)))))
    width = math.sqrt(1.0 + max(shares) * (deviation**2 - 1.0))
    for value, limit in (
        (m.corrected, CORRECTED_MUCH),
        (m.gusts, _gusty(wanted)),
        (m.airspeed_change, SPEED_CHANGE),
    ):
        width *= max(1.0, value / limit)
    return width


def _gusty(wanted: Segment) -> float:
    return min(GUSTY.get(axis, GUSTY["elevator"]) for axis in wanted.axes)


def _remarks(m: PointMeasures, wanted: Segment) -> tuple[str, ...]:
    """Return words for everything that is out of its range."""
    axes = " and ".join(wanted.axes)
    if not m.axis_wanted:
        return (f"{m.axis} moved, {axes} is wanted",)
    said = []
    if m.amplitude < WEAK or m.edge < LEAST_EDGE:
        said.append(f"amplitude {100 * m.amplitude:.0f} % of what is wanted")
    if m.length < SHORT:
        said.append("hold longer" if m.length > 0.5 else "broken off: fly all of its steps")
    if m.length > LONG:
        said.append(f"{100 * (m.length - 1):.0f} % too long: shorter steps")
    if m.corrected > CORRECTED:
        said.append("corrected too early: hands off until the response is over")
    if m.others > OTHERS:
        said.append(f"another surface moved {100 * m.others:.0f} % of the input")
    if m.unquiet > UNQUIET:
        said.append("not trimmed before: wait for quiet")
    if abs(m.airspeed) > OFF_SPEED:
        said.append(f"airspeed {100 * m.airspeed:+.0f} % off the card's")
    if m.airspeed_change > SPEED_CHANGE:
        said.append("airspeed not kept")
    if m.gusts > _gusty(wanted):
        said.append(f"gusts {m.gusts:.1f} times the card's: wait for calm air")
    if m.lost > LOST:
        said.append(f"{100 * m.lost:.0f} % of it not received")
    if m.amplitude > LOUD:
        said.append(f"amplitude {100 * m.amplitude:.0f} % of what is wanted")
    if not said and float(np.mean(m.deviations)) > ROUND:
        said.append("its steps are rounder or shorter than the card's")
    return tuple(said)

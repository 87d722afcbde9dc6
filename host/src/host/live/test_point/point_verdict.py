"""The verdict of one test point: its measures in, a score and words for the pilot out.

The score is the half-width that the card promises over the one that is to be expected of what was
flown, 100 at best. The movement of the surfaces tells what to expect, and an estimate from the rows
that the radio brought: weighted by the residuals of the promise, for those of one point scatter; in
gusts, which the promise knows nothing of, by its own. Their mean counts; where there is no
estimate, the movement alone. Which flights fixed the constants: `studies/point_verdicts.md`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from host.arrays import Array
from host.live.test_point.point_estimate import PointEstimate
from host.live.test_point.point_measures import PointMeasures
from host.planning.point_widths import point_derivatives
from host.planning.predicted_widths import FlightWidth, PredictedWidth
from host.twin.testcard.cards import Segment

GOOD = 77  # 1.3 times the promised half-width
# Share of a promised variance that the movement makes smaller; tolerances are the rest of it, and
# more of it the longer an input is.
NOISE_SHARE = {
    ("elevator", "3211"): 0.17, ("elevator", "doublet"): 0.23,
    ("aileron", "doublet"): 0.38, ("rudder", "doublet"): 0.15,
}  # fmt: skip
OTHER_SHARE = 0.3
# Where the promise is known, so are its shares. It was flown by a pilot too, whose edges tell less
# than the card's (medians of faultless points); gusts count from a little more than the card's on.
PILOT = {"elevator": 1.16, "aileron": 1.12, "rudder": 1.09}  # times the card's deviation
LEAST_DEVIATION = 0.8
CALM, GUSTS_POWER = 1.4, 0.9
# Weight of the estimate in the logarithm, the movement has the rest: in calm air by the residuals
# of the promise, in gusts by its own, of which two flights of one point differ by a quarter.
CALM_SHARE, GUSTS_SHARE = 0.6, 0.3
# The expected half-width scatters about the true one: of points expected at 1.35 times the promise
# as many are within 1.3 as are not (353 verdicts; seeds 14000-14259 say 1.36, 16300-16559 1.34).
EVEN_ODDS = 1.03
LEAST_OF_MOVED = 0.5  # no rows tell so much more than their movement: such a fit ran away
WEAK, LOUD = 0.7, 1.5  # of the wanted amplitude
SHORT, LONG = 0.75, 1.35  # of the wanted length
ROUND = 1.25  # times the card's deviation: what there is to say where nothing else is wrong
UNDETERMINED_RATIO = 5.0  # times the promised
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
    estimated : bool
        False where movement alone was judged.
    """

    score: int
    remarks: tuple[str, ...]
    estimated: bool = False

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


def judge_point(
    measures: PointMeasures, wanted: Segment, estimate: PointEstimate | None = None
) -> PointVerdict:
    """Judge one test point.

    Parameters
    ----------
    measures : PointMeasures
    wanted : Segment
        The card's.
    estimate : PointEstimate, optional
        Its promise and what the radio's rows tell.
    """
    estimate = estimate or PointEstimate()
    moved = moved_width(measures, wanted, estimate)
    estimated = None
    if moved < UNDETERMINED_RATIO:
        estimated = estimated_width(measures, wanted, estimate, moved)
    width = moved if estimated is None else estimated
    score = round(min(100.0, 100.0 / width))
    said = _remarks(measures, wanted)
    if not said and estimated is not None and score < GOOD:
        said = (f"half-widths {width:.1f} times the promised ones",)
    return PointVerdict(score, said, estimated is not None)


def moved_width(m: PointMeasures, wanted: Segment, estimate: PointEstimate) -> float:
    """Return the half-width to expect of the movement over the promised one, geometric mean.

    The information of the movement counts as far as noise does: tolerances stay. What the linear
    model does not see is a factor: a pilot or a gust moves the aircraft besides.
    """
    if not m.axis_wanted or m.edge < LEAST_EDGE:
        return UNDETERMINED_RATIO
    shares = _noise_shares(wanted, estimate)
    factors = [(m.corrected, CORRECTED_MUCH), (m.airspeed_change, SPEED_CHANGE)]
    if estimate.promised:
        noise = np.maximum(m.deviations / _of_axes(PILOT, wanted), LEAST_DEVIATION)
        noise *= max(1.0, m.gusts / CALM) ** GUSTS_POWER
    else:
        factors.append((m.gusts, _of_axes(GUSTY, wanted)))
        mean = np.exp(np.mean(np.log(np.maximum(m.deviations, 1.0))))
        noise = np.full(len(shares), mean)
    width = math.exp(0.5 * float(np.mean(np.log(1.0 + shares * (noise**2 - 1.0)))))
    for value, limit in factors:
        width *= max(1.0, value / limit)
    return width


def estimated_width(
    m: PointMeasures, wanted: Segment, estimate: PointEstimate, moved: float
) -> float | None:
    """Return the half-width to expect by estimate and movement over the promised one.

    None where there is no promise, or no estimate to believe.

    Parameters
    ----------
    m : PointMeasures
    wanted : Segment
    estimate : PointEstimate
    moved : float
        Width by `moved_width`.
    """
    widths, share = estimate.expected, CALM_SHARE
    if m.gusts > CALM:
        widths, share = estimate.measured, GUSTS_SHARE
    ratio = _mean_ratio(wanted, estimate.promised, widths)
    if ratio is None or math.exp(ratio) < LEAST_OF_MOVED * moved:
        return None
    return math.exp(share * ratio + (1.0 - share) * math.log(moved)) / EVEN_ODDS


def _mean_ratio(
    wanted: Segment, promised: Sequence[PredictedWidth], widths: Mapping[str, FlightWidth]
) -> float | None:
    """Return the mean logarithm of half-widths over the promised ones; None where one lacks."""
    own = {w.name: w.half_width for w in promised}
    names = point_derivatives(wanted)
    if not names or not all(n in own and n in widths for n in names):
        return None
    return float(np.mean([math.log(widths[n].half_width / own[n]) for n in names]))


def _noise_shares(wanted: Segment, estimate: PointEstimate) -> Array:
    """Return the share of noise in the promised variance of each derivative of the point."""
    shares = {w.name: w.noise_share for w in estimate.promised}
    names = point_derivatives(wanted)
    if shares and all(name in shares for name in names):
        return np.array([shares[name] for name in names])
    usual = [NOISE_SHARE.get((axis, wanted.kind), OTHER_SHARE) for axis in wanted.axes]
    return np.full(len(names), max(usual))


def _of_axes(limits: Mapping[str, float], wanted: Segment) -> float:
    """Return the least of the point's axes."""
    return min(limits.get(axis, limits["elevator"]) for axis in wanted.axes)


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
    if m.gusts > _of_axes(GUSTY, wanted):
        said.append(f"gusts {m.gusts:.1f} times the card's: wait for calm air")
    if m.lost > LOST:
        said.append(f"{100 * m.lost:.0f} % of it not received")
    if m.amplitude > LOUD:
        said.append(f"amplitude {100 * m.amplitude:.0f} % of what is wanted")
    if not said and float(np.mean(m.deviations)) > ROUND:
        said.append("its steps are rounder or shorter than the card's")
    return tuple(said)

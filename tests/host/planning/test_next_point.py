"""The next test point: the axis that is missing, and what takes most of the excess in a second."""

from __future__ import annotations

import pytest
from host.aircraft.linear_aircraft import load
from host.planning.next_point import KnownWidth, NextPoints, in_words
from host.planning.optimal_card import standard_card
from host.twin.testcard.cards import Segment

WANTED = {"Cm_alpha": 10.0, "Cm_q": 20.0, "Cl_p": 15.0, "Cl_da": 15.0, "Cn_r": 20.0}


@pytest.fixture(scope="module")
def points() -> NextPoints:
    return NextPoints(load("ultrastick25e"))


def known(**percent: float) -> dict[str, KnownWidth]:
    """Return widths of which 5 % are tolerance; what is not named is known well."""
    found = {name: KnownWidth(0.9 * wanted, 5.0) for name, wanted in WANTED.items()}
    return found | {name: KnownWidth(value, 5.0) for name, value in percent.items()}


def flown(points: NextPoints) -> list[Segment]:
    """Return one 3-2-1-1 on each axis."""
    return [
        next(s for s in points.candidates if s.axes == (axis,) and s.kind == "3211")
        for axis in ("elevator", "aileron", "rudder")
    ]


def test_a_flight_that_told_nothing_yet_begins_with_every_axis_once(points: NextPoints) -> None:
    first = points.best({}, (), WANTED)
    assert first is not None
    assert (first.segment.axes, first.points) == (("elevator",), 3)
    assert set(first.wanting) == set(WANTED)
    known_widths = {"Cm_alpha": KnownWidth(9.0, 5.0), "Cm_q": KnownWidth(30.0, 5.0)}
    second = points.best(known_widths, [first.segment], WANTED)
    assert second is not None
    assert second.segment.axes == ("aileron",)
    assert second.points > 2  # rudder, and the elevator again


@pytest.mark.parametrize(
    ("missing", "axis"), [("Cm_q", "elevator"), ("Cl_p", "aileron"), ("Cl_da", "aileron")]
)
def test_the_axis_of_what_is_missing_is_flown(points: NextPoints, missing: str, axis: str) -> None:
    best = points.best(known(**{missing: 24.0}), flown(points), WANTED)
    assert best is not None
    assert best.segment.axes == (axis,)
    assert best.wanting == (missing,)


def test_more_noise_needs_more_points(points: NextPoints) -> None:
    some = [points.best(known(Cm_q=p), flown(points), WANTED) for p in (22.0, 30.0, 45.0)]
    counts = [one.points for one in some if one is not None]
    assert counts == sorted(counts)
    assert counts[0] == 1
    assert counts[2] > 2


def test_nothing_is_flown_for_what_only_tolerances_leave_open(points: NextPoints) -> None:
    assert points.best(known(), flown(points), WANTED) is None
    wide = known() | {"Cm_alpha": KnownWidth(14.0, 12.0)}
    assert points.best(wide, flown(points), WANTED) is None


def test_other_coefficients_of_an_estimate_are_no_matter(points: NextPoints) -> None:
    known_widths = known() | {"CD_alpha2": KnownWidth(80.0, 1.0)}
    assert points.best(known_widths, flown(points), WANTED) is None


def test_points_keep_the_excursions_of_the_standard_card(points: NextPoints) -> None:
    standard = {s.axes[0]: s for s in standard_card(load("ultrastick25e")).segments if s.axes}
    for s in flown(points):
        # In tenths of a degree, of a card whose points are flown one behind the other.
        assert s.amplitudes[0] == pytest.approx(standard[s.axes[0]].amplitudes[0], rel=0.1)
    assert in_words(points.candidates[0]).startswith("elevator 3-2-1-1, 3.2 deg, steps of 0.2 s")

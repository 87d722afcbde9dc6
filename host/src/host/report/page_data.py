"""Which samples of a flight a page holds: an overview, test points whole, within a size."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from host.report.channel_list import Channel
from host.report.overview import buckets, min_max
from host.report.packing import Packed, pack
from host.report.shown_flight import ShownFlight

AROUND_S = 5.0  # before and behind a test point
OVERVIEW_BUCKETS = 4000  # two points each: more than any screen has columns
OVERVIEW_BYTES = 2_600_000  # of the page; script and text are the rest of 3 MB
PAGE_BYTES = 9_400_000  # of all samples; script, text and track are the rest of 10 MB
# A stretch is not even packed if at this share of the fewest bytes a row it would be too large.
SURELY = 0.7
_ROWS_AT_ONCE = 1 << 18  # of a stretch


@dataclass(frozen=True, slots=True)
class PageData:
    """Packed samples and what was left out.

    Attributes
    ----------
    overview : Packed
    stretches : list of Packed
        Every sample of some spans of time.
    whole : bool
        Whether every sample of the flight is there.
    remarks : list of str
        Remarks on what was left out.
    """

    overview: Packed
    stretches: list[Packed]
    whole: bool
    remarks: list[str]


def page_data(flight: ShownFlight, channels: list[Channel], *, full: bool = False) -> PageData:
    """Return the samples a page holds.

    Parameters
    ----------
    flight : ShownFlight
    channels : list of Channel
    full : bool
        Every sample, whatever the size.
    """
    t_s = flight.t_s
    values = [one.values for one in channels]
    overview, points = _overview(t_s, values)
    if len(points) == len(t_s):
        return PageData(overview, [], True, [])
    if len(t_s) * len(values) <= OVERVIEW_BYTES:  # a value takes 1 to 2 bytes
        every = _cut(t_s, values, (0, len(t_s)))
        if len(overview) + len(every) <= OVERVIEW_BYTES:
            return PageData(overview, [every], True, [])
    if full:
        cuts = range(0, len(t_s), _ROWS_AT_ONCE)
        spans = [(first, min(first + _ROWS_AT_ONCE, len(t_s))) for first in cuts]
        return PageData(overview, [_cut(t_s, values, one) for one in spans], True, [])
    spans = _spans(flight)
    stretches: list[Packed] = []
    left_out: list[tuple[float, float]] = []
    room = PAGE_BYTES - len(overview)
    smallest = 0.0  # bytes a row of the stretches packed so far
    for first, last in spans:
        packed = None
        if SURELY * smallest * (last - first) <= room:
            packed = _cut(t_s, values, (first, last))
            smallest = min(smallest or np.inf, len(packed) / (last - first))
        if packed is None or len(packed) > room:
            left_out.append((float(t_s[first]), float(t_s[last - 1])))
        else:
            room -= len(packed)
            stretches.append(packed)
    return PageData(overview, stretches, False, _remarks(flight, stretches, left_out))


def _overview(t_s: Any, values: list[Any]) -> tuple[Packed, Any]:
    if len(t_s) <= 2 * OVERVIEW_BUCKETS:
        packed = pack(t_s, values)
        if len(packed) <= OVERVIEW_BYTES:
            return packed, t_s
    count = OVERVIEW_BUCKETS
    while True:
        own = buckets(t_s, count)
        packed = pack(own.t_s, [min_max(one, own) for one in values])
        if len(packed) <= OVERVIEW_BYTES or count <= 100:
            return packed, own.t_s
        count //= 2


def _spans(flight: ShownFlight) -> list[tuple[int, int]]:
    """Return rows of each test point and what is around it, without those of the one before."""
    t_s = flight.t_s
    found: list[tuple[int, int]] = []
    for item, _ in sorted(flight.maneuvers, key=lambda pair: pair[0].start_s):
        span = (item.start_s - AROUND_S, item.end_s + AROUND_S)
        first, last = (int(one) for one in np.searchsorted(t_s, span))
        first = max(first, found[-1][1]) if found else first
        if last > first:
            found.append((first, last))
    return found


def _cut(t_s: Any, values: list[Any], span: tuple[int, int]) -> Packed:
    first, last = span
    return pack(t_s[first:last], [one[first:last] for one in values])


def _remarks(
    flight: ShownFlight, kept: list[Packed], left_out: list[tuple[float, float]]
) -> list[str]:
    t_s = flight.t_s
    rows = sum(one.head["rows"] for one in kept)
    share = rows / max(1, len(t_s))
    said = [
        f"Every sample of {len(kept)} stretches (test points and {AROUND_S:.0f} s around them,"
        f" {share:.0%} of the flight's {len(t_s)} rows) is in this page. Of the rest it holds the"
        f" smallest and largest value of every {float(t_s[-1] - t_s[0]) / OVERVIEW_BUCKETS:.2g} s:"
        " the samples between are left out (host plot --full embeds all)."
    ]
    if not flight.maneuvers:
        said = [
            "No test point was found: this page holds the smallest and largest value of every"
            f" {float(t_s[-1] - t_s[0]) / OVERVIEW_BUCKETS:.2g} s; the samples between are left out"
            " (host plot --full embeds all)."
        ]
    if left_out:
        said.append(
            f"LEFT OUT for the page's size of 10 MB: samples of {len(left_out)} more test points"
            f" ({', '.join(f'{first:.0f} to {last:.0f} s' for first, last in left_out[:12])}"
            f"{', ...' if len(left_out) > 12 else ''}); only their smallest and largest values are"
            " shown."
        )
    return said

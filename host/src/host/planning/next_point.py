"""What to fly next: the test point that brings the wanted half-widths soonest.

A half-width has two parts. Tolerances of instrument and aircraft stay, whatever is flown; noise
and gusts leave the other, which shrinks with information. How much information a point adds is
known before it is flown, from the aircraft file's linear model (`aircraft_response`); how much
noise there is, the estimate of what was flown says. So the width after one more point is that
noise, times the ratio of two deviations, with the tolerance. The point that takes most of the
excess over the wanted widths in a second of flight is the next one.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from host.aircraft.file import Aircraft
from host.arrays import Array
from host.planning.aircraft_response import AircraftResponse, deviations
from host.planning.card_design import mode_widths_s
from host.planning.optimal_card import limited_points
from host.planning.wanted_input import wanted_surfaces
from host.twin.testcard.cards import Card, Segment, length_s

AXES = ("elevator", "aileron", "rudder")
KINDS = {"3211": (1.0,), "doublet": (1.0, 1.7)}  # units of `mode_widths_s`
MOST_AHEAD = 12  # points looked ahead
INPUT_NAMES = {"3211": "3-2-1-1"}
# Which axis informs a derivative that nothing is known of yet.
EXCITING_AXIS = {
    "CL_alpha": "elevator", "Cm_alpha": "elevator", "Cm_q": "elevator", "Cm_de": "elevator",
    "Cl_p": "aileron", "Cl_da": "aileron",
    "Cn_beta": "rudder", "Cn_r": "rudder", "Cn_dr": "rudder",
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class KnownWidth:
    """A derivative as far as it is known.

    Attributes
    ----------
    percent : float
        95 % half-width, per cent of the value.
    tolerance_percent : float
        The part of it that no point makes smaller.
    """

    percent: float
    tolerance_percent: float

    @property
    def noise_percent(self) -> float:
        """The part that more points make smaller."""
        return math.sqrt(max(self.percent**2 - self.tolerance_percent**2, 0.0))


@dataclass(frozen=True, slots=True)
class NextPoint:
    """The test point to fly next, and what is left behind it.

    Attributes
    ----------
    segment : Segment
    wanting : tuple of str
        Derivatives that are not known well enough yet.
    points : int
        To be flown until they are, this one with them; as far as one can tell now.
    seconds : float
        They take, trim and response with them.
    """

    segment: Segment
    wanting: tuple[str, ...]
    points: int
    seconds: float


def in_words(s: Segment) -> str:
    """Return a test point in the words of the knee board."""
    sizes = "/".join(f"{a:g}" for a in s.amplitudes)
    unit = "" if "throttle" in s.axes else " deg"
    length = f", steps of {s.width_s:g} s" if s.width_s else f", {s.duration_s:g} s"
    return f"{' and '.join(s.axes)} {INPUT_NAMES.get(s.kind, s.kind)}, {sizes}{unit}{length}"


class NextPoints:
    """Chooses test points for one aircraft.

    Parameters
    ----------
    aircraft : Aircraft
    airspeed_mps : float
        0: the aircraft file's.

    Raises
    ------
    TrimError
        It cannot be trimmed there.
    """

    def __init__(self, aircraft: Aircraft, airspeed_mps: float = 0.0) -> None:
        speed = airspeed_mps or aircraft.scalar("trim.airspeed_mps")
        self._response = AircraftResponse(aircraft, speed)
        self._card = Card(name="next", title="", aircraft=aircraft.name, segments=())
        self._information_of: dict[Segment, dict[str, Array]] = {}
        limited = limited_points(aircraft, speed, _shapes(aircraft, speed))
        self.candidates = [_for_a_hand(s) for s in limited]

    def best(
        self,
        known: Mapping[str, KnownWidth],
        flown: Sequence[Segment],
        wanted_percent: Mapping[str, float],
    ) -> NextPoint | None:
        """Return the point to fly next; None where no more points are needed, or would help.

        Parameters
        ----------
        known : mapping
            Relative half-widths of the derivatives that an estimate tells.
        flown : sequence of Segment
            What that estimate is made of.
        wanted_percent : mapping of str to float
        """
        known = {name: width for name, width in known.items() if name in wanted_percent}
        unknown = [name for name in wanted_percent if name not in known]
        wanting = unknown + [
            name
            for name, width in known.items()
            if width.tolerance_percent < wanted_percent[name] < width.percent
        ]
        if not wanting:
            return None
        matrices = [self._information(s) for s in flown]
        noise = self._noise_of_a_point(known, matrices)
        ahead: list[Segment] = []
        while len(ahead) < MOST_AHEAD:
            excess = self._excess(known, noise, matrices, wanted_percent, wanting)
            if excess <= 0.0 and not self._axes_left(unknown, ahead):
                break
            ahead.append(self._choose(known, noise, matrices, wanted_percent, wanting, ahead))
            matrices.append(self._information(ahead[-1]))
        if not ahead:
            return None
        seconds = sum(self._length_s(s) for s in ahead)
        return NextPoint(ahead[0], tuple(wanting), len(ahead), seconds)

    def _choose(
        self,
        known: Mapping[str, KnownWidth],
        noise: Mapping[str, float],
        matrices: Sequence[dict[str, Array]],
        wanted: Mapping[str, float],
        wanting: Sequence[str],
        ahead: Sequence[Segment],
    ) -> Segment:
        """Return the candidate that takes most of the excess in a second."""
        left = self._axes_left([n for n in wanting if n not in known], ahead)
        some = [s for s in self.candidates if not left or s.axes[0] == left[0]]
        before = self._excess(known, noise, matrices, wanted, wanting)

        def gain(s: Segment) -> float:
            if left:  # nothing is known of it: the most information in a second
                own = [n for n in wanting if EXCITING_AXIS.get(n) == left[0]]
                size = deviations(own, self._information(s)) if own else np.ones(1)
                return -float(np.sum(np.log(size))) - 0.5 * len(size) * math.log(self._length_s(s))
            after = self._excess(known, noise, [*matrices, self._information(s)], wanted, wanting)
            return (before - after) / self._length_s(s)

        return max(some, key=gain)

    def _axes_left(self, unknown: Sequence[str], ahead: Sequence[Segment]) -> list[str]:
        """Return the axes whose derivatives nobody knows, and that no point ahead flies."""
        moved = {axis for s in ahead for axis in s.axes}
        needed = {EXCITING_AXIS.get(name, "") for name in unknown}
        return [axis for axis in AXES if axis in needed and axis not in moved]

    def _noise_of_a_point(
        self, known: Mapping[str, KnownWidth], matrices: Sequence[dict[str, Array]]
    ) -> dict[str, float]:
        """Return the noise of each known derivative for unit deviation, per cent."""
        if not matrices:
            return {}
        names = list(known)
        each = deviations(names, _sum(matrices))
        return {n: known[n].noise_percent / float(d) for n, d in zip(names, each, strict=True)}

    def _excess(
        self,
        known: Mapping[str, KnownWidth],
        noise: Mapping[str, float],
        matrices: Sequence[dict[str, Array]],
        wanted: Mapping[str, float],
        wanting: Sequence[str],
    ) -> float:
        """Return how far the widths are from the wanted ones: sum of logarithms."""
        names = [n for n in wanting if n in noise]
        if not names or not matrices:
            return 0.0
        each = deviations(names, _sum(matrices))
        widths = [math.hypot(noise[n] * d, known[n].tolerance_percent)
                  for n, d in zip(names, each, strict=True)]  # fmt: skip
        return sum(max(math.log(w / wanted[n]), 0.0) for n, w in zip(names, widths, strict=True))

    def _information(self, s: Segment) -> dict[str, Array]:
        if s not in self._information_of:
            surfaces = wanted_surfaces(s, self._response)
            self._information_of[s] = self._response.information(("CL", "Cm", "Cl", "Cn"), surfaces)
        return self._information_of[s]

    def _length_s(self, s: Segment) -> float:
        return float(length_s(self._card, s))


def _for_a_hand(s: Segment) -> Segment:
    """Return a point with amplitudes that a pilot can read: whole tenths of a degree."""
    return replace(s, amplitudes=tuple(max(math.floor(10.0 * a) / 10.0, 0.1) for a in s.amplitudes))


def _sum(matrices: Sequence[dict[str, Array]]) -> dict[str, Array]:
    return {row: np.sum([one[row] for one in matrices], axis=0) for row in matrices[0]}


def _shapes(aircraft: Aircraft, airspeed_mps: float) -> list[Segment]:
    """Return the inputs that a hand flies, on every axis."""
    return [
        Segment(kind, axes=(axis,), amplitudes=(3.0,), width_s=round(times * width, 2))
        for axis, width in mode_widths_s(aircraft, airspeed_mps).items()
        for kind, factors in KINDS.items()
        for times in factors
    ]

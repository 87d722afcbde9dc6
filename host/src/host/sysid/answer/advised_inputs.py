"""What to fly next: the surface, how far, how long and how often."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from host.aircraft.input_steps import ROLL_HALF_S, half_of_doublet_s, unit_of_3211_s
from host.aircraft.mode_names import DUTCH_ROLL, SHORT_PERIOD
from host.constants import CARE_SHARE, TRUST_SHARE
from host.sysid.answer.known_axes import MOVERS
from host.sysid.answer.parameter_words import GOOD, NOT, TINY, coefficient_of
from host.sysid.answer.summary_rows import SummaryRow

# Motion to the surface that moves it and the input that tells most of it.
INPUTS = {
    "pitch": ("elevator", "3-2-1-1"), "roll": ("aileron", "doublet"), "yaw": ("rudder", "doublet"),
    "speed and drag": ("elevator", "pulse"),
}  # fmt: skip
# What a derivative multiplies, to the motion that shows it.
SHOWN_IN = {"alpha": "pitch", "q": "pitch", "de": "pitch", "V": "speed and drag",
            "0": "speed and drag", "p": "roll", "da": "roll", "beta": "yaw", "r": "yaw",
            "dr": "yaw"}  # fmt: skip
UNITS_OF_3211 = 7
LARGER = 1.5  # times the flown amplitude, in one step
LARGEST_DEG = 10.0  # that is asked of a pilot: the answer is linear
MOST = 6  # inputs of a kind: more is another flight
PULSE_S, HANDS_OFF_S = 1.0, 20.0  # of the phugoid, of which two periods are seen
USUAL_DEG = {"elevator": 2.0, "aileron": 3.0, "rudder": 4.0}  # as `host plan` begins
USUAL_PERIOD_S = {SHORT_PERIOD: 0.7, DUTCH_ROLL: 1.2}  # of models of 1 to 3 m span


@dataclass(frozen=True, slots=True)
class AdvisedInput:
    """An input to fly.

    Attributes
    ----------
    surface, kind : str
    amplitude_deg, duration_s : float
    count : int
        How often.
    motion : str
        What it tells of: ``pitch``.
    """

    surface: str
    kind: str
    amplitude_deg: float
    duration_s: float
    count: int
    motion: str

    @property
    def text(self) -> str:
        """Such as ``3x aileron doublet 6 deg 1.2 s``."""
        after = f", {HANDS_OFF_S:.0f} s hands off" if self.kind == "pulse" else ""
        return (
            f"{self.count}x {self.surface} {self.kind} {self.amplitude_deg:g} deg"
            f" {self.duration_s:.2g} s{after}"
        )


def advised_inputs(
    rows: Sequence[SummaryRow],
    axes: Mapping[str, str],
    flown: Iterable[tuple[str, float]],
    period_s: Mapping[str, float],
) -> list[AdvisedInput]:
    """Return what to fly next, the least known motion first.

    Half-widths of noise shrink by the amplitude and by the root of the number of inputs. Where
    sensors or tolerances leave them, no input helps.

    Parameters
    ----------
    rows : sequence of SummaryRow
    axes : mapping
        Motion to its word (`known_axes`).
    flown : iterable of (str, float)
        Surface and amplitude (rad) of each maneuver.
    period_s : mapping
        Period of the modes that were found.
    """
    sizes: dict[str, list[float]] = {}
    for surface, size in flown:
        sizes.setdefault(surface, []).append(math.degrees(size))
    wanted = _wanted(rows, axes)
    order = sorted(wanted, key=lambda motion: axes.get(motion) != NOT)
    return [_input(motion, wanted[motion], sizes, period_s) for motion in order]


def _wanted(rows: Sequence[SummaryRow], axes: Mapping[str, str]) -> dict[str, list[SummaryRow]]:
    """Return each motion to learn more of, and its estimates that more inputs tell."""
    open_rows = [row for row in rows if row.word not in (GOOD, TINY) and row.flyable]
    found = {
        motion: [row for row in open_rows if coefficient_of(row.name) in MOVERS[motion]]
        for motion, word in axes.items()
        if word != GOOD
    }
    found = {motion: own for motion, own in found.items() if own}
    if found:
        return found
    for row in (row for row in open_rows if row.word == NOT):
        motion = SHOWN_IN.get(row.name.partition("_")[2], "")
        if motion:
            found.setdefault(motion, []).append(row)
    return found


def _input(
    motion: str,
    rows: Sequence[SummaryRow],
    sizes: Mapping[str, Sequence[float]],
    period_s: Mapping[str, float],
) -> AdvisedInput:
    surface, kind = INPUTS[motion]
    flown = sizes.get(surface, ())
    before = max(flown, default=USUAL_DEG[surface])
    size = min(LARGER * before, LARGEST_DEG) if flown else before
    too_wide = max(
        (row.share / (CARE_SHARE if row.word == NOT else TRUST_SHARE) for row in rows), default=1.0
    )
    more = max(len(flown), 1) * (too_wide**2 - 1.0) * (before / size) ** 2
    count = int(min(max(math.ceil(more), 1), MOST))
    return AdvisedInput(
        surface, kind, float(max(round(size), 1)), _duration_s(motion, kind, period_s), count,
        motion,
    )  # fmt: skip


def _duration_s(motion: str, kind: str, period_s: Mapping[str, float]) -> float:
    if kind == "pulse":
        return PULSE_S
    if motion == "roll":
        return 2.0 * ROLL_HALF_S
    mode = SHORT_PERIOD if motion == "pitch" else DUTCH_ROLL
    period = period_s.get(mode, USUAL_PERIOD_S[mode])
    if kind == "doublet":
        return 2.0 * half_of_doublet_s(period)
    return UNITS_OF_3211 * unit_of_3211_s(period)

"""An answer in short: one view of it for text, tables, JSON, report, page and notebook."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

from host.constants import DEG_PER_RAD
from host.sysid.answer.advised_inputs import AdvisedInput, advised_inputs
from host.sysid.answer.ground_measurements import NO_FILE, ground_measurements
from host.sysid.answer.known_axes import MOVERS, known_axes
from host.sysid.answer.mode_lines import JudgedMode, coefficient_modes, linear_modes
from host.sysid.answer.parameter_words import GOOD, NOT, TINY
from host.sysid.answer.summary_rows import SummaryRow, summary_rows
from host.sysid.models.diagnostics import STANDARD_ERROR

if TYPE_CHECKING:
    from collections.abc import Iterable

    from host.sysid.answer.marks import Verdict
    from host.sysid.checks.data_finding import Finding
    from host.sysid.coefficients.coefficient_estimator import CoefficientAnswer
    from host.sysid.linear.linear_answer import Answer
    from host.sysid.maneuvers.maneuver_detection import DetectedManeuver

NOTHING_TO_FLY = "nothing: no input would narrow what is left"
NOTHING_TO_MEASURE = "nothing: no error of sensors or aircraft widens an interval most"
TOO_WIDE = "interval too wide"


@dataclass(frozen=True)
class AnswerSummary:
    """Summary of an answer.

    Attributes
    ----------
    linear : tuple of Answer
    direct : CoefficientAnswer or None
    verdicts : tuple of Verdict
        Verdict of each answer, linear ones first.
    flown : tuple of DetectedManeuver
        In the flights, fitted or not.
    findings : tuple of Finding
    notes : tuple of str
    has_aircraft : bool
        Whether there is an aircraft file.
    flights : int
    """

    linear: tuple[Answer, ...]
    direct: CoefficientAnswer | None
    verdicts: tuple[Verdict, ...]
    flown: tuple[DetectedManeuver, ...] = ()
    findings: tuple[Finding, ...] = ()
    notes: tuple[str, ...] = ()
    has_aircraft: bool = False
    flights: int = 1

    @cached_property
    def rows(self) -> list[SummaryRow]:
        """Coefficients, or derivatives without an aircraft file."""
        return summary_rows(self.linear, self.direct, self.verdicts)

    @cached_property
    def axes(self) -> dict[str, str]:
        """How well pitch, roll, yaw, and speed with drag are known."""
        return known_axes({row.name: row.mark for row in self.rows})

    @property
    def known(self) -> str:
        """How well each motion is known; of a model of the user's, its parameters."""
        if self.axes:
            said = ", ".join(f"{axis} {word}" for axis, word in self.axes.items())
            left = [axis for axis in MOVERS if axis not in self.axes]
            others = f"; no {', '.join(left)}" if left else ""
            return f"Known from this flight: {said}{others}."
        words = [row.word for row in self.rows]
        said = ", ".join(f"{words.count(word)} {word}" for word in dict.fromkeys(words))
        return f"Known from this flight, of {len(words)} parameters: {said or 'none'}."

    @cached_property
    def modes(self) -> list[JudgedMode]:
        """The modes, of several methods those of the first; oscillations first."""
        seen: dict[str, list[JudgedMode]] = {}
        for answer in self.linear:
            if answer.template not in seen:
                seen[answer.template] = linear_modes(answer)
        found = [mode for own in seen.values() for mode in own]
        if not self.linear and self.direct is not None:
            found = coefficient_modes(self.direct, self.verdicts[-1])
        return sorted(found, key=lambda one: not one.mode.oscillatory)

    @property
    def condition(self) -> str:
        """The mean airspeed and angle of attack of the first answer."""
        if self.direct is not None:
            at = self.direct.fit.condition
            speed, alpha = f"{at.airspeed_mps:.1f} m/s", at.alpha_rad
        else:
            answer = self.linear[0]
            if not answer.trim.known:
                return "unknown airspeed"
            speed, alpha = f"{answer.condition.airspeed_mps:.1f} m/s", answer.trim.alpha_rad
        return f"{speed}, alpha {alpha * DEG_PER_RAD:.1f} deg"

    @property
    def fitted(self) -> str:
        """How many maneuvers were fitted, and how many were kept to be predicted."""
        if self.direct is not None:
            unseen = self.direct.fit.prediction
            count = len(self.direct.windows)
            left = len(unseen.windows) if unseen else 0
            return f"{count} maneuver{'s' * (count != 1)} fitted, {left} predicted"
        first = {answer.template: answer for answer in reversed(self.linear)}.values()
        count = sum(len(answer.used) for answer in first)
        left = sum(len(answer.held_out) for answer in first)
        return f"{count} maneuver{'s' * (count != 1)} fitted, {left} predicted"

    @cached_property
    def not_known(self) -> dict[str, list[str]]:
        """Reason to the estimates that are not to be relied on by it, reasons with most first."""
        found: dict[str, list[str]] = {}
        for row in self.rows:
            if row.word == NOT:
                reason = _short(row.against[0]) if row.against else TOO_WIDE
                found.setdefault(reason, []).append(row.name)
        return dict(sorted(found.items(), key=lambda item: -len(item[1])))

    @cached_property
    def fly(self) -> list[AdvisedInput]:
        """What to fly next."""
        flown = [(m.axis.partition("_")[0], m.amplitude) for m in self.flown]
        periods = {
            one.mode.name: 2.0 * math.pi / one.mode.frequency_radps
            for one in self.modes
            if one.mode.oscillatory and one.word != NOT
        }
        return advised_inputs(self.rows, self.axes, flown, periods)

    @cached_property
    def measure(self) -> list[str]:
        """What to measure on the ground."""
        found = ground_measurements(row.cause for row in self.rows if row.word not in (GOOD, TINY))
        return found if self.has_aircraft else [NO_FILE, *found]

    def fly_lines(self) -> list[str]:
        """Return what to fly next, a line each."""
        return [one.text for one in self.fly] or [NOTHING_TO_FLY]

    def measure_lines(self) -> list[str]:
        """Return what to measure on the ground, a line each."""
        return self.measure or [NOTHING_TO_MEASURE]

    def document(self) -> dict[str, Any]:
        """Return the summary for JSON."""
        return {
            "condition": self.condition,
            "known": self.axes,
            "modes": [
                {"name": m.mode.name, "known": m.word, "reason": m.reason, "text": m.text}
                for m in self.modes
            ],
            "estimates": [
                {
                    "name": row.name,
                    "called": row.words,
                    "value": row.value,
                    "half_width": row.half_width,
                    "share": row.share,
                    "unit": row.unit,
                    "known": row.word,
                }
                for row in self.rows
            ],
            "not_known": self.not_known,
            "fly": self.fly_lines(),
            "measure": self.measure_lines(),
        }


def _short(reason: str) -> str:
    """Return a reason without its figures; a standard error beyond the value is a width."""
    return TOO_WIDE if reason.startswith(STANDARD_ERROR) else reason.partition(" (")[0]


def counted(said: Iterable[str]) -> list[str]:
    """Return sentences once each, with how often they were said."""
    found: dict[str, int] = {}
    for one in said:
        found[one] = found.get(one, 0) + 1
    return [f"{one} ({n} times)" if n > 1 else one for one, n in found.items()]


def sources_apart(notes: Sequence[str], sources: Sequence[str]) -> list[str]:
    """Return notes without the flight that each begins with, where there are several."""
    if len(sources) < 2:
        return list(notes)
    heads = tuple(f"{source}: " for source in sources)
    return [
        note[len(next(h for h in heads if note.startswith(h))):] if note.startswith(heads) else note
        for note in notes
    ]  # fmt: skip

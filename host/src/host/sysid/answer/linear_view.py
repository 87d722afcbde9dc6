"""A linear model as its verdict reads it: estimates, reasons of its own, what to fly again."""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

from host.constants import CARE_SHARE, ENTANGLED
from host.sysid.answer.correlated_inputs import correlated_inputs
from host.sysid.answer.feedback_pairs import alike_derivatives, combined_derivatives
from host.sysid.answer.linear_rules import (
    divided_by,
    motion_left_out,
    on_a_bound,
    one_input_for_two,
    unpredicted,
)
from host.sysid.answer.marks import SMALL, UNSURE, USELESS, Judged, mark_of, share_text
from host.sysid.answer.parameter_places import leaning_on
from host.sysid.answer.servo_lines import servo_lines
from host.sysid.answer.trust_rules import (
    Rule,
    impossible_sign,
    input_feedback,
    open_finding,
    own,
)
from host.sysid.errors.surface_motion import HELD_SURFACES
from host.sysid.linear.users_model import NOISE_CHOSEN
from host.sysid.models.diagnostics import reference_values

if TYPE_CHECKING:
    from host.sysid.checks.data_finding import Feedback, Finding
    from host.sysid.linear.linear_answer import Answer

PLACE = "imu_"  # begins the name of a sensor's place: no property of the aircraft
RULES: tuple[Rule, ...] = (
    open_finding,
    input_feedback,
    own(on_a_bound),
    own(one_input_for_two),
    own(motion_left_out),
    impossible_sign,
)


@dataclass(frozen=True)
class LinearView:
    """View of a linear model, as rules and verdict read it (`EstimateView`)."""

    answer: Answer

    @property
    def rules(self) -> Sequence[Rule]:
        """What may speak against its estimates, in order."""
        return RULES

    @property
    def heading(self) -> str:
        """The model, its maneuvers and method."""
        answer, count = self.answer, len(self.answer.used)
        fitted = f"{count} maneuver{'s' * (count != 1)} fitted"
        by, held_out = answer.result.method, len(answer.held_out)
        return f"{answer.template}: {fitted}, {held_out} kept to be predicted; method: {by}"

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Derivatives in the model's order."""
        parameters = self.answer.model.parameters
        return tuple(p.name for p in parameters if not p.name.startswith(PLACE))

    @cached_property
    def estimates(self) -> tuple[Judged, ...]:
        """Each derivative by itself: its width, and whether the data tell it."""
        answer, result = self.answer, self.answer.result
        half = result.half_width()
        size = reference_values(answer.model, answer.maneuvers, result.estimate)
        lost = () if result.converged else ("no convergence",)
        found = []
        for name in self.names:
            k = result.index(name)
            found.append(
                Judged(
                    name,
                    math.inf if lost else float(half[k]) / max(float(size[k]), 1e-300),
                    lost,
                    small=bool(size[k] > abs(float(result.estimate[k]))),
                )
            )
        return tuple(found)

    @property
    def values(self) -> dict[str, float]:
        """Estimates of a template; none of a user's own model."""
        parameters = () if self.answer.own_model else self.answer.model.parameters
        return {p.name: self.answer.result.value(p.name) for p in parameters}

    @property
    def explained(self) -> set[str]:
        """Derivatives that the data hardly tell: each has a line of its own."""
        wide = {one.name for one in self.estimates if not one.share <= CARE_SHARE}
        return wide & {r.name for r in self.answer.identifiability_flags}

    def leaning_on(self, channel: str) -> set[str]:
        """Return the derivatives in a column's equation, and those that it multiplies or scales."""
        return leaning_on(self.answer.model, {channel}) | divided_by(self.answer, channel)

    def alike(self, law: Feedback) -> list[str]:
        """Return the derivatives that a feedback law makes alike."""
        return [name for group in alike_derivatives(self.answer.model, law) for name in group]

    def entangled(self, name: str) -> set[str]:
        """Return the derivatives of a row, and those that correlate with one of it."""
        row, result = name.partition("_")[0], self.answer.result
        correlated = result.correlation[result.index(name)]
        return {
            own
            for own in self.names
            if own.partition("_")[0] == row or abs(correlated[result.index(own)]) > ENTANGLED
        }

    def first_lines(self) -> list[str]:
        """Return the warning of a search that did not end."""
        wrong = "  no convergence: estimates and intervals mean nothing, use another method"
        return [] if self.answer.result.converged else [wrong]

    def width_lines(self, judged: Sequence[Judged]) -> list[str]:
        """Return which derivatives only their width rules out, and which are small."""
        lines = []
        wide = [
            f"{one.name} ({share_text(one.share)})"
            for one in judged
            if mark_of(one) in {UNSURE, USELESS}
            and not one.against
            and one.name not in self.explained
        ]
        if wide:
            lines.append(f"  not known (interval above 30 %):  {', '.join(wide)}")
        if little := [one.name for one in judged if mark_of(one) == SMALL]:
            lines.append(
                f"  tiny (below 5 % of the largest effect in the equation):  {', '.join(little)}"
            )
        return lines

    def further_lines(self, findings: Sequence[Finding]) -> list[str]:
        """Return the lines on identifiability, inputs, servos, feedback and prediction."""
        answer = self.answer
        return [
            *_identifiability_lines(answer, self.explained),
            *_input_lines(answer),
            *servo_lines(answer),
            *combined_derivatives(answer, findings),
            *_data_lines(answer),
        ]


def _identifiability_lines(answer: Answer, explained: Collection[str]) -> list[str]:
    """Return the parameters that cannot be identified, and the reasons."""
    flags = [r for r in answer.identifiability_flags if r.name in explained]
    lines = []
    for flag in flags:
        lines.append(f"  not known: {flag.name} ({flag.reason})")
    return lines


def _input_lines(answer: Answer) -> list[str]:
    """Return the remarks on correlated inputs, and on inputs that did not move."""
    lines = [
        f"  {one} and {other} moved together: fly one at a time, without a mixer"
        for one, other in correlated_inputs(answer)
    ]
    lines += [
        f"  {name} never moved, so its derivatives are not separable from the bias"
        for name in answer.constant_inputs
    ]
    if answer.collinearity.severe:
        pairs = ", ".join(f"{a} with {b}" for a, b, _ in answer.collinearity.pairs[:3])
        lines.append("  the data are close to collinear" + (f" ({pairs})" if pairs else ""))
    return lines


def _data_lines(answer: Answer) -> list[str]:
    """Return the lines on bounds, warnings, and prediction of held-out data."""
    lines = [
        f"  {name} is at its bound: the model, not a delay, is wrong there"
        for name in answer.at_bound
    ]
    lines += [
        f"  {text}" if text.startswith((NOISE_CHOSEN, HELD_SURFACES)) else f"  warning: {text}"
        for text in answer.result.warnings
    ]
    poor = [f.name for f in unpredicted(answer)]
    if answer.validation:
        lines.append(
            f"  the unseen maneuver is not predicted in {', '.join(poor)}"
            if poor
            else "  the unseen maneuver is predicted in every output"
        )
    else:
        lines.append(
            "  no maneuver was left to predict, so no interval counts errors of the model: fly each"
            " input three times"
        )
    return lines

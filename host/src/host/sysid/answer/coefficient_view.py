"""Coefficients fitted directly as their verdict reads them: causes, what to measure or fly."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from host.constants import ENTANGLED
from host.sysid.answer.doubt import Doubt, Evidence, doubt
from host.sysid.answer.marks import Judged, share_text
from host.sysid.answer.trust_rules import (
    Rule,
    impossible_sign,
    input_feedback,
    open_finding,
)
from host.sysid.models.coefficient_model import standard_model

if TYPE_CHECKING:
    from host.sysid.checks.data_finding import Feedback, Finding
    from host.sysid.coefficients.coefficient_estimator import CoefficientAnswer

WORSE = 1.25  # NRMSE of unseen over fitted maneuvers: more is a model that does not carry over
EXCITED = "the inputs excite it too little"
FORCES = ("CL", "CD", "CX", "CZ")
# Channel to the equations whose response it makes, and to the labels it multiplies; "" is all.
LEANING: dict[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    "airspeed_mps": (("",), ()),
    "qbar_pa": (("",), ()),
    "ax_mps2": (FORCES, ()),
    "az_mps2": (FORCES, ()),
    "ay_mps2": (("CY",), ()),
    "alpha_rad": (("CL", "CD"), ("alpha",)),
    "beta_rad": ((), ("beta",)),
    "p_radps": (("Cl",), ("p",)),
    "q_radps": (("Cm",), ("q",)),
    "r_radps": (("Cn",), ("r",)),
    "elevator_rad": ((), ("de",)),
    "aileron_rad": ((), ("da",)),
    "rudder_rad": ((), ("dr",)),
    "throttle": (("CD", "CX"), ()),
}


@dataclass(frozen=True)
class CoefficientView:
    """View of coefficients fitted directly, as rules and verdict read them (`EstimateView`)."""

    answer: CoefficientAnswer

    @property
    def rules(self) -> Sequence[Rule]:
        """What may speak against its estimates, in order."""
        return RULES

    @property
    def heading(self) -> str:
        """The terms, the maneuvers of each axis."""
        answer = self.answer
        along = sum(w.longitudinal for w in answer.windows)
        own = "" if answer.model == standard_model() else f" by the terms of '{answer.model.name}'"
        return (
            f"coefficients{own}: {along} maneuvers of the elevator and"
            f" {len(answer.windows) - along} of aileron and rudder fitted together"
        )

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Coefficients in the order of the fit."""
        return tuple(d.name for d in self.answer.fit.derivatives)

    @cached_property
    def estimates(self) -> tuple[Judged, ...]:
        """Each coefficient by its width alone: one beyond its size is of no use."""
        found = self.answer.fit.derivatives
        return tuple(Judged(d.name, d.share) for d in found)

    @property
    def values(self) -> dict[str, float]:
        """Estimates by the standard terms; of a user's own nothing is known."""
        if self.answer.model != standard_model():
            return {}
        return {d.name: d.value for d in self.answer.fit.derivatives}

    @property
    def explained(self) -> tuple[str, ...]:
        """Names with a line of their own whatever is doubted: none."""
        return ()

    def leaning_on(self, channel: str) -> list[str]:
        """Return the coefficients whose equation a column makes, and those that it multiplies."""
        equations, labels = LEANING.get(channel, ((), ()))
        return [n for n in self.names if n.startswith(equations) or n.split("_")[-1] in labels]

    def alike(self, law: Feedback) -> list[str]:
        """Return the coefficients that a feedback law makes alike."""
        own = LEANING[law.surface][1]
        others = [label for s in law.signals for label in LEANING.get(s, ((), ()))[1]]
        names = [n.split("_") for n in self.names if "_" in n]
        both = [{n[0] for n in names if n[-1] in labels} for labels in (own, others)]
        equations = both[0] & both[1]
        return ["_".join(n) for n in names if n[0] in equations and n[-1] in (*own, *others)]

    def entangled(self, name: str) -> set[str]:
        """Return the coefficients of an equation, and those that correlate with one of it."""
        fit, k = self.answer.fit, self.names.index(name)
        sd = np.sqrt(np.maximum(np.diag(fit.covariance), 1e-300))
        correlated = np.abs(fit.covariance[k] / sd[k] / sd) > ENTANGLED
        entangled = {other for other, one in zip(self.names, correlated, strict=False) if one}
        return entangled | set(_of_equation(self.names, name.partition("_")[0]))

    def first_lines(self) -> list[str]:
        """Return nothing: the search has no other end."""
        return []

    def width_lines(self, judged: Sequence[Judged]) -> list[str]:
        """Return what was assumed, and the coefficients with too wide intervals and why."""
        remarks = [f"  {remark}" for remark in self.answer.remarks]
        return [*remarks, *_flag_lines(self.answer)]

    def further_lines(self, findings: Sequence[Finding]) -> list[str]:
        """Return the lines on maneuvers that do not agree, and on prediction."""
        return [*_agreement_lines(self.answer), _prediction_line(self.answer)]


def hidden_lag(view: CoefficientView, evidence: Evidence) -> list[Doubt]:
    """Doubt moments of surfaces that seem to lag: no interval holds what that does."""
    names = [n for n in view.names if n.partition("_")[0] in view.answer.lagging]
    return doubt(names, view.names, "surfaces seem to lag behind their columns")


def _of_equation(names: Sequence[str], equation: str) -> list[str]:
    return [n for n in names if n.split("_")[0] == equation]


def _not_carried_over(answer: CoefficientAnswer) -> dict[str, str]:
    """Return the equations that do not carry over to unseen maneuvers, with both figures."""
    found = answer.fit.prediction
    if found is None:
        return {}
    return {
        name: f"NRMSE {100.0 * held_out:.1f} %, fitted {100.0 * found.fitted[name]:.1f} %"
        for name, held_out in found.left_out.items()
        if held_out > WORSE * found.fitted[name]
    }


def _flag_lines(answer: CoefficientAnswer) -> list[str]:
    """Return the coefficients with too wide intervals, and their causes."""
    lines = []
    for d in answer.fit.derivatives:
        if not d.flagged:
            continue
        cause, part = answer.causes.get(d.name, ("", 0.0))
        why = f"{100.0 * part:.0f} % of its variance comes from {cause}" if cause else EXCITED
        lines.append(f"  not known: {d.name} (+- {share_text(d.share)}; {why})")
    return lines


def _agreement_lines(answer: CoefficientAnswer) -> list[str]:
    """Return on which coefficients the maneuvers do not agree."""
    found = answer.fit.maneuver_agreement
    return [
        f"  maneuvers disagree on {name} by {found.factor[k]:.1f} times what noise allows; its"
        " interval is widened by that"
        for k, name in enumerate(found.names)
        if found.factor[k] > 1.0
    ]


def _prediction_line(answer: CoefficientAnswer) -> str:
    """Return whether each maneuver is predicted by a fit to the others."""
    found, count = answer.fit.prediction, len(answer.windows)
    if found is None:
        return (
            "  no maneuver can be predicted by the others, for each alone informs a term: fly every"
            " input twice"
        )
    poor = [f"{name} ({words})" for name, words in _not_carried_over(answer).items()]
    if poor:
        return f"  maneuvers are not predicted by the others in {', '.join(poor)}"
    return f"  {len(found.windows)} of {count} maneuvers are predicted by the others"


RULES: tuple[Rule, ...] = (
    open_finding,
    input_feedback,
    impossible_sign,
    hidden_lag,
)

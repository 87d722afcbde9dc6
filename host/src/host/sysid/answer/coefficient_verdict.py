"""The verdict on coefficients fitted directly: a mark for each, causes, what to measure or fly."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from host.sysid.answer.advised_inputs import advised_input
from host.sysid.answer.coefficient_rules import unpredicted
from host.sysid.answer.doubt import Doubt, reasons_by_name
from host.sysid.answer.marks import (
    CAREFUL,
    TRUST,
    TRUSTED,
    UNSURE,
    USELESS,
    Verdict,
    first_lines,
    share_text,
)
from host.sysid.coefficients.coefficient_fit import FLAG_SHARE
from host.sysid.coefficients.coefficient_model import standard_model

if TYPE_CHECKING:
    from host.sysid.coefficients.coefficient_estimator import CoefficientAnswer


def coefficient_marks(answer: CoefficientAnswer, doubts: Sequence[Doubt]) -> dict[str, str]:
    """Return the mark of each coefficient by its interval and all doubts about it."""
    reasons, marks = reasons_by_name(doubts), {}
    for d in answer.fit.derivatives:
        sharp = TRUSTED if d.share <= TRUST else CAREFUL
        wide = USELESS if d.share > 1.0 else UNSURE
        marks[d.name] = wide if d.flagged or d.name in reasons else sharp
    return marks


def coefficient_verdict(answer: CoefficientAnswer, doubts: Sequence[Doubt]) -> Verdict:
    """Return the verdict on each coefficient, by all doubts there are."""
    along = sum(w.longitudinal for w in answer.windows)
    own = "" if answer.model == standard_model() else f" by the terms of '{answer.model.name}'"
    heading = (
        f"coefficients{own}: {along} maneuvers of the elevator, {len(answer.windows) - along} of"
        " aileron and rudder fitted jointly, errors of the instrument beside them"
    )
    reasons, marks = reasons_by_name(doubts), coefficient_marks(answer, doubts)
    lines = [
        *first_lines(heading, marks, FLAG_SHARE),
        *(f"  {remark}" for remark in answer.remarks),
        *_flag_lines(answer, marks),
        *_doubt_lines(doubts),
        *_agreement_lines(answer),
        _prediction_line(answer),
    ]
    why = {
        d.name: (f"95 % half-width {share_text(d.share, FLAG_SHARE)}", *reasons.get(d.name, ()))
        for d in answer.fit.derivatives
    }
    return Verdict(heading, marks, tuple(lines), why)


def _doubt_lines(doubts: Sequence[Doubt]) -> list[str]:
    return [
        f"  do not rely on {', '.join(one.names)}, whatever the interval: {one.reason}"
        for one in doubts
    ]


def _flag_lines(answer: CoefficientAnswer, marks: Mapping[str, str]) -> list[str]:
    """Return the coefficients with too wide intervals, their causes and the remedies."""
    lines, advice = [], set()
    for d in answer.fit.derivatives:
        if not d.flagged:
            continue
        cause, part = answer.causes.get(d.name, ("", 0.0))
        why = f"{100.0 * part:.0f} % of the variance is {cause}" if cause else "excited too little"
        lines.append(f"  {marks[d.name]} {d.name}: +- {share_text(d.share, FLAG_SHARE)}, {why}")
        fly = advised_input(d.name) or "a larger input"
        advice.add(f"measure {cause} better" if cause else f"fly {fly}")
    if advice:
        lines.append(f"  to learn them, {'; '.join(sorted(advice))}")
    return lines


def _agreement_lines(answer: CoefficientAnswer) -> list[str]:
    """Return on which coefficients the maneuvers do not agree."""
    found = answer.fit.maneuver_agreement
    return [
        f"  maneuvers do not agree on {name}: they scatter {found.factor[k]:.1f} times what noise"
        f" allows (chi-square {found.chi_square[k]:.1f} on {found.maneuvers[k] - 1.0:.1f}),"
        " interval widened to it"
        for k, name in enumerate(found.names)
        if found.factor[k] > 1.0
    ]


def _prediction_line(answer: CoefficientAnswer) -> str:
    """Return whether each maneuver is predicted by a fit to the others."""
    found, count = answer.fit.prediction, len(answer.windows)
    if found is None:
        return (
            "  no maneuver could be left out to be predicted: each alone tells a term; fly every"
            " input at least twice"
        )
    poor = [f"{name} ({words})" for name, words in unpredicted(answer).items()]
    return (
        f"  prediction of unseen maneuvers ({len(found.windows)} of {count}, each by the others): "
        + ("fails for " + ", ".join(poor) if poor else "holds for every coefficient")
    )

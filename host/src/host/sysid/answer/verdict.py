"""The answer in words: what to trust, what not and why, what to fly again."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from host.sysid.answer.doubt import Doubt, Evidence, reasons_by_name
from host.sysid.answer.estimate_view import EstimateView, views_of
from host.sysid.answer.marks import (
    CAREFUL,
    TRUSTED,
    Judged,
    Verdict,
    mark_of,
    names_marked,
    share_text,
)
from host.sysid.answer.trust_rules import doubts_of, input_feedback, open_finding
from host.sysid.reconstruction.sensor_corrections import correction_lines

if TYPE_CHECKING:
    from host.sysid.checks.data_finding import Finding
    from host.sysid.coefficients.coefficient_estimator import CoefficientAnswer
    from host.sysid.linear.linear_answer import Answer


def judge(
    linear: Sequence[Answer],
    coefficients: CoefficientAnswer | None = None,
    findings: Sequence[Finding] = (),
) -> tuple[Verdict, ...]:
    """Return a verdict for each answer to the same data, those of linear models first.

    Each answer is doubted by its rules and by the findings.

    Parameters
    ----------
    linear : sequence of Answer
    coefficients : CoefficientAnswer, optional
        Fitted directly.
    findings : sequence of Finding
        Findings of the data checks.
    """
    evidence = Evidence(tuple(findings))
    views = views_of(linear, coefficients)
    doubts = [doubts_of(view, evidence) for view in views]
    return tuple(verdict(view, own, findings) for view, own in zip(views, doubts, strict=True))


def verdict(
    view: EstimateView, doubts: Sequence[Doubt], findings: Sequence[Finding] = ()
) -> Verdict:
    """Return the verdict on each estimate of an answer.

    Parameters
    ----------
    view : EstimateView
        View of the answer.
    doubts : sequence of Doubt
        All there are.
    findings : sequence of Finding
        Findings of the data checks.
    """
    judged, marks = _doubted(view, doubts), _marks(view, doubts)
    lines = [
        view.heading,
        *view.first_lines(),
        *_mark_lines(marks),
        *view.width_lines(judged),
        *_doubt_lines(view, doubts),
        *view.further_lines(findings),
    ]
    reasons = {
        one.name: (f"95 % half-width {share_text(one.share)}", *one.against) for one in judged
    }
    return Verdict(view.heading, marks, tuple(lines), reasons)


def doubted_by_findings(
    linear: Sequence[Answer], coefficients: CoefficientAnswer | None, findings: Sequence[Finding]
) -> set[str]:
    """Return what findings of the data checks speak against.

    Parameters
    ----------
    linear, coefficients, findings
        As `judge`.

    Returns
    -------
    set of str
        Coefficients where they were fitted directly, else derivatives of the linear models.
    """
    views = views_of(linear if coefficients is None else (), coefficients)
    evidence = Evidence(findings=tuple(findings))
    doubts = [rule(view, evidence) for view in views for rule in (open_finding, input_feedback)]
    return {name for some in doubts for one in some for name in one.names}


def _doubted(view: EstimateView, doubts: Sequence[Doubt]) -> list[Judged]:
    """Return the estimates with every doubt about them."""
    reasons = reasons_by_name(doubts)
    return [
        replace(one, against=(*one.against, *reasons.get(one.name, ()))) for one in view.estimates
    ]


def _marks(view: EstimateView, doubts: Sequence[Doubt]) -> dict[str, str]:
    return {one.name: mark_of(one) for one in _doubted(view, doubts)}


def _mark_lines(marks: dict[str, str]) -> list[str]:
    """Return what is within a tenth, and what within 30 %, of its size."""
    trusted = ", ".join(names_marked(marks, TRUSTED))
    lines = [f"  good (within 10 %):  {trusted or 'nothing'}"]
    if careful := names_marked(marks, CAREFUL):
        lines.append(f"  fair (10 to 30 %):  {', '.join(careful)}")
    return lines


def _doubt_lines(view: EstimateView, doubts: Sequence[Doubt]) -> list[str]:
    """Return a line for each doubt."""
    pairs = [(", ".join(n for n in one.names if n not in view.explained), one) for one in doubts]
    return [f"  not known: {names}: {one.reason}" for names, one in pairs if names]


def removed_error_lines(answers: Sequence[Answer]) -> list[str]:
    """Return which errors of sensors were taken out of the columns of linear fits."""
    return correction_lines(answers[0].corrections) if answers else []

"""The answer in words: what to trust, what not and why, what to fly again."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from host.sysid.answer.coefficient_rules import coefficient_doubts
from host.sysid.answer.coefficient_verdict import coefficient_marks, coefficient_verdict
from host.sysid.answer.feedback_pairs import feedback_of
from host.sysid.answer.linear_verdict import linear_marks, linear_verdict
from host.sysid.answer.marks import Verdict
from host.sysid.answer.model_agreement import disagreements_of_models
from host.sysid.answer.trust_rules import Evidence, doubts_of
from host.sysid.checks.data_finding import Finding, open_channels
from host.sysid.linear.linear_answer import Answer
from host.sysid.reconstruction.sensor_corrections import correction_lines

if TYPE_CHECKING:
    from host.sysid.coefficients.coefficient_estimator import CoefficientAnswer


def judge(
    linear: Sequence[Answer],
    coefficients: CoefficientAnswer | None = None,
    findings: Sequence[Finding] = (),
) -> tuple[Verdict, ...]:
    """Return a verdict for each answer to the same data, those of linear models first.

    Each answer is doubted by its rules, by the findings, and by what the others say.

    Parameters
    ----------
    linear : sequence of Answer
    coefficients : CoefficientAnswer, optional
        Fitted directly.
    findings : sequence of Finding
        Of the data checks.
    """
    evidence = Evidence(tuple(linear), tuple(findings))
    doubts = [doubts_of(answer, evidence) for answer in linear]
    if coefficients is None:
        return tuple(linear_verdict(a, d, findings) for a, d in zip(linear, doubts, strict=True))
    direct = coefficient_doubts(coefficients, open_channels(findings), feedback_of(findings))
    marks = coefficient_marks(coefficients, direct)
    for answer, own in zip(linear, doubts, strict=True):
        here, there = disagreements_of_models(
            answer, coefficients, linear_marks(answer, own), marks
        )
        own += here
        direct = [*direct, *there]
    judged = (linear_verdict(a, d, findings) for a, d in zip(linear, doubts, strict=True))
    return (*judged, coefficient_verdict(coefficients, direct))


def removed_error_lines(answers: Sequence[Answer]) -> list[str]:
    """Return which errors of sensors were taken out of the columns of linear fits."""
    return correction_lines(answers[0].corrections) if answers else []

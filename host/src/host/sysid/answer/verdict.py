"""The answer in words: what to trust, what not and why, what to fly again."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from host.sysid.answer.coefficient_verdict import coefficient_verdict
from host.sysid.answer.feedback_pairs import feedback_of
from host.sysid.answer.linear_verdict import linear_verdict
from host.sysid.answer.marks import Verdict
from host.sysid.answer.model_agreement import disagreements_of_models
from host.sysid.answer.trust_rules import NO_EVIDENCE, Evidence
from host.sysid.checks.data_finding import open_channels
from host.sysid.linear.linear_answer import Answer
from host.sysid.reconstruction.sensor_corrections import correction_lines

if TYPE_CHECKING:
    from host.sysid.coefficients.coefficient_estimator import CoefficientAnswer


def verdict_of(answer: Answer | CoefficientAnswer, evidence: Evidence = NO_EVIDENCE) -> Verdict:
    """Return the verdict of one answer, a linear model or coefficients fitted directly.

    Parameters
    ----------
    answer : Answer or CoefficientAnswer
    evidence : Evidence, optional
        What beside it speaks against it: other methods, findings of the data checks.
    """
    direct, findings = evidence.coefficients, evidence.findings
    if isinstance(answer, Answer):
        own_verdict = linear_verdict(answer, evidence)
        if direct is None:
            return own_verdict
        there = coefficient_verdict(direct, open_channels(findings), feedback_of(findings))
        more = disagreements_of_models(answer, direct, own_verdict.marks, there.marks)[0]
        return linear_verdict(answer, evidence, more) if more else own_verdict
    checks = open_channels(findings), feedback_of(findings)
    own_verdict = coefficient_verdict(answer, *checks)
    doubts = [
        doubt
        for one in evidence.beside
        for doubt in disagreements_of_models(
            one, answer, linear_verdict(one, evidence).marks, own_verdict.marks
        )[1]
    ]
    return coefficient_verdict(answer, *checks, doubts) if doubts else own_verdict


def verdict_lines(
    answers: Sequence[Answer | CoefficientAnswer],
    notes: Sequence[str],
    evidence: Evidence = NO_EVIDENCE,
) -> list[str]:
    """Return the verdict: notes first, then per model what to trust and what to re-fly."""
    lines = [f"note: {note}" for note in notes]
    for answer in answers:
        lines += verdict_of(answer, evidence).lines
    return lines


def removed_error_lines(answers: Sequence[Answer]) -> list[str]:
    """Return which errors of sensors were taken out of the columns of linear fits."""
    return correction_lines(answers[0].corrections) if answers else []

"""The verdict on one answer by itself, or beside what a test gives."""

from collections.abc import Sequence

from host.sysid.answer import Verdict, judge
from host.sysid.answer.doubt import Evidence
from host.sysid.coefficients import CoefficientAnswer
from host.sysid.linear import Answer

NO_EVIDENCE = Evidence()


def verdict_of(answer: Answer | CoefficientAnswer, evidence: Evidence = NO_EVIDENCE) -> Verdict:
    """Return the verdict on one answer, findings beside it."""
    if isinstance(answer, CoefficientAnswer):
        return judge((), answer, evidence.findings)[-1]
    return judge([answer], None, evidence.findings)[0]


def verdict_lines(
    answers: Sequence[Answer | CoefficientAnswer],
    notes: Sequence[str],
    evidence: Evidence = NO_EVIDENCE,
) -> list[str]:
    """Return notes, then the lines of each verdict."""
    said = [f"note: {note}" for note in notes]
    return [*said, *(line for answer in answers for line in verdict_of(answer, evidence).lines)]

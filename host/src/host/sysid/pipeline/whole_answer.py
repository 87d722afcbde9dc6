"""All that an answer holds, as text and as a document: every number, with truth and prior."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from host.sysid.answer.estimate_lines import coefficient_lines, model_lines
from host.sysid.answer.json_document import answer_document, coefficient_document
from host.sysid.answer.method_comparison import method_table
from host.sysid.answer.prior_comparison import prior_document, prior_lines
from host.sysid.answer.truth_comparison import truth_document, truth_report_lines
from host.sysid.answer.verdict import removed_error_lines
from host.sysid.checks.data_finding import finding_document
from host.sysid.reconstruction.reconstruction import compatibility_document, compatibility_lines

if TYPE_CHECKING:
    from host.sysid.pipeline.identification import Identification


def number_lines(found: Identification, width: int) -> list[str]:
    """Return every estimate, mode and figure of fit, and the errors of the sensors.

    Parameters
    ----------
    found : Identification
    width : int
        Characters of a line of the table of several methods.
    """
    lines: list[str] = []
    if len(found.methods) > 1:
        lines += ["", *method_table(found.linear, width)]
    else:
        for answer, verdict in zip(found.linear, found.verdicts, strict=False):
            lines += ["", *model_lines(answer, verdict)]
    if found.coefficients:
        lines += ["", *coefficient_lines(found.coefficients, found.verdicts[-1])]
    for flight, agreement in zip(found.flights, found.agreements, strict=True):
        if agreement:
            named = [flight.source] if len(found.flights) > 1 else []
            lines += ["", *named, *compatibility_lines(agreement)]
    return lines


def compared_lines(found: Identification) -> list[str]:
    """Return the answer with the prior and the truth that were given."""
    lines: list[str] = []
    if found.prior is not None:
        lines += ["", *prior_lines(found.coefficient_tables, found.prior)]
    if found.truth is not None:
        lines += ["", *truth_report_lines(found.linear, found.coefficients, found.truth)]
    return lines


def whole_document(found: Identification) -> dict[str, Any]:
    """Return everything as plain lists, numbers and strings; several flights are lists."""
    direct = found.coefficients
    documents = [
        answer_document(answer, (*verdict.lines, *removed_error_lines([answer])), verdict)
        for answer, verdict in zip(found.linear, found.verdicts, strict=False)
    ]
    if direct:
        documents.append(coefficient_document(direct, found.verdicts[-1]))
    sources = [flight.source for flight in found.flights]
    agreements = [compatibility_document(a) if a else None for a in found.agreements]
    one = len(sources) == 1
    return {
        "source": sources[0] if one else sources,
        "summary": found.summary.document(),
        "findings": [finding_document(finding) for finding in found.findings],
        "notes": list(found.notes),
        "data_compatibility": agreements[0] if one else agreements,
        "answers": documents,
        "truth": truth_document(found.linear, direct, found.truth) if found.truth else None,
        "prior": prior_document(found.coefficient_tables, found.prior) if found.prior else None,
    }

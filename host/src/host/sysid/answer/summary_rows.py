"""Estimates as rows of a summary: coefficients, without an aircraft file derivatives."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from host.aircraft.gains import COEFFICIENT_ROWS, coefficient_name
from host.sysid.answer.converted_marks import converted_marks, converted_shares
from host.sysid.answer.parameter_words import in_words, word_of
from host.sysid.errors.widest_errors import NOISE, OUTSIDE_MODEL
from host.sysid.models.parameter_units import parameter_unit

if TYPE_CHECKING:
    from host.sysid.answer.marks import Verdict
    from host.sysid.coefficients.coefficient_estimator import CoefficientAnswer
    from host.sysid.linear.linear_answer import Answer

FLOWN_AWAY = ("", NOISE, OUTSIDE_MODEL)  # causes that more or larger inputs make smaller


@dataclass(frozen=True, slots=True)
class SummaryRow:
    """One estimate.

    Attributes
    ----------
    name, words : str
        Its symbol, and what it is called.
    value, half_width, share : float
        Value and half-width of the 95 % interval; the share is over the value, or over what would
        contribute 5 % of its equation.
    unit : str
        SI and radian; empty of a pure number.
    mark, word : str
        The verdict's, and it in a word.
    cause : str
        What widens the interval most.
    against : tuple of str
        What speaks against it besides its width.
    """

    name: str
    words: str
    value: float
    half_width: float
    share: float
    unit: str
    mark: str
    word: str
    cause: str
    against: tuple[str, ...]

    @property
    def flyable(self) -> bool:
        """Whether an input would tell it better: no error of sensors or aircraft keeps it wide."""
        return self.cause in FLOWN_AWAY or bool(self.against)


def summary_rows(
    linear: Sequence[Answer], direct: CoefficientAnswer | None, verdicts: Sequence[Verdict]
) -> list[SummaryRow]:
    """Return the estimates to show at first: of several methods the first one's of each model;
    coefficients that were fitted directly in place of all others."""
    if direct is not None:
        return list(_direct_rows(direct, verdicts[-1]))
    rows: list[SummaryRow] = []
    seen: set[str] = set()
    for answer, verdict in zip(linear, verdicts, strict=False):
        if answer.template not in seen:
            rows += _linear_rows(answer, verdict)
        seen.add(answer.template)
    return rows


def _direct_rows(answer: CoefficientAnswer, verdict: Verdict) -> Iterator[SummaryRow]:
    for d in answer.fit.derivatives:
        mark = verdict.marks[d.name]
        cause = answer.causes.get(d.name, ("", 0.0))[0]
        yield SummaryRow(
            d.name, in_words(d.name), d.value, d.half_width, d.share, "", mark, word_of(mark),
            cause, verdict.reasons.get(d.name, ())[1:],
        )  # fmt: skip


def _linear_rows(answer: Answer, verdict: Verdict) -> Iterator[SummaryRow]:
    """Return a row for each parameter: its coefficient where it became one."""
    from host.sysid.models.diagnostics import reference_values  # of a linear model alone

    result, half = answer.result, answer.result.half_width()
    size = reference_values(answer.model, answer.maneuvers, result.estimate)
    converted, shares = converted_marks(answer, verdict.marks), converted_shares(answer)
    became = {c.name: c for c in answer.coefficients if c.name in converted}
    for k, p in enumerate(answer.model.parameters):
        if p.name not in verdict.marks:
            continue
        value, reference = float(result.estimate[k]), max(float(size[k]), 1e-300)
        row = p.name.partition("_")[0]
        c = became.get(coefficient_name(p.name)) if row in COEFFICIENT_ROWS else None
        against = verdict.reasons.get(p.name, ())[1:]
        if c is not None:
            mark = converted[c.name]
            yield SummaryRow(c.name, in_words(c.name), c.value, c.half_width, shares[c.name], "",
                             mark, word_of(mark), c.widened_by, against)  # fmt: skip
            continue
        mark = verdict.marks[p.name]
        called = "" if answer.own_model else in_words(p.name)
        yield SummaryRow(
            p.name, called, value, float(half[k]), float(half[k]) / reference,
            parameter_unit(answer.model, p.name), mark, word_of(mark),
            answer.causes.get(p.name, ""), against,
        )  # fmt: skip

"""Derivatives that feedback makes alike, and what of them is known together."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from host.constants import CARE_SHARE, NORMAL_95

if TYPE_CHECKING:
    from host.sysid.checks.data_finding import Feedback, Finding
    from host.sysid.linear.linear_answer import Answer
    from host.sysid.models.state_space_model import LinearModel


def feedback_of(findings: Iterable[Finding]) -> list[Feedback]:
    """Return the laws that surfaces follow, each once."""
    return list(dict.fromkeys(f.feedback for f in findings if f.feedback is not None))


def alike_derivatives(model: LinearModel, law: Feedback) -> list[tuple[str, ...]]:
    """Return, of each equation that has both, the surface's derivative and those it is like.

    In a user's model several parameters may act at one place: all of them are alike.

    A signal that is no state, or has no free derivative in an equation (gravity's bank angle),
    leaves the surface's derivative identifiable there.
    """
    found = []
    for row in range(len(model.states)):
        own = _entries(model, "B", row, model.inputs, law.surface)
        others = [_entries(model, "A", row, model.states, name) for name in law.signals]
        if own and all(others):
            found.append(tuple(dict.fromkeys((*own, *(n for names in others for n in names)))))
    return found


def combined_derivatives(answer: Answer, findings: Iterable[Finding]) -> list[str]:
    """Return lines with the sums of derivatives that a feedback law makes collinear.

    A law with a lag or a wash-out leaves no such sum, nor do several parameters at one place.
    """
    sums = [
        line
        for law in feedback_of(findings)
        if not law.filtered
        for own, *others in alike_derivatives(answer.model, law)
        if len(others) == len(law.gains)
        for name, gain in zip(others, law.gains, strict=True)
        if (line := _known_sum(answer, name, gain, own))
    ]
    return [f"  known together: {', '.join(sums)}"] if sums else []


def _known_sum(answer: Answer, name: str, gain: float, own: str) -> str:
    """Return the sum of two derivatives; nothing if it is not known either."""
    result = answer.result
    at = [result.index(name), result.index(own)]
    weight = np.array([1.0, gain])
    value = float(weight @ result.estimate[at])
    variance = float(weight @ result.covariance[np.ix_(at, at)] @ weight)
    half = NORMAL_95 * float(np.sqrt(max(variance, 0.0)))
    if not half < CARE_SHARE * abs(value):
        return ""
    sign = "-" if gain < 0.0 else "+"
    return f"{name} {sign} {abs(gain):.2g} {own} = {value:.4g} +- {half:.2g}"


def _entries(
    model: LinearModel, matrix: str, row: int, names: Sequence[str], signal: str
) -> list[str]:
    """Return the parameters at a signal's place in a row."""
    return [
        t.parameter
        for t in model.terms
        if (t.matrix, t.row) == (matrix, row) and names[t.column] == signal
    ]

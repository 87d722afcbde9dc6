"""A coefficient that a derivative became is marked by itself: mass, inertia and pressure are in its
interval too, so that it may be wider than the derivative, and it is never better known."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from host.aircraft.gains import dimensional_name
from host.sysid.answer.marks import MARKS, SMALL, Judged, mark_of
from host.sysid.models.diagnostics import reference_values

if TYPE_CHECKING:
    from host.sysid.linear.linear_answer import Answer


def converted_marks(answer: Answer, marks: Mapping[str, str]) -> dict[str, str]:
    """Return the mark of each coefficient of a linear answer: the worse of its derivative's and of
    what its own 95 % half-width allows.

    Parameters
    ----------
    answer : Answer
    marks : mapping
        Marks of the derivatives, by `judge`; a coefficient whose derivative has none has none.
    """
    found, shares = {}, converted_shares(answer)
    for c in answer.coefficients:
        behind = marks.get(dimensional_name(c.name), "")
        if behind:
            own = mark_of(Judged(c.name, shares[c.name]))
            found[c.name] = behind if behind == SMALL else max(behind, own, key=MARKS.index)
    return found


def converted_shares(answer: Answer) -> dict[str, float]:
    """Return the half-width of each coefficient over its value, or over what would contribute 5 %
    of its row."""
    result = answer.result
    sizes = reference_values(answer.model, answer.maneuvers, result.estimate)
    found = {}
    for c in answer.coefficients:
        at = result.index(dimensional_name(c.name))
        larger = max(float(sizes[at]) / max(abs(float(result.estimate[at])), 1e-300), 1.0)
        found[c.name] = c.half_width / max(larger * abs(c.value), 1e-300)
    return found

"""What rules and verdict read of an answer, whatever estimated it."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Protocol

if TYPE_CHECKING:
    from host.sysid.answer.marks import Judged
    from host.sysid.answer.trust_rules import Rule
    from host.sysid.checks.data_finding import Feedback, Finding
    from host.sysid.coefficients.coefficient_estimator import CoefficientAnswer
    from host.sysid.linear.linear_answer import Answer


class EstimateView(Protocol):
    """An answer as its verdict reads it: estimates, what each leans on, lines of its own."""

    @property
    def answer(self) -> Any:
        """What is judged, as its own rules read it."""

    @property
    def rules(self) -> Sequence[Rule]:
        """What may speak against its estimates, in order: one table."""

    @property
    def heading(self) -> str:
        """The model, its maneuvers and method."""

    @property
    def names(self) -> Sequence[str]:
        """Derivatives or coefficients in the model's order."""

    @property
    def estimates(self) -> Sequence[Judged]:
        """Each estimate by itself, without the doubts of the rules."""

    @property
    def values(self) -> Mapping[str, float]:
        """Estimates whose sign the house knows; none of a user's own model."""

    @property
    def explained(self) -> Collection[str]:
        """Names that have a line of their own, whatever is doubted."""

    def leaning_on(self, channel: str) -> Collection[str]:
        """Return the estimates that an error of a column makes wrong."""

    def alike(self, law: Feedback) -> Collection[str]:
        """Return the estimates that a feedback law makes alike."""

    def entangled(self, name: str) -> Collection[str]:
        """Return what a wrong estimate takes along: its row, and what correlates with it."""

    def first_lines(self) -> Sequence[str]:
        """Return the lines right behind the heading."""

    def width_lines(self, judged: Sequence[Judged]) -> Sequence[str]:
        """Return the lines on estimates that are too wide or small."""

    def further_lines(self, findings: Sequence[Finding]) -> Sequence[str]:
        """Return the lines behind the doubts: identifiability, inputs, prediction."""


def views_of(
    linear: Sequence[Answer], coefficients: CoefficientAnswer | None
) -> list[EstimateView]:
    """Return the view of each answer, those of linear models first.

    What reads a kind of answer is imported where there is one.
    """
    views: list[EstimateView] = []
    if linear:
        from host.sysid.answer.linear_view import LinearView

        views += [LinearView(answer) for answer in linear]
    if coefficients is not None:
        from host.sysid.answer.coefficient_view import CoefficientView

        views.append(CoefficientView(coefficients))
    return views

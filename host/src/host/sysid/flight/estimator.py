"""What an estimator is to the pipeline: four stages, each with its own result."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol, TypeVar

from host.sysid.flight.reconstructed_flight import ReconstructedFlight

E = TypeVar("E")
W = TypeVar("W")
V = TypeVar("V")
A = TypeVar("A", covariant=True)


class Estimator(Protocol[E, W, V, A]):
    """Estimation of one model from flights: a stage adds its part and changes no other's."""

    def estimate(self, flights: Sequence[ReconstructedFlight]) -> E:
        """Return the model, its estimate and the data it rests on."""
        ...

    def intervals(self, estimate: E, /) -> W:
        """Return the covariance from noise, scatter and every systematic error."""
        ...

    def validation(self, estimate: E, intervals: W, /) -> V:
        """Return how data that the estimate has not seen are predicted."""
        ...

    def answer(self, estimate: E, intervals: W, validation: V, /) -> A:
        """Return all parts as one answer, judged."""
        ...


def answer_of(estimator: Estimator[E, W, V, A], flights: Sequence[ReconstructedFlight]) -> A:
    """Run the stages of one estimator over some flights.

    Raises
    ------
    IdentificationError
        If the data do not allow the estimate.
    """
    estimate = estimator.estimate(flights)
    intervals = estimator.intervals(estimate)
    return estimator.answer(estimate, intervals, estimator.validation(estimate, intervals))

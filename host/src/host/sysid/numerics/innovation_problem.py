"""Innovations of a filter as a function of all unknowns: what filter error of any model searches.

The unknowns are those of the outputs, then the logarithms of the deviations of process noise, of
chosen states, and of measurement noise, of every output.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from host.arrays import Array, IntArray
from host.errors import IdentificationError
from host.sysid.numerics.output_error_problem import OutputProblem
from host.sysid.numerics.riccati import SteadyStateFilter


class Filtered(Protocol):
    """Innovations of one maneuver.

    Attributes
    ----------
    e : Array, shape (samples, p)
        Measured less predicted from the samples before, zero where nothing was measured.
    independent : Array, shape (samples, p)
        The same as the filter makes them: those of a sample may be taken in turn.
    white : Array, shape (samples, p)
        `independent` whitened.
    cost : float
        Negative log likelihood, up to a constant.
    """

    @property
    def e(self) -> Array: ...
    @property
    def independent(self) -> Array: ...
    @property
    def white(self) -> Array: ...
    @property
    def cost(self) -> float: ...

    def whitened(self, innovations: Array) -> Array:
        """Return innovations such as `independent` with unit variance."""


@dataclass(frozen=True, slots=True)
class InnovationLikelihood:
    """Result of the filter at one set of unknowns.

    Attributes
    ----------
    runs : sequence of Filtered
        Run of every maneuver.
    cost : float
        Negative log likelihood and prior, up to a constant.
    filters : sequence of SteadyStateFilter
        Filter of every maneuver of a linear model, all outputs measured.
    """

    runs: Sequence[Filtered]
    cost: float
    filters: Sequence[SteadyStateFilter] = ()

    @property
    def e(self) -> list[Array]:
        """Innovations of every maneuver, (samples, p)."""
        return [run.e for run in self.runs]

    def as_filtered(self, number: int) -> Array:
        """Return innovations of a maneuver as its filter makes them, (samples, p)."""
        return self.runs[number].independent

    def whitened(self, number: int, innovations: Array) -> Array:
        """Return innovations of a maneuver, those of `as_filtered`, with unit variance."""
        return self.runs[number].whitened(innovations)


@dataclass(frozen=True, slots=True)
class InnovationSlopes:
    """Slopes of one maneuver's innovations, and what their covariance says as well.

    Attributes
    ----------
    by_white : Array, shape (samples, p, k)
        Slopes of the whitened innovations, the whitener as it is.
    columns : IntArray, shape (k,)
        By which unknowns.
    information, score : Array, shape (shared, shared), (shared,)
        What the covariance of the innovations tells, and its share of the negative gradient.
    shared : IntArray, shape (shared,)
        Which unknowns it depends on.
    """

    by_white: Array
    columns: IntArray
    information: Array
    score: Array
    shared: IntArray


class InnovationProblem(ABC):
    """Innovations as a function of parameters, log process and log measurement deviations.

    Parameters
    ----------
    outputs : OutputProblem
        Problem of the model and its maneuvers.
    process : tuple of str
        States that white process noise drives.

    Raises
    ------
    IdentificationError
        If a state of `process` is none of the model.
    """

    def __init__(self, outputs: OutputProblem, process: tuple[str, ...]) -> None:
        model = outputs.model
        strangers = [s for s in process if s not in model.states]
        if strangers:
            raise IdentificationError(
                f"process noise on {', '.join(strangers)}; states are {', '.join(model.states)}"
            )
        self.output_problem = outputs
        self.model = model
        self.maneuvers = outputs.maneuvers
        self.process = process
        self.process_index = [model.states.index(s) for s in process]
        self.n_model = len(outputs.names)
        self.names = (
            *outputs.names,
            *(f"log_process.{s}" for s in process),
            *(f"log_noise.{y}" for y in model.outputs),
        )

    @abstractmethod
    def evaluate(self, theta: Array) -> InnovationLikelihood | None:
        """Return innovations and cost; None where the filter or the model fails."""

    @abstractmethod
    def slopes(self, theta: Array, point: InnovationLikelihood) -> list[InnovationSlopes]:
        """Return slopes of every maneuver's innovations, `point` being `evaluate(theta)`."""

    @abstractmethod
    def set_steps(self, bounds: Array) -> None:
        """Set the steps of differences from bounds of the model's unknowns, if there are any."""

    def noise(self, theta: Array) -> tuple[Array, Array]:
        """Return spectral density of every state's process noise and variance of every output."""
        split = self.n_model + len(self.process)
        intensity = np.zeros(len(self.model.states))
        with np.errstate(over="ignore"):
            intensity[self.process_index] = np.exp(2.0 * theta[self.n_model : split])
            return intensity, np.exp(2.0 * theta[split:])

    def columns(self, maneuver: int) -> IntArray:
        """Return which unknowns the innovations of a maneuver depend on."""
        noise = np.arange(self.n_model, len(self.names))
        return np.concatenate([self.output_problem.columns(maneuver), noise])

    def scoring(self, theta: Array, point: InnovationLikelihood) -> tuple[list[Array], list[Array]]:
        """Return Fisher information and negative gradient of the cost, per maneuver.

        With innovations nu of covariance S over N samples, M_ij = sum (d nu/d i)' S^-1 (d nu/d j) +
        N/2 tr(S^-1 dS/di S^-1 dS/dj); the gradient has the same two parts (EQUATIONS.md, eq. 32).

        Parameters
        ----------
        theta : Array, shape (P,)
        point : InnovationLikelihood
            At `theta`.

        Returns
        -------
        list of Array, shape (P, P)
            Information of every maneuver, without the prior.
        list of Array, shape (P,)
            Negative gradients.
        """
        parts: list[Array] = []
        scores: list[Array] = []
        for run, by in zip(point.runs, self.slopes(theta, point), strict=True):
            information, score = np.zeros((len(theta), len(theta))), np.zeros(len(theta))
            J = by.by_white.reshape(-1, len(by.columns))
            information[np.ix_(by.columns, by.columns)] = J.T @ J
            information[np.ix_(by.shared, by.shared)] += by.information
            score[by.columns] = -(J.T @ run.white.ravel())
            score[by.shared] += by.score
            parts.append(information)
            scores.append(score)
        return parts, scores

    def total(
        self, theta: Array, parts: Sequence[Array], scores: Sequence[Array]
    ) -> tuple[Array, Array]:
        """Return information and negative gradient of all maneuvers and the prior together."""
        outputs, n = self.output_problem, self.n_model
        information, gradient = np.sum(parts, axis=0), np.sum(scores, axis=0)
        information[:n, :n] += np.diag(outputs.prior_precision)
        gradient[:n] -= outputs.prior_precision * (theta[:n] - outputs.prior_mean)
        return information, gradient

    def whitened_slopes(self, theta: Array, point: InnovationLikelihood) -> list[Array]:
        """Return slopes of the whitened innovations of every maneuver, (samples, p, P)."""
        found: list[Array] = []
        for by in self.slopes(theta, point):
            whole = np.zeros((*by.by_white.shape[:2], len(theta)))
            whole[:, :, by.columns] = by.by_white
            found.append(whole)
        return found

    def likelihood(
        self,
        theta: Array,
        runs: Sequence[Filtered],
        filters: Sequence[SteadyStateFilter] = (),
    ) -> InnovationLikelihood | None:
        """Return what `evaluate` does of the runs of all maneuvers; None if it is not finite."""
        deviation = theta[: self.n_model] - self.output_problem.prior_mean
        cost = sum(run.cost for run in runs)
        cost += 0.5 * float(np.sum(self.output_problem.prior_precision * deviation**2))
        return InnovationLikelihood(runs, cost, filters) if np.isfinite(cost) else None

"""What the constants of a maneuver do to innovations of a filter, of its own model or another.

Constants are biases and initial states. Innovations are linear in them, so that this needs no value
of the data: only the filter, how long a maneuver is, and which samples were measured.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy import linalg

from host.arrays import Array
from host.sysid.models.maneuver import Maneuver
from host.sysid.models.state_space_model import LinearModel
from host.sysid.numerics.discretisation import discretise
from host.sysid.numerics.filter_problem import FilterProblem
from host.sysid.numerics.intermittent_filter import FilterEquations, filter_intermittent
from host.sysid.numerics.riccati import SteadyStateFilter, steady_state_filter
from host.sysid.numerics.sampled_model import SampledModel


@dataclass(frozen=True)
class FilterAt:
    """A steady filter, and of what: matrices of its model and variances of its outputs.

    Attributes
    ----------
    A, C : Array, shape (n, n), (p, n)
    variance : Array, shape (p,)
        Of the measurement noise.
    steady : SteadyStateFilter
    dt_s : float
    """

    A: Array
    C: Array
    variance: Array
    steady: SteadyStateFilter
    dt_s: float


def filters_at(problem: FilterProblem, theta: Array) -> dict[float, FilterAt]:
    """Return the filter of every sample period; none where it fails."""
    A, _, C, _ = problem.model.matrices(theta)
    intensity, variance = problem.noise(theta)
    found = {}
    for dt_s in set(problem.periods_s):
        steady = steady_state_filter(A, C, intensity, np.diag(variance), dt_s)
        if steady is not None:
            found[dt_s] = FilterAt(A, C, variance, steady, dt_s)
    return found


class FilterPair:
    """Whitened innovations of two filters where constants alone drive the model of the first.

    Parameters
    ----------
    model : LinearModel
        Says which states and outputs have constants.
    here, there : FilterAt
        The first, w being what it makes of such a record, and the second, w + dw.
    """

    def __init__(self, model: LinearModel, here: FilterAt, there: FilterAt) -> None:
        self._here = here, _response_to_constants(model, here, here)
        self._there = there, _response_to_constants(model, there, here)
        self._steady = _SteadySums(self._here, self._there)
        self._known: dict[int, tuple[Array, Array]] = {}

    def sums(self, maneuver: Maneuver) -> tuple[Array, Array] | None:
        """Return the sums of w' w and w' dw over a maneuver, (constants, constants) each; None if
        a filter fails.

        Sums of dw' dw would grow without end where the aircraft is unstable.
        """
        if maneuver.held:
            w, v = (_of_measured(q, maneuver) for _, q in (self._here, self._there))
            return None if w is None or v is None else (w.T @ w, w.T @ (v - w))
        if maneuver.samples not in self._known:
            self._known[maneuver.samples] = self._steady.over(maneuver.samples)
        return self._known[maneuver.samples]


def _response_to_constants(model: LinearModel, by: FilterAt, made: FilterAt) -> FilterEquations:
    """Return a filter of records that a model made from constants alone, with slopes by these.

    Its states are those of the filter less those of the record, then those of the record: where
    both models are the same, the latter have no effect, however fast they grow.
    """
    n, p, F = len(made.A), len(made.C), made.steady.F
    rates, places, starts = (
        np.eye(len(every))[:, [every.index(name) for name in own]]
        for every, own in (
            (model.states, model.state_biases),
            (model.outputs, model.output_biases),
            (model.states, model.initial_states),
        )
    )
    biases = rates.shape[1] + places.shape[1]
    total = biases + starts.shape[1]
    rise = _rise(made, rates)
    by_step, by_read = np.zeros((2 * n, 2 * n + 1, total)), np.zeros((p, 2 * n + 1, total))
    by_step[:, -1, : rates.shape[1]] = np.vstack([-rise, rise])
    by_read[:, -1, rates.shape[1] : biases] = -places
    by_start = np.zeros((2 * n, total))
    by_start[:, biases:] = np.vstack([-starts, starts])
    nothing = np.zeros((n, 1))
    still = SampledModel(
        step=np.block([[by.steady.F, by.steady.F - F, nothing], [np.zeros((n, n)), F, nothing]]),
        by_step=by_step,
        read=np.hstack([by.C, by.C - made.C, np.zeros((p, 1))]),
        by_read=by_read,
        start=np.zeros(2 * n),
        by_start=by_start,
    )
    Q, P = (linalg.block_diag(x, np.zeros((n, n))) for x in (by.steady.Q, by.steady.P))
    return FilterEquations.of_known_noise(still, Q, by.variance, P)


def _rise(made: FilterAt, rates: Array) -> Array:
    """Return what rates that are constant add to the states in a sample, (n, rates)."""
    n, count = rates.shape
    none = np.zeros(0, dtype=np.int64)
    AB = np.hstack([made.A, rates, np.zeros((n, 1))])
    step, _ = discretise(AB, n, count, False, made.dt_s, none, none, none, np.zeros(0), 0)
    return step[:, n:-1]


def _of_measured(equations: FilterEquations, maneuver: Maneuver) -> Array | None:
    """Return whitened innovations by the constants where samples are missing; None if it fails."""
    still = replace(maneuver, outputs=np.zeros_like(maneuver.outputs))
    run = filter_intermittent(equations, np.ones((maneuver.samples, 1)), still)
    return None if run is None else run.by_independent.reshape(-1, run.by_independent.shape[-1])


class _SteadySums:
    """Sums over the samples of what constants make two steady filters tell, by doubling."""

    def __init__(
        self, here: tuple[FilterAt, FilterEquations], there: tuple[FilterAt, FilterEquations]
    ) -> None:
        first, second = _steady_innovations(*here), _steady_innovations(*there)
        n, more, constants = len(here[0].A), len(second.step), first.constant.shape[1]
        # The record's states do nothing in the filter of the model that made it.
        transition = np.eye(n + more + constants)
        transition[: n + more, : n + more] = linalg.block_diag(first.step[:n, :n], second.step)
        transition[: n + more, n + more :] = np.vstack([first.constant[:n], second.constant])
        own = np.hstack([first.read[:, :n], np.zeros_like(second.read), first.direct])
        other = np.hstack([np.zeros((len(own), n)), second.read, second.direct])
        self._start = np.vstack(
            [here[1].model.by_start[:n], there[1].model.by_start, np.eye(constants)]
        )
        self._powers = [(own.T @ own, own.T @ (other - own), transition)]

    def over(self, samples: int) -> tuple[Array, Array]:
        """Return sums of w' w and of w' dw over so many samples, by the constants."""
        constants, so_far = self._start.shape[1], self._start
        total, change = np.zeros((2, constants, constants))
        with np.errstate(over="ignore", invalid="ignore"):  # of an aircraft that diverges
            for k in range(samples.bit_length()):
                if k == len(self._powers):
                    *both, step = self._powers[-1]
                    one, other = (x + step.T @ x @ step for x in both)
                    self._powers.append((one, other, step @ step))
                one, other, step = self._powers[k]
                if samples >> k & 1:
                    total = total + so_far.T @ one @ so_far
                    change = change + so_far.T @ other @ so_far
                    so_far = step @ so_far
        return total, change


@dataclass(frozen=True)
class _SteadyInnovations:
    """Next states by states and constants, whitened innovations by states and constants."""

    step: Array
    constant: Array
    read: Array
    direct: Array


def _steady_innovations(by: FilterAt, equations: FilterEquations) -> _SteadyInnovations:
    model = equations.model
    gain = np.zeros((len(model.start), len(by.C)))
    gain[: len(by.A)] = by.steady.F @ by.steady.K
    read, by_constant = model.read[:, :-1], model.by_read[:, -1]
    return _SteadyInnovations(
        step=model.step[:, :-1] - gain @ read,
        constant=model.by_step[:, -1] - gain @ by_constant,
        read=-by.steady.whitener @ read,
        direct=-by.steady.whitener @ by_constant,
    )

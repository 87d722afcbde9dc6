"""Innovations of a linear model's Kalman filter, with exact slopes by all unknowns.

Where every output is measured at every sample the gain is the steady one; else the filter follows
what was measured, and begins as if all outputs had been measured before the first sample.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from host.arrays import Array, IntArray
from host.errors import IdentificationError
from host.sysid.models.maneuver import Maneuver
from host.sysid.models.state_space_model import LinearModel
from host.sysid.numerics.discretisation import discretise
from host.sysid.numerics.innovation_problem import (
    Filtered,
    InnovationLikelihood,
    InnovationProblem,
    InnovationSlopes,
)
from host.sysid.numerics.intermittent_filter import FilterEquations, filter_intermittent
from host.sysid.numerics.output_error_problem import OutputProblem
from host.sysid.numerics.process_noise import halvings_of, van_loan
from host.sysid.numerics.recursion import propagate
from host.sysid.numerics.riccati import (
    SteadyInnovations,
    SteadyStateFilter,
    filter_innovations,
    steady_state_filter,
)
from host.sysid.numerics.sampled_model import SampledModel

SAME_PERIOD = 1e-9


class FilterProblem(InnovationProblem):
    """Innovations of a linear model.

    Parameters
    ----------
    model : LinearModel
        Without delays.
    maneuvers : sequence of Maneuver
    process : tuple of str
        States that white process noise drives.

    Raises
    ------
    IdentificationError
        If the model has delays or a state of `process` is not its own.
    """

    def __init__(
        self, model: LinearModel, maneuvers: Sequence[Maneuver], process: tuple[str, ...]
    ) -> None:
        if model.delays:
            raise IdentificationError(
                "filter error has no delays: estimate them by output error and shift the data"
            )
        super().__init__(OutputProblem(model, maneuvers), process)
        self.periods_s = _periods_s([m.dt_s for m in maneuvers])

    def sampled(self, maneuver: int, theta: Array) -> SampledModel:
        """Return the model over one sample of a maneuver, its slopes by `columns`."""
        found = self.output_problem.sampled(maneuver, theta)
        return found.padded(len(self.names) - self.n_model)

    def evaluate(self, theta: Array) -> InnovationLikelihood | None:
        """Return innovations and cost; None where the filter or the model fails.

        The cost is J = 1/2 sum nu' S^-1 nu + N/2 ln det S over the innovations nu of N samples
        (EQUATIONS.md, eq. 31), plus the prior.
        """
        A, _, C, _ = self.model.matrices(theta)
        intensity, power = self.noise(theta)
        if not (np.isfinite(intensity).all() and np.isfinite(power).all()):
            return None
        of_period: dict[float, SteadyStateFilter] = {}
        runs: list[Filtered] = []
        for number, period_s in enumerate(self.periods_s):
            steady = of_period.get(period_s) or steady_state_filter(
                A, C, intensity, np.diag(power), period_s
            )
            if steady is None:
                return None
            of_period[period_s] = steady
            run = self._filtered(number, theta, steady)
            if run is None:
                return None
            runs.append(run)
        return self.likelihood(theta, runs, [of_period[period_s] for period_s in self.periods_s])

    def _filtered(self, number: int, theta: Array, steady: SteadyStateFilter) -> Filtered | None:
        """Run the filter over a maneuver; None if it fails."""
        maneuver, drive = self.maneuvers[number], self.output_problem.drive(number)
        model = self.output_problem.sampled(number, theta, slopes=False)
        if not maneuver.held:
            return filter_innovations(model, steady, drive, maneuver.outputs)
        power = self.noise(theta)[1]
        equations = FilterEquations.of_known_noise(model, steady.Q, power, steady.P)
        return filter_intermittent(equations, drive, maneuver)

    def slopes(self, theta: Array, point: InnovationLikelihood) -> list[InnovationSlopes]:
        """Return slopes of every maneuver's innovations.

        Raises
        ------
        IdentificationError
            If the filter fails with slopes where it did not without.
        """
        n, common = len(self.model.states), self.output_problem.n_common
        of_period: dict[float, GainSensitivities] = {}
        found = []
        for number, period_s in enumerate(self.periods_s):
            run, steady, model = (
                point.runs[number],
                point.filters[number],
                self.sampled(number, theta),
            )
            if period_s not in of_period:
                of_period[period_s] = gain_sensitivities(
                    self, theta, steady, period_s, model.by_read[:, :n, :common]
                )
            by = of_period[period_s]
            found.append(
                self._steady_slopes(number, model, run, by)
                if isinstance(run, SteadyInnovations)
                else self._sequential_slopes(number, theta, steady, by)
            )
        return found

    def set_steps(self, bounds: Array) -> None:
        """Do nothing: slopes of a linear model are exact."""

    def _sequential_slopes(
        self, number: int, theta: Array, steady: SteadyStateFilter, by: GainSensitivities
    ) -> InnovationSlopes:
        """Return those of a maneuver with missing outputs, its own constants last: they move its
        states alone."""
        outputs, active = self.output_problem, self.columns(number)
        constants = outputs.n_common + np.arange(outputs.n_local)
        own = np.concatenate([np.delete(np.arange(len(active)), constants), constants])
        Q_slopes, P_slopes = (np.ascontiguousarray(x.transpose(1, 2, 0)) for x in (by.Q, by.P))
        equations = FilterEquations(
            model=self.sampled(number, theta).by(own),
            Q=steady.Q,
            Q_slopes=Q_slopes,
            variance=self.noise(theta)[1],
            P=steady.P,
            P_slopes=P_slopes,
        )
        run = filter_intermittent(equations, outputs.drive(number), self.maneuvers[number])
        if run is None:  # it ran at this very point without slopes
            raise IdentificationError(f"model {self.model.name}: the Kalman filter has no slopes")
        return run.slopes(active[own])

    def _steady_slopes(
        self, number: int, model: SampledModel, run: SteadyInnovations, by: GainSensitivities
    ) -> InnovationSlopes:
        """Return those of a maneuver that is measured at every sample."""
        n, p = len(self.model.states), len(self.model.outputs)
        steady, common = run.steady, self.output_problem.n_common
        direct = model.by_read.transpose(1, 0, 2)
        w, width = model.step.shape[1] - n, model.by_start.shape[1]
        noise = slice(common + self.output_problem.n_local, width)
        drive = np.zeros((n + w + p, n, width))
        FK = steady.F @ steady.K
        drive[: n + w] = model.by_step.transpose(1, 0, 2) - FK @ direct
        drive[n + w :, :, :common] = np.einsum(
            "iaq,aj->jiq", model.by_step[:, :n, :common], steady.K
        )
        for part, own in ((slice(0, common), slice(0, common)), (noise, slice(common, None))):
            drive[n + w :, :, part] += np.einsum("ia,qaj->jiq", steady.F, by.K[own])
        samples = len(run.z)
        out = np.empty((p, samples, width))
        F, C, start = steady.F - FK @ model.C, steady.whitener @ model.C, model.by_start
        propagate(F, drive.transpose(1, 0, 2), run.z, C, start, out)
        # Direct part at a fixed state; the rest comes through the state.
        known_state = -(steady.whitener @ direct).reshape(n + w, -1)
        by_white = (run.z[:, : n + w] @ known_state).reshape(samples, p, width)
        by_white -= out.transpose(1, 0, 2)
        # The gain depends only on the unknowns that all maneuvers share.
        spread = steady.whitener @ by.S @ steady.whitener.T
        trace, outer = np.trace(spread, axis1=1, axis2=2), run.white.T @ run.white
        flat = spread.reshape(len(spread), -1)
        return InnovationSlopes(
            by_white=by_white,
            columns=self.columns(number),
            information=0.5 * samples * (flat @ flat.T),
            score=-0.5 * (samples * trace - np.sum(spread * outer, axis=(1, 2))),
            shared=self._shared(),
        )

    def _shared(self) -> IntArray:
        common = np.arange(self.output_problem.n_common)
        return np.concatenate([common, np.arange(self.n_model, len(self.names))])


def _periods_s(steps_s: Sequence[float]) -> list[float]:
    """Return the sample period of each maneuver: rounding of the clock gives one several values."""
    found: list[float] = []
    for step_s in steps_s:
        near = [t for t in found if abs(t - step_s) < SAME_PERIOD * t]
        found.append(near[0] if near else step_s)
    return found


@dataclass(frozen=True, slots=True)
class GainSensitivities:
    """Derivatives of S (shared, p, p), K (shared, n, p), P and Q (shared, n, n) by the unknowns all
    maneuvers share."""

    S: Array
    K: Array
    P: Array
    Q: Array


def gain_sensitivities(
    problem: InnovationProblem,
    theta: Array,
    gain: SteadyStateFilter,
    dt_s: float,
    C_slopes: Array,
) -> GainSensitivities:
    """Return derivatives of the filter at one sample period; `C_slopes` (p, n, common) of C.

    The Riccati equation in Joseph's form, P = F (I - K C) P (I - K C)' F' + F K R K' F' + Q, does
    not depend on the gain to first order. The derivative of P therefore obeys the Lyapunov equation
    dP = A_c dP A_c' + X with A_c = F (I - K C), one for all unknowns (EQUATIONS.md, eq. 33).
    """
    A, _, C, _ = problem.model.matrices(theta)
    n, p = len(A), len(C)
    common, process = problem.output_problem.n_common, len(problem.process)
    count = common + process + p
    intensity, power = problem.noise(theta)
    F, Q = _noise_sensitivities(problem, A, intensity, dt_s)
    dC = np.zeros((count, p, n))
    dC[:common] = C_slopes.transpose(2, 0, 1)
    dR = np.zeros((count, p, p))
    dR[common + process + np.arange(p), np.arange(p), np.arange(p)] = 2.0 * power
    dF, dQ = np.zeros((2, count, n, n))
    dF[: common + process], dQ[: common + process] = F, Q
    reduction = np.eye(n) - gain.K @ C
    updated = reduction @ gain.P  # covariance after the measurement update
    closed = gain.F @ reduction
    change = dF @ updated @ gain.F.T - closed @ gain.P @ dC.transpose(0, 2, 1) @ gain.K.T @ gain.F.T
    change = change + change.transpose(0, 2, 1)
    change += dQ + gain.F @ gain.K @ dR @ gain.K.T @ gain.F.T
    system = np.eye(n * n) - np.kron(closed, closed)
    dP = np.linalg.solve(system, change.reshape(count, n * n).T).T.reshape(count, n, n)
    across = dC @ gain.P @ C.T
    dS = across + across.transpose(0, 2, 1) + C @ dP @ C.T + dR
    inverse = gain.whitener.T @ gain.whitener
    dK = (dP @ C.T + gain.P @ dC.transpose(0, 2, 1) - gain.K @ dS) @ inverse
    return GainSensitivities(dS, dK, dP, dQ)


def _noise_sensitivities(
    problem: InnovationProblem, A: Array, intensity: Array, dt_s: float
) -> tuple[Array, Array]:
    """Return derivatives of F and Q of a sample, each (common and process, n, n)."""
    n, halvings = len(A), halvings_of(A, dt_s)
    entries, common = problem.model.entries("AB"), problem.output_problem.n_common
    own = entries.column < n
    row, column, parameter = entries.row[own], entries.column[own], entries.parameter[own]
    gain, driven_states = entries.gain[own], np.array(problem.process_index, dtype=np.int64)
    E, slopes = discretise(
        van_loan(A, intensity),
        2 * n,
        0,
        False,
        dt_s / 2.0**halvings,
        np.concatenate([row, n + column, driven_states]),
        np.concatenate([column, n + row, n + driven_states]),
        np.concatenate([parameter, parameter, common + np.arange(len(driven_states))]),
        np.concatenate([-gain, gain, 2.0 * intensity[driven_states]]),
        common + len(driven_states),
    )
    slopes = slopes.transpose(2, 0, 1)
    F, dF = E[n:, n : 2 * n].T, slopes[:, n:, n : 2 * n].transpose(0, 2, 1)
    Q, dQ = F @ E[:n, n : 2 * n], dF @ E[:n, n : 2 * n] + F @ slopes[:, :n, n : 2 * n]
    for _ in range(halvings):
        one_side = dF @ (Q @ F.T)
        dQ = dQ + one_side + one_side.transpose(0, 2, 1) + F @ dQ @ F.T
        Q, dF, F = Q + F @ Q @ F.T, dF @ F + F @ dF, F @ F
    return dF, 0.5 * (dQ + dQ.transpose(0, 2, 1))

"""One Gauss-Newton step of an estimate's own method, for other data or another model.

Residuals are those of the method: innovations of filter error, outputs of output error, both
whitened. No fit is repeated (one-step estimators: van der Vaart, Asymptotic Statistics, sec. 5.7).
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass

import numpy as np

from host.arrays import Array, BoolArray, IntArray
from host.sysid.estimators.gust_model import driven_model
from host.sysid.estimators.innovations import Innovations, driven_states, innovations_of
from host.sysid.models.fit_result import FitResult
from host.sysid.models.maneuver import Maneuver
from host.sysid.models.state_space_model import LinearModel
from host.sysid.models.templates import Trim
from host.sysid.numerics.model_problems import output_problem
from host.sysid.numerics.output_error_problem import OutputProblem

SINGULAR = 1e-12  # of the largest eigenvalue of the scaled information
HALF_WAY = 0.5  # from one model or data to another: beyond it the record is nearer to the other
CERTAIN_SD = 2.0  # deviations
# Times the variance without other unknowns: beyond it nothing tells a parameter from another one.
MOST_INFLATED = 1e6

Residuals = Callable[[LinearModel, Trim, Sequence[Maneuver]], "list[Array] | None"]


@dataclass(frozen=True)
class Step:
    """A step of the estimate and of further parameters with it.

    Attributes
    ----------
    shares : Array, shape (maneuvers, P)
        Shift of the estimate by each maneuver.
    added : Array, shape (k,)
        Values of the further parameters.
    covariance : Array, shape (k, k)
    by_added : Array, shape (k, P)
        Sensitivity of the estimate to each.
    """

    shares: Array
    added: Array
    covariance: Array
    by_added: Array


@dataclass(frozen=True)
class OneStep:
    """Residuals, slopes and information at an answer, for one step about it.

    Attributes
    ----------
    residuals : callable
        Whitened residuals of each maneuver for a model about a trim, (samples p,); None if the
        model diverges.
    reference : list of Array
        The same at the answer.
    slopes : list of Array, each (samples p, own)
        Slopes of the residuals by the unknowns of each maneuver.
    columns : list of IntArray, each (own,)
        Where those stand among all unknowns.
    inverse : Array, shape (T, T)
        Inverse of the information on all unknowns.
    source, target : IntArray
        Which unknown is which entry of the estimate.
    length : int
        P, entries of the estimate.
    """

    residuals: Residuals
    reference: list[Array]
    slopes: list[Array]
    columns: list[IntArray]
    inverse: Array
    source: IntArray
    target: IntArray
    length: int

    def change(self, model: LinearModel, trim: Trim, changed: Sequence[Maneuver]) -> Array:
        """Return the share of each maneuver in the change of the estimate, (maneuvers, P).

        Zero if the model diverges.
        """
        return self.joint(model, trim, changed, ()).shares

    def joint(
        self,
        model: LinearModel,
        trim: Trim,
        changed: Sequence[Maneuver],
        extended: Sequence[tuple[LinearModel, Sequence[Maneuver]]],
        prior_sd: Sequence[float] = (),
    ) -> Step:
        """Return the step for a new model and data, and further parameters estimated along.

        Parameters
        ----------
        model : LinearModel
            With the further parameters at zero.
        trim : Trim
        changed : sequence of Maneuver
        extended : sequence of (LinearModel, sequence of Maneuver)
            Model and data with each of them at one; the residuals must be linear in them.
        prior_sd : sequence of float
            Prior deviation of each, about zero.
        """
        count = len(extended)
        none = np.zeros((count, self.length))
        here = self.residuals(model, trim, changed)
        if here is None:
            shares = np.zeros((len(changed), self.length))
            return Step(shares, np.zeros(count), np.zeros((count, count)), none)
        changed_residuals = [self.residuals(one, trim, data) for one, data in extended]
        score = np.zeros((len(changed), len(self.inverse)))
        link = np.zeros((len(changed), len(self.inverse), count))
        prior = np.diag(np.asarray(prior_sd, dtype=np.float64) ** -2.0)
        normal: Array = np.zeros((count, count))
        right: Array = np.zeros(count)
        for k, (r, before) in enumerate(zip(here, self.reference, strict=True)):
            own, J = self.columns[k], self.slopes[k]
            score[k, own] = -(J.T @ (r - before))
            if count:
                by = np.column_stack([r - r if b is None else b[k] - r for b in changed_residuals])
                link[k, own] = J.T @ by
                normal += by.T @ by
                right -= by.T @ r
        step = score @ self.inverse
        added: Array = np.zeros(count)
        covariance: Array = np.zeros((count, count))
        # Minus inverse times cross information: the consider sensitivity (Tapley, Schutz & Born,
        # Statistical Orbit Determination, ch. 6).
        consider_sensitivity = -np.einsum("kij,il->klj", link, self.inverse)
        if count:
            whole = link.sum(axis=0)
            information = _not_negative(normal - whole.T @ self.inverse @ whole)
            covariance = np.linalg.pinv(prior + information, hermitian=True)
            added = covariance @ (right - whole.T @ step.sum(axis=0))
            step = step + consider_sensitivity @ added
        sensitivity = self._placed(consider_sensitivity.sum(axis=0).T)
        return Step(self._placed(step), added, covariance, sensitivity)

    def share_of(
        self,
        other: tuple[LinearModel, Sequence[Maneuver]],
        result: FitResult,
        trim: Trim,
        data: Sequence[Maneuver],
        prior_sd: float,
    ) -> tuple[float, float]:
        """Return how far a record goes from its model and data to others, and one deviation.

        Parameters
        ----------
        other : LinearModel and sequence of Maneuver
            All the way there.
        result : FitResult
            Its model is where the way begins.
        trim : Trim
        data : sequence of Maneuver
            Where the way begins.
        prior_sd : float
            About zero.
        """
        wider = self.widened_in(result)
        step = self.joint(result.model, trim, data, [other], [prior_sd / wider])
        return float(step.added[0]), wider * float(np.sqrt(step.covariance[0, 0]))

    def widened_in(self, result: FitResult) -> float:
        """Return by how much the intervals of a result are wider than white noise makes them: the
        most of all, at least one.

        Both variances of parameters that nothing tells apart are made by rounding. Two of them may
        say a factor of 980 000, and what lies between samples would widen Cm_q from 1 to 34 per
        cent.
        """
        bare, information = np.zeros(self.length), np.zeros(self.length)
        bare[self.target] = np.diag(self.inverse)[self.source]
        alone = np.zeros(len(self.inverse))
        for J, own in zip(self.slopes, self.columns, strict=True):
            alone[own] += np.sum(J[:, : len(own)] ** 2, axis=0)
        information[self.target] = alone[self.source]
        apart = result.standard_error**2 * information < MOST_INFLATED
        known = apart & (bare > 0.0) & (result.standard_error > 0.0)
        return float(np.max(result.standard_error[known] / np.sqrt(bare[known]), initial=1.0))

    def _placed(self, unknowns: Array) -> Array:
        """Return rows of all unknowns as rows of the estimate."""
        result = np.zeros((len(unknowns), self.length))
        result[:, self.target] = unknowns[:, self.source]
        return result


def one_step_of(
    result: FitResult, maneuvers: Sequence[Maneuver], trim: Trim, loose: Collection[str] = ()
) -> OneStep | None:
    """Return the step of the method that made a result; None if it has none, or fails there.

    Unknowns of output error that sit on a bound stay there, but for those that are `loose`.
    """
    if result.residual_kind == "innovation":
        # A filter whose noise is no parameter of it, as Kalman filters with joint states, has none.
        return _of_innovations(result, maneuvers, trim) if driven_states(result) else None
    return _of_outputs(result, maneuvers, loose)


def _of_innovations(result: FitResult, maneuvers: Sequence[Maneuver], trim: Trim) -> OneStep | None:
    process = driven_states(result)

    def filtered(model: LinearModel, at: Trim) -> LinearModel:
        return driven_model(model, process, at.airspeed_mps)

    found = innovations_of(result, filtered(result.model, trim), maneuvers)
    if found is None:
        return None
    every = np.arange(len(found.theta))

    def residuals(model: LinearModel, bent: Trim, data: Sequence[Maneuver]) -> list[Array] | None:
        e = found.innovations(filtered(model, bent), data)
        return None if e is None else _whitened(e, found)

    return OneStep(
        residuals=residuals,
        reference=_whitened(found.e, found),
        slopes=[s.reshape(-1, s.shape[-1]) for s in found.sensitivities],
        columns=[every] * len(found.e),
        inverse=found.inverse,
        source=every,
        target=every,
        length=len(every),
    )


def _whitened(residuals: Sequence[Array], found: Innovations) -> list[Array]:
    return [found.whiten(k, e).ravel() for k, e in enumerate(residuals)]


def _of_outputs(
    result: FitResult, maneuvers: Sequence[Maneuver], loose: Collection[str]
) -> OneStep | None:
    problem = output_problem(result.model, maneuvers)
    theta = problem.first_guess()
    place = {n: k for k, n in enumerate(result.names)}
    known = [(k, place[n]) for k, n in enumerate(problem.names) if n in place]
    for k, source in known:
        theta[k] = result.estimate[source]
    responses = problem.respond(theta)
    if responses is None:
        return None
    left = [problem.residual(k, r.y) for k, r in enumerate(responses)]
    power = np.sum([np.sum(e**2, axis=1) for e in left], axis=0)
    weight = np.sqrt(problem.counts / np.maximum(power, 1e-300))
    slopes = [
        np.concatenate([w * J for w, J in zip(weight, r.sensitivities, strict=True)])
        for r in responses
    ]
    H = _information(problem, slopes)
    if not np.isfinite(H).all():
        return None
    on_bound = (theta <= problem.lower) | (theta >= problem.upper)

    def residuals(model: LinearModel, _: Trim, data: Sequence[Maneuver]) -> list[Array] | None:
        other = output_problem(model, data)
        simulated = other.outputs(theta)
        if simulated is None:
            return None
        return [-(weight[:, None] * other.residual(k, y)).ravel() for k, y in enumerate(simulated)]

    return OneStep(
        residuals=residuals,
        reference=[-(weight[:, None] * e).ravel() for e in left],
        slopes=slopes,
        columns=[problem.columns(k) for k in range(len(slopes))],
        inverse=_inverse_within(H, on_bound & ~np.isin(problem.names, list(loose))),
        source=np.array([k for k, _ in known], dtype=np.int64),
        target=np.array([k for _, k in known], dtype=np.int64),
        length=len(result.names),
    )


def _information(problem: OutputProblem, slopes: Sequence[Array]) -> Array:
    """Return the information on all unknowns, what is known beforehand with it, (T, T)."""
    H = np.diag(problem.prior_precision)
    for k, J in enumerate(slopes):
        own = problem.columns(k)
        H[np.ix_(own, own)] += J.T @ J
    return H


def _inverse_within(H: Array, held: BoolArray) -> Array:
    """Return the inverse of the information; what sits on a bound stays there."""
    H = H.copy()
    H[held], H[:, held] = 0.0, 0.0
    size = np.where(held, 1.0, np.sqrt(np.maximum(np.diag(H), 1e-300)))
    inverse = np.linalg.pinv(H / np.outer(size, size), rcond=SINGULAR, hermitian=True)
    inverse /= np.outer(size, size)
    inverse[held], inverse[:, held] = 0.0, 0.0  # not rounding: a bound stays one
    return np.asarray(inverse)


def _not_negative(information: Array) -> Array:
    """Return what data say with other unknowns free: where those explain all, rounding made it less
    than nothing."""
    size, axes = np.linalg.eigh(information)
    if size.min(initial=0.0) >= 0.0:
        return information
    return np.asarray((axes * np.maximum(size, 0.0)) @ axes.T)

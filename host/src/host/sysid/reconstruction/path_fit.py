"""Estimate sensor errors along a flight path in gusts by instrumental variables.

Vanes and pitot measure gusts, and shortly after so do the accelerometers that predict them. Least
squares takes an aircraft that rides with slow gusts for vanes that under-read: by half in light
turbulence if residuals are taken as white, by 6 % if they are modelled as autoregressive. The
sensitivities of air data are therefore replaced by their projection on the control surfaces, which
are independent of gusts. AR models whiten the residuals.

So many lags fit a part of the gusts, too: two-stage least squares leans to least squares by the
share of instruments among the samples, 6 % here. As much of what the projection leaves is taken
off again, so that gusts weigh nothing on average (Nagar, Econometrica 27, 1959, p. 575; Donald &
Newey, Econometrica 69, 2001, p. 1161).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from host.arrays import Array
from host.constants import DRIFT_POWERS
from host.errors import IdentificationError
from host.sysid.numerics.ar_noise import ArNoise, fit_ar, lagged_moments
from host.sysid.numerics.simulator import Response
from host.sysid.reconstruction.flight_path import (
    AIR,
    DELAY_DIFFERENCE,
    DELAYS,
    FLOW,
    GPS,
    PITOT,
    PLACES,
    PathProblem,
)

AR_ORDER = 2  # of the residuals: a gust and a sensor
MOST_ITERATIONS = 25
ADAPT_FROM = 2  # iteration from which residuals are modelled
# Iterations after which AR models and instruments stay, so that the equations can settle.
ADAPTING_ITERATIONS = 4
# A second search follows if the first does not converge: errors twice those of a calibrated
# instrument leave residuals at iteration 2 that no AR model fits (3 of 12 flights). It first
# estimates the errors of inertial sensors and GPS, with air data nearly fixed to their calibration,
# because without instruments gusts would bias them.
PLAIN_ITERATIONS = 25  # most of these iterations; a step is halved until the cost falls
HALVINGS = 5
PLAIN_STEP_LIMIT = 3.0  # of a standard error: they end
AIR_PRIOR_WEIGHT = 1e4  # times the prior precision
AIR_ERRORS = (*FLOW, *PITOT, *DELAYS, DELAY_DIFFERENCE, *PLACES)
STEP_LIMIT = 0.05  # of a standard error: convergence
RIDGE = 1e-10  # of a column's power: a surface that never moved has none
LARGEST_STEP = 4.0  # in prior deviations
# Curvature that the equations leave out turns some steps back, each as long as the one before: two
# points change for ever (4 of 34 right records in gusts). As soon as AR models and instruments
# stay, a step is as long as the last one should have been to leave nothing along it (Irons & Tuck,
# Int. J. Numerical Methods in Engineering 1, 1969, p. 275).
SHORTEST = 0.125  # of a step


@dataclass(frozen=True)
class PathFit:
    """Estimate, covariance, residuals of a reconstruction."""

    theta: Array
    covariance: Array
    residuals: Sequence[Array]
    iterations: int
    converged: bool


def fit_path(problem: PathProblem, lagged_inputs: Sequence[Array]) -> PathFit:
    """Solve the instrumental-variable equations (Z'J + P0^-1) step = Z'e + P0^-1 (mean - theta).

    e are whitened residuals, J their sensitivities, Z the instruments and P0 the prior covariance;
    the covariance of the estimate is H^-1 (Z'Z + P0^-1) H^-T with H = Z'J + P0^-1 (EQUATIONS.md,
    eq. 18).

    Parameters
    ----------
    problem : PathProblem
    lagged_inputs : sequence of Array, shape (blocks, columns)
        Surfaces of each segment at several lags; without columns it is ordinary least squares.

    Raises
    ------
    IdentificationError
        If the path is not finite at some step or the equations are singular.
    """
    found = _search(problem, lagged_inputs, patience=0)
    return found if found.converged else _search(problem, lagged_inputs, patience=PLAIN_ITERATIONS)


def _search(problem: PathProblem, lagged_inputs: Sequence[Array], patience: int) -> PathFit:
    """Iterate to convergence, the first `patience` times with air data held to the prior."""
    theta = problem.start.copy()
    noise = [ArNoise.white() for _ in problem.model.outputs]
    instruments: dict[int, list[Array]] = {}
    air = np.isin(problem.names, AIR_ERRORS)
    converged, near = False, False
    length, last = 1.0, np.zeros(len(theta))
    iteration = 0
    origin, least_cost, halvings = theta, np.inf, 0
    constrained, adapt_from = bool(patience), max(patience, ADAPT_FROM)
    while True:
        responses, residuals = _residuals(problem, theta)
        precision = problem.prior_precision.copy()
        if constrained:
            precision[air] *= AIR_PRIOR_WEIGHT
            cost = _negative_log_likelihood(problem, residuals, theta, precision)
            if cost > least_cost and halvings < HALVINGS:
                theta, halvings = 0.5 * (theta + origin), halvings + 1
                continue
            origin, least_cost, halvings = theta, cost, 0
        if constrained and (near or iteration == patience):
            precision = problem.prior_precision
            constrained, adapt_from = False, max(iteration, ADAPT_FROM)
        adapting = adapt_from <= iteration < adapt_from + ADAPTING_ITERATIONS
        adapted_to = None
        if adapting:
            noise = _fit_ar_noises(problem, residuals)
            adapted_to = lagged_inputs
        rows = _rows(problem, responses, residuals, noise, instruments, adapted_to)
        inverse, g = _solved(problem, theta, precision, rows)
        if converged or iteration == MOST_ITERATIONS + patience:
            covariance = _covariance(problem, inverse, rows)
            return PathFit(theta, covariance, residuals, iteration, converged)
        step = inverse @ g
        error_size = np.sqrt(np.maximum(np.abs(np.diag(inverse)), 1e-300))
        largest = float(np.max(np.abs(step) / error_size))
        now = step / error_size
        if iteration > adapt_from + ADAPTING_ITERATIONS:
            length = _length(length, last, now)
        last = now
        theta = theta + length * _limited(step, problem.prior_precision)
        iteration += 1
        near = largest < PLAIN_STEP_LIMIT
        converged = largest < STEP_LIMIT and not constrained and iteration > adapt_from + 1


def _residuals(problem: PathProblem, theta: Array) -> tuple[list[Response], list[Array]]:
    """Return responses and residuals of every segment; refuse a path that is not finite."""
    responses = problem.respond(theta)
    if responses is None:
        raise IdentificationError("data compatibility: the flight path is not finite")
    return responses, [problem.measured(k) - r.y for k, r in enumerate(responses)]


def _rows(
    problem: PathProblem,
    responses: Sequence[Response],
    residuals: Sequence[Array],
    noise: Sequence[ArNoise],
    instruments: dict[int, list[Array]],
    adapted_to: Sequence[Array] | None,
) -> list[tuple[Array, Array, Array]]:
    """Return whitened residuals, instruments and sensitivities of every segment.

    `instruments` are those of the outputs of air data; made anew of inputs `adapted_to`, if given.
    Without inputs it is least squares, by the slopes of each step: a tilt of the IMU and of every
    attitude leave so little of each other that slopes of another step stand across it.
    """
    parts: list[tuple[list[Array], list[Array], list[Array]]] = [([], [], []) for _ in responses]
    for j, name in enumerate(problem.model.outputs):
        white = [noise[j].whiten(r[j][:, None])[:, 0] for r in residuals]
        slope = [noise[j].whiten(r.sensitivities[j]) for r in responses]
        variance = float(np.sum(np.concatenate(white) ** 2)) / problem.counted(name)
        deviation = np.sqrt(max(variance, 1e-300))
        if adapted_to is not None and adapted_to[0].shape[1] and name in AIR:
            instruments[j] = _instruments(problem, slope, adapted_to, noise[j])
        for into, of_segment in zip(
            parts, zip(white, instruments.get(j, slope), slope, strict=True), strict=True
        ):
            for one, part in zip(into, of_segment, strict=True):
                one.append(part / deviation)
    return [(np.concatenate(e), np.concatenate(Z), np.concatenate(J)) for e, Z, J in parts]


def _solved(
    problem: PathProblem,
    theta: Array,
    precision: Array,
    rows: Sequence[tuple[Array, Array, Array]],
) -> tuple[Array, Array]:
    """Return the inverse of H = Z'J + P0^-1, and the right side; refuse singular equations."""
    H = np.diag(precision)
    g = precision * (problem.prior_mean - theta)
    for k, (e, Z, J) in enumerate(rows):
        own = problem.columns(k)
        H[np.ix_(own, own)] += Z.T @ J
        g[own] += Z.T @ e
    size = np.sqrt(np.maximum(np.abs(np.diag(H)), 1e-300))
    try:
        return np.linalg.inv(H / np.outer(size, size)) / np.outer(size, size), g
    except np.linalg.LinAlgError as error:
        raise IdentificationError("data compatibility: singular equations") from error


def _covariance(
    problem: PathProblem, inverse: Array, rows: Sequence[tuple[Array, Array, Array]]
) -> Array:
    """Return H^-1 (Z'Z + P0^-1) H^-T."""
    B = np.diag(problem.prior_precision)
    for k, (_, Z, _) in enumerate(rows):
        own = problem.columns(k)
        B[np.ix_(own, own)] += Z.T @ Z
    covariance = inverse @ B @ inverse.T
    return np.asarray(0.5 * (covariance + covariance.T))


def _limited(step: Array, prior_precision: Array) -> Array:
    """Return a step that is no longer than priors let it be."""
    with np.errstate(divide="ignore"):
        most = LARGEST_STEP / np.sqrt(prior_precision)
    return np.asarray(np.clip(step, -most, most))


def _length(length: float, last: Array, step: Array) -> float:
    """Return the length of a step from that of the last, both in standard errors."""
    turned = float(last @ (last - step)) / float(last @ last)
    return min(max(length / turned, SHORTEST), 1.0) if turned > 0.0 else 1.0


def _negative_log_likelihood(
    problem: PathProblem, residuals: Sequence[Array], theta: Array, precision: Array
) -> float:
    """Return twice the negative log likelihood of white residuals and the prior."""
    squares = np.sum(np.hstack(residuals) ** 2, axis=1)
    counts = np.array([problem.counted(name) for name in problem.model.outputs])
    off = theta - problem.prior_mean
    return float(counts @ np.log(np.maximum(squares, 1e-300)) + off**2 @ precision)


def _fit_ar_noises(problem: PathProblem, residuals: Sequence[Array]) -> list[ArNoise]:
    """Return the memory of each output's residuals; fixes of GPS have none."""
    return [
        ArNoise.white() if name in GPS else _fit_ar_noise([r[j] for r in residuals])
        for j, name in enumerate(problem.model.outputs)
    ]


def _fit_ar_noise(residuals: Sequence[Array]) -> ArNoise:
    none = [np.zeros((len(r), 0)) for r in residuals]
    coefficient, _ = fit_ar(lagged_moments(residuals, none, AR_ORDER), AR_ORDER)
    return ArNoise.from_coefficient(coefficient)


def _instruments(
    problem: PathProblem,
    slopes: Sequence[Array],
    lagged_inputs: Sequence[Array],
    ar_model: ArNoise,
) -> list[Array]:
    """Return the projection of whitened sensitivities on surfaces, slow drift and wind.

    Its remainder is reduced by K / (N - K): K of N dimensions are projected on.
    """
    common = len(problem.common)
    wind = [k for k, name in enumerate(problem.common) if name.startswith("wind_")]
    count = len(slopes)
    bases = []
    for k, (slope, inputs) in enumerate(zip(slopes, lagged_inputs, strict=True)):
        t = np.linspace(-1.0, 1.0, len(inputs))[:, None]
        drift = np.zeros((len(inputs), count * DRIFT_POWERS))
        drift[:, k * DRIFT_POWERS : (k + 1) * DRIFT_POWERS] = t ** np.arange(DRIFT_POWERS)
        bases.append(np.hstack([ar_model.whiten(np.hstack([drift, inputs])), slope[:, wind]]))
    # Projection by normal equations: a third of the time of an orthogonal decomposition and
    # accurate to ten digits (condition 1000 at most). Columns without motion have no weight.
    products = sum((base.T @ base for base in bases), np.zeros((1, 1)))
    size = np.sqrt(np.where(np.diag(products) > 0.0, np.diag(products), 1.0))
    scaled = products / size / size[:, None] + RIDGE * np.eye(len(size))
    inverse = np.linalg.inv(scaled) / size / size[:, None]
    dimensions = float(np.sum(inverse * products))
    fitted = dimensions / (sum(len(base) for base in bases) - dimensions)
    # Common unknowns are pooled over segments; initial values belong to one segment.
    pooled = sum(base.T @ slope[:, :common] for base, slope in zip(bases, slopes, strict=True))
    projected = [
        base @ (inverse @ np.hstack([pooled, base.T @ slope[:, common:]]))
        for base, slope in zip(bases, slopes, strict=True)
    ]
    return [part - fitted * (slope - part) for part, slope in zip(projected, slopes, strict=True)]

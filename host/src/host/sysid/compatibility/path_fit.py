"""Fit sensor errors along a flight path although the aircraft answers to gusts.

Vanes and pitot feel the gust itself, and a moment later so do the accelerometers that predict
them: least squares takes an aircraft that rides with slow gusts for vanes that under-read (by half
in light turbulence if residuals are taken for white, by 6 % if their memory is modelled). So the
slopes of air data are replaced by the part of them that follows the control surfaces: instrumental
variables, which know nothing of gusts (Soderstrom & Stoica 1983). Residuals are whitened by a short
memory, so that the covariance is that of white noise.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from host.arrays import Array
from host.sysid.compatibility.flight_path import AIR, DELAYS, FLOW, GPS, PITOT, PLACES, PathProblem
from host.sysid.identification_error import IdentificationError
from host.sysid.numerics.ar_noise import ArNoise, fit_ar, lagged_moments

AR_ORDER = 2  # memory of the residuals: a gust and a sensor
MOST_ITERATIONS = 25
ADAPT_FROM = 2  # iteration at which residuals are worth modelling
# Iterations after which AR models and instruments stay, so that the equations can settle.
ADAPTING_ITERATIONS = 4
# A second search, where the first does not settle: errors twice those of a calibrated instrument
# leave residuals at iteration 2 of which nothing is learned (3 of 12 flights). It first finds what
# inertial sensors and GPS tell, air data all but held to their calibration: without instruments
# gusts would draw them off.
PLAIN_ITERATIONS = 25  # plain iterations at most, each halved until the misfit falls
HALVINGS = 5
PLAIN_STEP_LIMIT = 3.0  # of a standard error, the last plain step
AIR_PRIOR_WEIGHT = 1e4  # times the prior precision
AIR_ERRORS = (*FLOW, *PITOT, *DELAYS, *PLACES)
STEP_LIMIT = 0.05  # of a standard error: the last step
DRIFT_POWERS = 4  # constants to cubics follow no gust either
RIDGE = 1e-10  # of a column's own product: a surface that stood still has none
LARGEST_STEP = 4.0  # in prior deviations


@dataclass(frozen=True)
class PathFit:
    """Estimate, covariance, residuals of a reconstruction."""

    theta: Array
    covariance: Array
    residuals: Sequence[Array]
    iterations: int
    converged: bool


def fit_path(problem: PathProblem, follows: Sequence[Array]) -> PathFit:
    """Solve the instrumented equations.

    Parameters
    ----------
    problem : PathProblem
    follows : sequence of Array, shape (blocks, columns)
        Per stretch what the pilot did: surfaces at several lags. No columns: plain least squares.

    Raises
    ------
    IdentificationError
        If the path is not finite at some step or the equations are singular.
    """
    found = _search(problem, follows, patience=0)
    return found if found.converged else _search(problem, follows, patience=PLAIN_ITERATIONS)


def _search(problem: PathProblem, follows: Sequence[Array], patience: int) -> PathFit:
    """Iterate until the equations settle; after `patience` plain iterations at most."""
    theta = problem.prior_mean.copy()
    outputs = problem.model.outputs
    noise = [ArNoise.white() for _ in outputs]
    held: dict[int, list[Array]] = {}
    held_back = [k for k, name in enumerate(problem.names) if name in AIR_ERRORS]
    converged, near = False, False
    iteration = 0
    origin, least, halvings = theta, np.inf, 0
    plain, learnt_from = bool(patience), max(patience, ADAPT_FROM)
    while True:
        responses = problem.respond(theta)
        if responses is None:
            raise IdentificationError("data compatibility: the flight path is not finite")
        residuals = [problem.measured(k) - r.y for k, r in enumerate(responses)]
        precision = problem.prior_precision.copy()
        if plain:
            precision[held_back] *= AIR_PRIOR_WEIGHT
            here = _negative_log_likelihood(problem, residuals, theta, precision)
            if here > least and halvings < HALVINGS:
                theta, halvings = 0.5 * (theta + origin), halvings + 1
                continue
            origin, least, halvings = theta, here, 0
        if plain and (near or iteration == patience):
            precision = problem.prior_precision
            plain, learnt_from = False, max(iteration, ADAPT_FROM)
        learning = learnt_from <= iteration < learnt_from + ADAPTING_ITERATIONS
        # Of every stretch, one array per output.
        whites: list[list[Array]] = [[] for _ in responses]
        tools: list[list[Array]] = [[] for _ in responses]
        slopes: list[list[Array]] = [[] for _ in responses]
        for j, name in enumerate(outputs):
            if learning and name not in GPS:
                noise[j] = _fit_ar_noise([r[j] for r in residuals])
            white = [noise[j].whiten(r[j][:, None])[:, 0] for r in residuals]
            slope = [noise[j].whiten(r.sensitivities[j]) for r in responses]
            variance = float(np.sum(np.concatenate(white) ** 2)) / problem.counted(name)
            deviation = np.sqrt(max(variance, 1e-300))
            if learning and name in AIR:
                held[j] = _instruments(problem, slope, follows, noise[j])
            for k, parts in enumerate(zip(white, held.get(j, slope), slope, strict=True)):
                for into, part in zip((whites, tools, slopes), parts, strict=True):
                    into[k].append(part / deviation)
        H = np.diag(precision)
        g = precision * (problem.prior_mean - theta)
        for k, rows in enumerate(zip(whites, tools, slopes, strict=True)):
            e, Z, J = map(np.concatenate, rows)
            own = problem.columns(k)
            H[np.ix_(own, own)] += Z.T @ J
            g[own] += Z.T @ e
        size = np.sqrt(np.maximum(np.abs(np.diag(H)), 1e-300))
        try:
            inverse = np.linalg.inv(H / np.outer(size, size)) / np.outer(size, size)
        except np.linalg.LinAlgError as error:
            raise IdentificationError("data compatibility: singular equations") from error
        if converged or iteration == MOST_ITERATIONS + patience:
            B = np.diag(problem.prior_precision)
            for k, own_tools in enumerate(tools):
                own, Z = problem.columns(k), np.concatenate(own_tools)
                B[np.ix_(own, own)] += Z.T @ Z
            covariance = inverse @ B @ inverse.T
            both = 0.5 * (covariance + covariance.T)
            return PathFit(theta, both, residuals, iteration, converged)
        step = inverse @ g
        with np.errstate(divide="ignore"):
            most = LARGEST_STEP / np.sqrt(problem.prior_precision)
        theta = theta + np.clip(step, -most, most)
        iteration += 1
        error_size = np.sqrt(np.maximum(np.abs(np.diag(inverse)), 1e-300))
        largest = float(np.max(np.abs(step) / error_size))
        near = largest < PLAIN_STEP_LIMIT
        converged = largest < STEP_LIMIT and not plain and iteration > learnt_from + 1


def _negative_log_likelihood(
    problem: PathProblem, residuals: Sequence[Array], theta: Array, precision: Array
) -> float:
    """Return twice the negative log likelihood of white residuals of unknown size and the prior."""
    squares = np.sum(np.hstack(residuals) ** 2, axis=1)
    counts = np.array([problem.counted(name) for name in problem.model.outputs])
    off = theta - problem.prior_mean
    return float(counts @ np.log(np.maximum(squares, 1e-300)) + off**2 @ precision)


def _fit_ar_noise(residuals: Sequence[Array]) -> ArNoise:
    none = [np.zeros((len(r), 0)) for r in residuals]
    coefficient, _ = fit_ar(lagged_moments(residuals, none, AR_ORDER), AR_ORDER)
    return ArNoise.from_coefficient(coefficient)


def _instruments(
    problem: PathProblem,
    slopes: Sequence[Array],
    follows: Sequence[Array],
    memory: ArNoise,
) -> list[Array]:
    """Return the part of whitened slopes that follows surfaces, slow drift and the wind's angle."""
    if not follows[0].shape[1]:
        return list(slopes)
    common = len(problem.common)
    wind = [k for k, name in enumerate(problem.common) if name.startswith("wind_")]
    count = len(slopes)
    bases = []
    for k, (slope, moved) in enumerate(zip(slopes, follows, strict=True)):
        t = np.linspace(-1.0, 1.0, len(moved))[:, None]
        drift = np.zeros((len(moved), count * DRIFT_POWERS))
        drift[:, k * DRIFT_POWERS : (k + 1) * DRIFT_POWERS] = t ** np.arange(DRIFT_POWERS)
        bases.append(np.hstack([memory.whiten(np.hstack([drift, moved])), slope[:, wind]]))
    # Onto the columns of all bases, by their products: a third of the time of orthogonal columns,
    # and good to ten digits (condition 1000 at most). Columns that are not there weigh nothing.
    products = sum((base.T @ base for base in bases), np.zeros((1, 1)))
    size = np.sqrt(np.where(np.diag(products) > 0.0, np.diag(products), 1.0))
    scaled = products / size / size[:, None] + RIDGE * np.eye(len(size))
    inverse = np.linalg.inv(scaled) / size / size[:, None]
    # Common unknowns are pooled over stretches, each one's own start values are its own.
    pooled = sum(base.T @ slope[:, :common] for base, slope in zip(bases, slopes, strict=True))
    return [
        base @ (inverse @ np.hstack([pooled, base.T @ slope[:, common:]]))
        for base, slope in zip(bases, slopes, strict=True)
    ]

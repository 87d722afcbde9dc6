"""Global search of the output-error likelihood by differential evolution, refined after."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy import optimize

from host.arrays import Array
from host.errors import IdentificationError
from host.sysid.estimators.output_error_fit import fit_output_error, sample_periods
from host.sysid.models import FitResult, LinearModel, Maneuver
from host.sysid.numerics import OutputProblem

POPULATION = 40
GENERATIONS = 60  # from far away the best is then within 3 % of the valley, six seeds of six
BOX = 3.0  # half width of the default box: this many times the start value


def fit_genetic(
    model: LinearModel,
    maneuvers: Sequence[Maneuver],
    *,
    population: int = POPULATION,
    generations: int = GENERATIONS,
    seed: int = 1,
    polish: bool = True,
) -> FitResult:
    """Search globally, then fit by output error from the best individual.

    Differential evolution (Storn & Price, Journal of Global Optimization 11, 1997) over a box of
    the common parameters. Biases and initial states keep their first guess during the search; a
    constant per output replaces them.

    Parameters
    ----------
    model, maneuvers
        Model and data; the box is given by the model's bounds, else by its start values.
    population, generations : int
        Size of the search.
    seed : int
        Seed of the random numbers: the answer is repeatable.
    polish : bool
        Estimate AR models of the noise in the final fit; those of one sample period only.
    """
    problem = OutputProblem(model, maneuvers)
    count = len(model.parameters)
    start = model.start
    size = BOX * np.maximum(np.abs(start), 0.05 * max(float(np.max(np.abs(start))), 1e-3))
    lower = np.where(np.isfinite(problem.lower[:count]), problem.lower[:count], start - size)
    upper = np.where(np.isfinite(problem.upper[:count]), problem.upper[:count], start + size)
    population_start = lower + (upper - lower) * np.random.default_rng(seed).random(
        (population, count)
    )
    population_start[0] = np.clip(start, lower, upper)
    base = problem.first_guess()

    def score(individual: Array) -> float:
        return _score(problem, base, individual)

    found = optimize.differential_evolution(
        score,
        optimize.Bounds(lower, upper),
        maxiter=generations,
        tol=0.0,
        rng=seed,
        polish=False,
        init=population_start,
    )
    if not np.isfinite(found.fun):
        raise IdentificationError("genetic search: every trial diverges; give tighter bounds")
    theta = base.copy()
    theta[:count] = found.x
    result = fit_output_error(
        model, maneuvers, start=theta, coloured_noise=polish and len(sample_periods(maneuvers)) == 1
    )
    details = {**result.details, "search_score": float(found.fun), "search_best": found.x}
    return replace(result, method="genetic search, polished", details=details)


def _score(problem: OutputProblem, base: Array, individual: Array) -> float:
    """Return the concentrated cost, constants left at their first guess."""
    theta = base.copy()
    theta[: len(individual)] = individual
    outputs = problem.outputs(theta)
    if outputs is None:
        return float("inf")
    total = np.zeros(len(problem.model.outputs))
    for number, y in enumerate(outputs):
        residual = problem.residual(number, y)
        # A constant per output replaces biases and initial states.
        residual = residual - residual.mean(axis=1, keepdims=True)
        total += np.sum(residual**2, axis=1)
    value = float(np.sum(np.log(np.maximum(total, 1e-300))))
    return value if np.isfinite(value) else float("inf")

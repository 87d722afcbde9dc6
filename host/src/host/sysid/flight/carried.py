"""How far an answer moves with errors of sensors that nobody knows: one step for each.

A deviation of every open error changes the data and, through the trim, the model. The estimate
follows by one Gauss-Newton step of output error about the answer: no fit is repeated.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from host.compiled import Array
from host.sysid.aircraft.airframe import Condition, Moved, trim_of
from host.sysid.compatibility.corrections import (
    IN_COLUMNS,
    deviations,
    pressure_part,
    without_errors,
)
from host.sysid.compatibility.reconstruction import Compatibility
from host.sysid.models.maneuver import Maneuver
from host.sysid.models.model import LinearModel, without_outputs
from host.sysid.models.result import FitResult
from host.sysid.models.templates import TEMPLATES, Trim, template
from host.sysid.numerics.problem import OutputProblem, Response

TRIMMING = ("airspeed_mps", "alpha_rad", "theta_rad", "qbar_pa", "density_kgpm3")
SINGULAR = 1e-12  # of the largest eigenvalue of the scaled information


def moved_by(
    result: FitResult,
    maneuvers: Sequence[Maneuver],
    cuts: Sequence[Mapping[str, Array]],
    compatibility: Compatibility,
    trim: Trim,
) -> tuple[Moved, ...]:
    """Return what one deviation of every error that stays open makes of an answer.

    Parameters
    ----------
    result : FitResult
        With parameters about `trim` if its model is a template.
    maneuvers : sequence of Maneuver
        As fitted.
    cuts : sequence of mapping
        All columns of each maneuver.
    compatibility : Compatibility
    trim : Trim

    Returns
    -------
    tuple of Moved
        Empty if the model diverges at the answer.
    """
    model = result.model
    problem = OutputProblem(model, maneuvers)
    theta = problem.first_guess()
    place = {n: k for k, n in enumerate(result.names)}
    known = [(k, place[n]) for k, n in enumerate(problem.names) if n in place]
    for k, source in known:
        theta[k] = result.estimate[source]
    responses = problem.respond(theta)
    if responses is None:
        return ()
    part, still = pressure_part(compatibility), _mean_of(cuts)
    errors = {e: sd for e, sd in deviations(compatibility).items() if e in IN_COLUMNS and sd > 0.0}
    changes, gains = [], []
    fresh = _is_template(model, trim)
    for error, deviation in errors.items():
        other = [without_errors(c, {error: deviation}, part) for c in cuts]
        change = [
            np.stack([o[y] - c[y] for y in model.outputs]) for o, c in zip(other, cuts, strict=True)
        ]
        there = _mean_of(other)
        gains.append(
            (
                there[1].airspeed_mps / still[1].airspeed_mps,
                there[1].qbar_pa / still[1].qbar_pa,
            )
        )
        if fresh and there[0] != still[0]:
            bent = _bent(trim, still[0], there[0])
            turned = OutputProblem(_retrimmed(model, bent), maneuvers).outputs(theta)
            if turned is not None:
                pairs = zip(change, turned, responses, strict=True)
                change = [d - (y - r.y) for d, y, r in pairs]
        changes.append(change)
    steps = _steps(problem, responses, changes)
    moved = []
    for error, step, gain in zip(errors, steps, gains, strict=True):
        estimate = result.estimate.copy()
        for k, target in known:
            estimate[target] += step[k]
        moved.append(Moved(error, estimate, *gain))
    return tuple(moved)


def carried(result: FitResult, moved: Sequence[Moved]) -> FitResult:
    """Return the result with the errors' part in its covariance."""
    if not moved:
        return result
    shifts = np.stack([m.estimate - result.estimate for m in moved])
    return replace(result, covariance=result.covariance + shifts.T @ shifts)


def _mean_of(cuts: Sequence[Mapping[str, Array]]) -> tuple[Trim, Condition]:
    names = [name for name in TRIMMING if name in cuts[0]]
    return trim_of({name: np.concatenate([c[name] for c in cuts]) for name in names})


def _bent(trim: Trim, still: Trim, there: Trim) -> Trim:
    """Return a trim moved by what two means differ by."""
    return replace(
        trim,
        airspeed_mps=trim.airspeed_mps + there.airspeed_mps - still.airspeed_mps,
        alpha_rad=trim.alpha_rad + there.alpha_rad - still.alpha_rad,
    )


def _steps(
    problem: OutputProblem, responses: Sequence[Response], changes: Sequence[Sequence[Array]]
) -> Array:
    """Return the Gauss-Newton step of every change of the data, (changes, P)."""
    rest = [np.sum((problem.measured(k) - r.y) ** 2, axis=1) for k, r in enumerate(responses)]
    weight = problem.samples / np.maximum(np.sum(rest, axis=0), 1e-300)
    H = np.diag(problem.prior_precision)
    pull = np.zeros((len(changes), len(problem.names)))
    for k, r in enumerate(responses):
        own = problem.columns(k)
        for w, J, change in zip(
            weight, r.slopes, np.stack([c[k] for c in changes], axis=1), strict=True
        ):
            H[np.ix_(own, own)] += w * J.T @ J
            pull[:, own] += w * change @ J
    if not (np.isfinite(H).all() and np.isfinite(pull).all()):
        return np.zeros_like(pull)
    size = np.sqrt(np.maximum(np.diag(H), 1e-300))
    inverse = np.linalg.pinv(H / np.outer(size, size), rcond=SINGULAR, hermitian=True)
    return np.asarray((pull / size) @ inverse / size)


def _is_template(model: LinearModel, trim: Trim) -> bool:
    """Return whether a model is what the template of its name gives about a trim."""
    if model.name not in TEMPLATES:
        return False
    fresh = _about(model, trim)
    same = fresh.outputs == model.outputs and fresh.terms == model.terms
    return same and bool(np.array_equal(fresh.A, model.A) and np.array_equal(fresh.C, model.C))


def _about(model: LinearModel, trim: Trim) -> LinearModel:
    """Return the template of a model's name about another trim, levers left out."""
    forces = any(y.startswith("a") and y.endswith("_mps2") for y in model.outputs)
    fresh = template(model.name, trim, accelerometers=forces)
    return without_outputs(fresh, [y for y in fresh.outputs if y not in model.outputs])


def _retrimmed(model: LinearModel, trim: Trim) -> LinearModel:
    fresh = _about(model, trim)
    return replace(model, A=fresh.A, B=fresh.B, C=fresh.C, D=fresh.D, terms=fresh.terms)

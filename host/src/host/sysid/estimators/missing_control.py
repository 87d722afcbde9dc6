"""Score test of inputs that act where the model says that they do not, in gust and noise.

Without the lift of an elevator the gust filter takes what az lacks for moving air, and air moves q:
M_q was 10 % off, known to 3 %. A free simulation cannot tell, for the gust is all that it leaves;
the filter's innovations can.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import special

from host.arrays import Array
from host.sysid.estimators.gust_model import driven_model
from host.sysid.estimators.innovations import driven_states, score_covariances
from host.sysid.models.fit_result import FitResult
from host.sysid.models.maneuver import Maneuver
from host.sysid.models.state_space_model import LinearModel, Parameter, Term, has_equations
from host.sysid.models.uncertainty import ModelError, Uncertainty
from host.sysid.numerics.filter_problem import FilterProblem
from host.sysid.numerics.information_inverse import identified_inverse

SIGNIFICANCE = 0.01  # of right models are said to lack an effect of their inputs


@dataclass(frozen=True)
class MissingControl:
    """Effects of inputs that a model lacks, and what their absence does to its parameters.

    Attributes
    ----------
    where : tuple of str
        Inputs and equations, those first that stand out most.
    shift : Array, shape (P,)
        By how much each parameter of the model is off.
    """

    where: tuple[str, ...]
    shift: Array


def missing_control(
    result: FitResult, maneuvers: Sequence[Maneuver], airspeed_mps: float
) -> MissingControl | None:
    """Return what the inputs do beside the model; None where they do nothing, or of other methods.

    The entries of B and D that are empty are added to the model. Their joint score is compared with
    its covariance (Lagrange multipliers; Engle, Handbook of Econometrics II, 1984, ch. 13), which
    counts that innovations may be coloured. Their one-step estimate says how far parameters moved.

    Parameters
    ----------
    result : FitResult
        Of filter error, on its model without gust states.
    maneuvers : sequence of Maneuver
        As fitted.
    airspeed_mps : float
        Of the trim, for the gust's time scale.
    """
    base = result.model
    process = driven_states(result)
    if not process or result.residual_kind != "innovation" or has_equations(base):
        return None
    added = _absent_entries(base)
    if not added:
        return None
    wide = driven_model(base, process, airspeed_mps)
    names = [f"absent {k}" for k in range(len(added))]
    wide = replace(
        wide,
        terms=(
            *wide.terms,
            *(Term(m, row, column, n) for n, (m, row, column) in zip(names, added, strict=True)),
        ),
        parameters=(*wide.parameters, *(Parameter(n, 0.0) for n in names)),
    )
    first, count = len(base.parameters), len(added)
    theta = np.insert(result.estimate, first, np.zeros(count))
    problem = FilterProblem(wide, maneuvers, process)
    point = problem.evaluate(theta)
    if point is None:
        return None
    information, score = problem.total(theta, *problem.scoring(theta, point))
    coloured = np.zeros_like(information)
    slopes = problem.whitened_slopes(theta, point)
    for k, (J, m) in enumerate(zip(slopes, maneuvers, strict=True)):
        white = point.whitened(k, point.as_filtered(k))
        for part in score_covariances(white, J, m.sampled):
            coloured += part
    new = np.zeros(len(theta), dtype=bool)
    new[first : first + count] = True
    # Freed of what the parameters of the model, and of its noise, could still take.
    moved = -identified_inverse(information[np.ix_(~new, ~new)]) @ information[np.ix_(~new, new)]
    freed = np.zeros((len(theta), count))
    freed[new], freed[~new] = np.eye(count), moved
    inner, outer = (freed.T @ m @ freed for m in (information, coloured))
    right = freed.T @ score
    sizes = np.sqrt(np.maximum(np.diag(inner), 1e-300))
    effect = identified_inverse(inner / np.outer(sizes, sizes)) / np.outer(sizes, sizes) @ right
    # The larger of both covariances along the score: no narrower than the filter's own.
    excess = float(right @ identified_inverse(inner) @ outer @ identified_inverse(inner) @ right)
    power = float(right @ effect)
    excess = max(excess / max(power, 1e-300), 1.0)
    if special.chdtrc(count, power / excess) >= SIGNIFICANCE:
        return None
    order = np.argsort(-np.abs(effect) * sizes)
    said = [_said(base, *added[k]) for k in order if abs(effect[k]) * sizes[k] > 2.0]
    return MissingControl(tuple(said), (moved @ effect)[:first])


def absent_effects(noise: Uncertainty, found: MissingControl | None) -> ModelError | None:
    """Return what the absent effects moved, and a line; None where nothing is absent."""
    if found is None:
        return None
    own = noise.variance[: len(found.shift)] > 0.0
    where = ", ".join(found.where) or "the outputs"
    line = f"the inputs act where the model has no effect of theirs ({where}): intervals widened"
    return ModelError(shift=found.shift * own, warnings=(line,))


def _absent_entries(model: LinearModel) -> list[tuple[str, int, int]]:
    """Return matrix, row and column of the effects of inputs that a model has not.

    Asked for are equations with parameters of their own: kinematics needs no input.
    """
    there = {(t.matrix, t.row, t.column) for t in model.terms if t.matrix in "BD"}
    found = []
    for matrix, free, known, rows in (
        ("B", "A", model.B, model.states),
        ("D", "C", model.D, model.outputs),
    ):
        open_rows = {t.row for t in model.terms if t.matrix == free and t.gain != 0.0}
        found += [
            (matrix, row, column)
            for row in sorted(open_rows)
            for column in range(len(model.inputs))
            if (matrix, row, column) not in there and known[row, column] == 0.0
            if not (matrix == "D" and rows[row] in model.states)
        ]
    return found


def _said(model: LinearModel, matrix: str, row: int, column: int) -> str:
    name = f"{model.states[row]}'" if matrix == "B" else model.outputs[row]
    return f"{model.inputs[column]} on {name}"

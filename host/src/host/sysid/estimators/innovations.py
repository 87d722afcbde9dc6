"""What the innovations of a filter-error answer say beside it: their slopes, their colour.

Filter error takes its innovations for white. Where the model lacks something they are not, and
their memory stands between the slopes as for output error (`numerics/coloured_residuals.py`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from host.arrays import Array
from host.sysid.models.fit_result import FitResult
from host.sysid.models.maneuver import Maneuver
from host.sysid.models.state_space_model import LinearModel
from host.sysid.numerics.coloured_residuals import coloured_score_covariance
from host.sysid.numerics.filter_problem import FilterProblem
from host.sysid.numerics.filter_scoring import whitened_innovation_sensitivities
from host.sysid.numerics.information_inverse import covariance_from_information

PROCESS = "log_process."


@dataclass(frozen=True)
class Innovations:
    """Whitened innovations of every maneuver and their slopes at an answer.

    Attributes
    ----------
    theta : Array, shape (P,)
    covariance : Array, shape (P, P)
        Inverse of the information at the answer.
    inverse : Array, shape (P, P)
        The same of the model alone, both noises held: what a step may use.
    process : tuple of str
    e : list of Array, each (samples, p)
    white : list of Array, each (p, p)
        Turns an innovation into whitened ones.
    sensitivities : list of Array, each (samples, p, P)
        Of the whitened innovations.
    """

    theta: Array
    covariance: Array
    inverse: Array
    process: tuple[str, ...]
    e: list[Array]
    white: list[Array]
    sensitivities: list[Array]

    def one_step_update(self, model: LinearModel, changed: Sequence[Maneuver]) -> Array:
        """Return how far the answer moves with another model and other data, (P,).

        One Gauss-Newton step; nothing if the filter fails there.
        """
        point = FilterProblem(model, changed, self.process).evaluate(self.theta)
        pull = np.zeros(len(self.theta))
        if point is None:
            return pull
        for e, still, white, slope in zip(
            point.e, self.e, self.white, self.sensitivities, strict=True
        ):
            pull -= np.einsum("nj,njk->k", (e - still) @ white.T, slope)
        return np.asarray(self.inverse @ pull)

    def coloured_covariance(self) -> Array:
        """Return the covariance with the memory of the innovations in it; never a narrower one."""
        middle = np.zeros_like(self.covariance)
        for e, white, slope in zip(self.e, self.white, self.sensitivities, strict=True):
            plain = e @ white.T
            for j in range(plain.shape[1]):
                middle += coloured_score_covariance(plain[:, j], slope[:, j])
        wide = self.covariance @ middle @ self.covariance
        factor = np.sqrt(
            np.maximum(np.diag(wide) / np.maximum(np.diag(self.covariance), 1e-300), 1.0)
        )
        return np.asarray(self.covariance * np.outer(factor, factor))


def innovations_of(
    result: FitResult, model: LinearModel, maneuvers: Sequence[Maneuver]
) -> Innovations | None:
    """Return them for a result of filter error on this model; None where the filter fails."""
    theta, covariance = result.estimate, result.covariance_white
    process = tuple(n.removeprefix(PROCESS) for n in result.names if n.startswith(PROCESS))
    problem = FilterProblem(model, maneuvers, process)
    point = problem.evaluate(theta)
    if point is None:
        return None
    white = [point.gains[m.dt_s].whitener for m in maneuvers]
    slopes = whitened_innovation_sensitivities(problem, theta, point)
    count = problem.n_model
    own = [slope.reshape(-1, len(theta))[:, :count] for slope in slopes]
    inverse = np.zeros_like(covariance)
    inverse[:count, :count] = covariance_from_information(
        np.diag(problem.output_problem.prior_precision) + sum(J.T @ J for J in own)
    )
    return Innovations(theta, covariance, inverse, process, point.e, white, slopes)

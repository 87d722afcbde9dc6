"""The search of filter error: Fisher scoring over parameters and both kinds of noise."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from host.arrays import Array, BoolArray
from host.errors import IdentificationError
from host.sysid.models.maneuver import Maneuver
from host.sysid.numerics.gauss_newton import Objective, StepLine, free_of_bounds
from host.sysid.numerics.innovation_problem import InnovationLikelihood, InnovationProblem

# Where the noise of a sensor tends to zero, Fisher's information overstates the curvature and all
# steps are too short by the same share. A longer one is tried at a fifth of the cost of new
# sensitivities: 12 to 20 iterations instead of 22 to 60.
EXTEND_FROM_BOUNDS = 0.5  # bounds
LONGEST_EXTENSION = 32.0
# With a gust it understates that of sensors and gust together: full steps go to and fro between
# both sides of the optimum, 41 iterations where 14 do.
SHORTEN_BELOW = 0.8  # steps
VARIANCE_CHANGE = (0.01, 100.0)  # times what it was: most of one step
# First guess of the deviations: sensors share the residuals of output error with process noise.
# With too small a guess of process noise the gain is too small, and the search ends elsewhere.
NOISE_SHARE, PROCESS_SHARE = 0.6, 2.7
LARGEST_HIDDEN = 0.1  # rad, rad/s or m/s: largest first guess for states without an output
NOISE_FLOOR = 1e-3  # of an output's deviation, or of the first guess of process noise
SLOWEST_DECAY_RADPS = 0.1  # rad/s, of a state that process noise drives


def first_noise(A: Array, C: Array, driven: Sequence[int], deviation: Array) -> Array:
    """Return the logarithms of process and measurement deviations to start from.

    Parameters
    ----------
    A, C : Array, shape (n, n), (p, n)
    driven : sequence of int
        States that process noise drives.
    deviation : Array, shape (p,)
        Deviation of the residuals of output error.
    """
    process = []
    for i in driven:
        # The smallest motion of this state that would explain the residual of an output.
        size = float(np.min(deviation / np.maximum(np.abs(C[:, i]), 1e-9), initial=LARGEST_HIDDEN))
        process.append(PROCESS_SHARE * size * np.sqrt(2.0 * max(-A[i, i], SLOWEST_DECAY_RADPS)))
    return np.concatenate([np.log(process), np.log(NOISE_SHARE * deviation)])


def noise_floor(maneuvers: Sequence[Maneuver], process: Array) -> Array:
    """Return the least logarithms of process and measurement deviations.

    Noise that the data do not show would decrease for ever, and the search would not end. The step
    of the numbers is noise of step^2 / 12 in any case, and so is the least noise of a sensor whose
    error lasts.

    Parameters
    ----------
    maneuvers : sequence of Maneuver
    process : Array
        First guess of the logarithms of the process deviations.
    """
    spread = np.maximum(np.std(np.vstack([m.outputs for m in maneuvers]), axis=0), 1e-9)
    steps = [m.resolution for m in maneuvers if m.resolution is not None]
    if steps:
        spread = np.maximum(spread, np.max(steps, axis=0) / np.sqrt(12.0) / NOISE_FLOOR)
    least = [m.least_noise for m in maneuvers if m.least_noise is not None]
    if least:
        spread = np.maximum(spread, np.max(least, axis=0) / NOISE_FLOOR)
    return np.asarray(np.log(NOISE_FLOOR) + np.concatenate([process, np.log(spread)]))


class InnovationObjective(Objective[InnovationLikelihood]):
    """Cost of a filter's innovations; deviations of the noise do not fall below `floor`.

    Parameters
    ----------
    problem : InnovationProblem
    floor : Array
        Least logarithms of the deviations.
    """

    def __init__(self, problem: InnovationProblem, floor: Array) -> None:
        outputs = problem.output_problem
        self._problem = problem
        self._noise = slice(problem.n_model, None)
        self._lower = np.concatenate([outputs.lower, floor])
        self._upper = np.concatenate([outputs.upper, np.full(len(floor), np.inf)])
        self.parts: list[Array] = []  # Fisher's information by maneuver where last asked for
        self.scores: list[Array] = []

    def evaluate(self, theta: Array) -> InnovationLikelihood | None:
        return self._problem.evaluate(theta)

    def normal(self, theta: Array, trial: InnovationLikelihood) -> tuple[Array, Array]:
        try:
            self.parts, self.scores = self._problem.scoring(theta, trial)
        except np.linalg.LinAlgError as error:
            raise IdentificationError(
                f"model {self._problem.model.name}: the Kalman filter's gain has no slopes at its"
                " estimates; these data do not determine the model"
            ) from error
        return self._problem.total(theta, self.parts, self.scores)

    def free(self, theta: Array, gradient: Array) -> BoolArray:
        return free_of_bounds(theta, gradient, self._lower, self._upper)

    def apply_step(self, theta: Array, step: Array, length: float = 1.0) -> Array:
        """Return the parameters after `length` steps; noise parameters move by their variance."""
        proposal, noise = theta + length * step, self._noise
        proposal[noise] = theta[noise] + 0.5 * np.log(
            np.clip(1.0 + 2.0 * length * step[noise], *VARIANCE_CHANGE)
        )
        return np.clip(proposal, self._lower, self._upper)

    def adjust_step(
        self, line: StepLine, reached: tuple[Array, InnovationLikelihood]
    ) -> tuple[Array, InnovationLikelihood]:
        """Return the best of a step doubled in length as long as the cost falls, or shortened.

        The length is that of the parabola through both costs and the slope at the start.
        """
        best, length = reached, 2.0
        bend = best[1].cost - line.cost + line.decrease
        vertex = 0.5 * line.decrease / bend if bend > 0.0 else np.inf
        if vertex < SHORTEN_BELOW:
            return self._better(line, vertex, best)
        while not line.damped and line.size > EXTEND_FROM_BOUNDS and length <= LONGEST_EXTENSION:
            longer = self._better(line, length, best)
            if longer is best:
                break
            best = longer
            length *= 2.0
        return best

    def _better(
        self, line: StepLine, length: float, best: tuple[Array, InnovationLikelihood]
    ) -> tuple[Array, InnovationLikelihood]:
        """Return the point at some length of a step where its cost is lower, else `best`."""
        proposal = self.apply_step(line.theta, line.step, length)
        trial = self.evaluate(proposal)
        return best if trial is None or trial.cost >= best[1].cost else (proposal, trial)

"""Start values from a model that is led along the measured states and let go by degrees.

Free simulation carries an error of its first second through the whole maneuver, so its likelihood
has many valleys. A model whose states are drawn to the measured ones, x' = A x + B u + r (y - x),
forgets it within 1/r; its likelihood is smooth, and at a high rate r the search is all but linear.
The rate falls in steps and each search begins where the last one ended; the last runs free
(homotopy: Vyasarayani, Uchida, Carvalho & McPhee, Multibody System Dynamics 26, 2011).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from host.arrays import Array
from host.sysid.models.maneuver import Maneuver
from host.sysid.models.state_space_model import LinearModel
from host.sysid.numerics.output_error import minimise
from host.sysid.numerics.output_error_problem import OutputProblem

MAX_ITERATIONS = 15  # of each search but the last: its end is only the next one's start
STEP_LIMIT = 0.3  # Cramer-Rao bounds: nearer than that the next rate moves it anyway


def homotopy_start(problem: OutputProblem, theta: Array, rates_radps: Sequence[float]) -> Array:
    """Return where searches at falling rates of following end, begun at `theta`.

    Parameters
    ----------
    problem : OutputProblem
        Every state must be measured by an output.
    theta : Array, shape (P,)
        Start.
    rates_radps : sequence of float
        Falling, 1/s.

    Raises
    ------
    IdentificationError
        If a state is not measured, or the model runs away even while it follows.
    """
    for rate_radps in rates_radps:
        led = OutputProblem(
            stabilised_model(problem.model, rate_radps),
            [_stabilised_maneuver(problem.model, m) for m in problem.maneuvers],
        )
        theta = minimise(led, theta, step_limit=STEP_LIMIT, max_iterations=MAX_ITERATIONS).theta
    return theta


def stabilised_model(model: LinearModel, rate_radps: float) -> LinearModel:
    """Return the model drawn to its measured states, which become inputs; nothing new is free."""
    count = len(model.states)
    model.measured_states()
    return replace(
        model,
        inputs=model.inputs + tuple(f"{state} as measured" for state in model.states),
        A=model.A - rate_radps * np.eye(count),
        B=np.hstack([model.B, rate_radps * np.eye(count)]),
        D=np.hstack([model.D, np.zeros((len(model.outputs), count))]),
        hold="foh",
    )


def _stabilised_maneuver(model: LinearModel, maneuver: Maneuver) -> Maneuver:
    seen = maneuver.outputs[:, list(model.measured_states())]
    return replace(maneuver, inputs=np.hstack([maneuver.inputs, seen]))

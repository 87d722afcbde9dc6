"""Start values by homotopy: the model is driven towards measured states with decreasing gain.

In free simulation an error of the first second persists through the whole maneuver, so that the
likelihood has many local minima. With feedback of the measured states it decays within the inverse
of the gain; the likelihood is smooth, and at a high gain the search is nearly linear. The gain
falls in steps, and each search begins where the last one ended (Vyasarayani, Uchida, Carvalho &
McPhee, Multibody System Dynamics 26, 2011).
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

MAX_ITERATIONS = 15  # of each search: its end is only the next one's start
STEP_LIMIT = 0.3  # Cramer-Rao bounds: the next gain moves the minimum by more


def homotopy_start(problem: OutputProblem, theta: Array, gains_radps: Sequence[float]) -> Array:
    """Return the estimate after searches with falling feedback gains, begun at `theta`.

    Parameters
    ----------
    problem : OutputProblem
        Every state must be measured by an output.
    theta : Array, shape (P,)
        Start.
    gains_radps : sequence of float
        Feedback gains, falling, 1/s.

    Raises
    ------
    IdentificationError
        If a state is not measured, or the stabilised model diverges.
    """
    for gain_radps in gains_radps:
        stabilised = OutputProblem(
            stabilised_model(problem.model, gain_radps),
            [_stabilised_maneuver(problem.model, m) for m in problem.maneuvers],
        )
        theta = minimise(
            stabilised, theta, step_limit=STEP_LIMIT, max_iterations=MAX_ITERATIONS
        ).theta
    return theta


def stabilised_model(model: LinearModel, gain_radps: float) -> LinearModel:
    """Return the model with feedback of measured states, x' = A x + B u + r (y - x) with the gain
    r.

    The measured states become inputs; no parameter is added (stabilised output error: Jategaonkar,
    Flight Vehicle System Identification, 2nd ed., ch. 9).
    """
    count = len(model.states)
    model.measured_states()
    return replace(
        model,
        inputs=model.inputs + tuple(f"{state} as measured" for state in model.states),
        A=model.A - gain_radps * np.eye(count),
        B=np.hstack([model.B, gain_radps * np.eye(count)]),
        D=np.hstack([model.D, np.zeros((len(model.outputs), count))]),
        hold="foh",
    )


def _stabilised_maneuver(model: LinearModel, maneuver: Maneuver) -> Maneuver:
    measured = maneuver.outputs[:, list(model.measured_states())]
    return replace(maneuver, inputs=np.hstack([maneuver.inputs, measured]))

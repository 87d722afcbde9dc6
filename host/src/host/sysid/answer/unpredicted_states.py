"""States that a model does not carry, and the parameters that lean on them."""

from __future__ import annotations

from collections.abc import Sequence

from host.sysid.flight.linear_estimator import Answer
from host.sysid.models.residual_delays import STANDARD_DELAYS

UNPREDICTED = 0.5  # NRMSE of an output of an unseen maneuver


def unpredicted_states(answer: Answer) -> list[str]:
    """Return the states that the model does not carry: unseen maneuvers say so, or a delay.

    A delay at its bound is what a model lacks in that signal. An interval counts noise and gusts,
    not what is lacking: on a demonstration flight D_V was -0.33 +- 0.02 where -0.61 was true.
    """
    failing = failing_outputs(answer)
    for group in (*STANDARD_DELAYS, *answer.model.delays):
        if group.name in answer.at_bound:
            failing |= set(group.outputs)
    return [state for state in answer.model.states if state in failing]


def failing_outputs(answer: Answer) -> set[str]:
    """Return the outputs of unseen maneuvers that the model does not predict."""
    return {f.name for f in answer.validation if not f.nrmse < UNPREDICTED}


def reasons_of_states(answer: Answer, states: Sequence[str]) -> str:
    """Return why each of some states is not carried."""
    failing = failing_outputs(answer)
    return ", ".join(
        f"{s} is not predicted" if s in failing else f"the delay of {s} is at its bound"
        for s in states
    )


def parameters_of_states(answer: Answer, states: Sequence[str]) -> set[str]:
    """Return the parameters in the equation of a state, and those it is multiplied by."""
    at = {answer.model.states.index(state) for state in states}
    return {
        term.parameter
        for term in answer.model.terms
        if term.matrix in "AB" and (term.row in at or (term.matrix == "A" and term.column in at))
    }

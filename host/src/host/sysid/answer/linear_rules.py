"""What only a linear model can break: bounds, inputs and motion left out, what is not predicted."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING

import numpy as np

from host.constants import SIGNIFICANCE
from host.sysid.answer.correlated_inputs import derivatives_of_both
from host.sysid.answer.doubt import Doubt, Evidence, doubt
from host.sysid.answer.parameter_places import leaning_on
from host.sysid.errors.systematic_errors import is_template, scaled_by_airspeed
from host.sysid.models.residual_delays import STANDARD_DELAYS
from host.sysid.validation.prediction_limits import FAILS, Prediction

if TYPE_CHECKING:
    from host.sysid.linear.linear_answer import Answer
    from host.sysid.models.diagnostics import SignalFit

AIRSPEED = "airspeed_mps"
WORSE_THAN_NONE = 1.0  # NRMSE: the mean would do better
NEAR_BOUND = 1e-6  # of a bound's distance to the start, or of its size


def on_a_bound(answer: Answer, evidence: Evidence) -> list[Doubt]:
    """Doubt a value at the bound of the search."""
    half = answer.result.half_width()
    names = [
        p.name
        for k, p in enumerate(answer.model.parameters)
        if any(_reached(float(answer.result.estimate[k]), b) for b in (p.lower, p.upper))
        or (half[k] == 0.0 and answer.result.estimate[k] != 0.0)
    ]
    return _named(answer, names, "the estimate is on its bound")


def one_input_for_two(answer: Answer, evidence: Evidence) -> list[Doubt]:
    """Doubt inputs that moved as one, of which a regression left one out."""
    return _named(answer, derivatives_of_both(answer), "both inputs moved alike; one was left out")


def motion_left_out(answer: Answer, evidence: Evidence) -> list[Doubt]:
    """Doubt a reduced template where short records hide what other states do."""
    if not answer.left_out:
        return []
    reason = (
        f"{answer.template} leaves out {' and '.join(answer.left_out)}, and no interval counts it"
    )
    return _named(answer, leaning_on(answer.model, set(answer.model.states)), reason)


def divided_by(answer: Answer, channel: str) -> set[str]:
    """Return the parameters that a column scales besides its own equation.

    Airspeed is in the numbers of a model, where it is no state: the templates have forces over it.
    With an aircraft file dynamic pressure turns every derivative into a coefficient.
    """
    if channel != AIRSPEED:
        return set()
    if answer.coefficient_parts is not None:
        return {p.name for p in answer.model.parameters}
    known = answer.trim.known and is_template(answer.model, answer.trim)
    return scaled_by_airspeed(answer.model, answer.trim) if known else set()


def unpredicted(answer: Answer) -> list[SignalFit]:
    """Return the outputs of unseen maneuvers that the model does not predict.

    Half of an output's deviation is a failure whatever is allowed, but for white noise: noise as
    slow as a phugoid allows anything. Not what gusts among the states of the model make, which one
    sample tells of the next.
    """
    allowed = answer.predictions
    return [
        f
        for f in answer.validation
        if (fails(f) and not _as_gusts_make(allowed, f))
        or (f.name in allowed and not allowed[f.name].holds)
    ]


def _as_gusts_make(allowed: Mapping[str, Prediction], fit: SignalFit) -> bool:
    """Return whether an output is missed by no more than gusts among the model's states make.

    They are part of its motion: what misses all of it is not theirs.
    """
    found = allowed.get(fit.name)
    return found is not None and found.by_gusts and found.holds and fit.nrmse < WORSE_THAN_NONE


def fails(fit: SignalFit) -> bool:
    """Return whether an output is not explained, and not because a sensor is noisy."""
    white = fit.ljung_box_p > SIGNIFICANCE
    return not fit.nrmse < FAILS and not (fit.nrmse < WORSE_THAN_NONE and white)


def unpredicted_states(answer: Answer) -> dict[str, str]:
    """Return the states that the model does not carry, and why: for modes that consist of them."""
    found = {f.name: f"{f.name} is not predicted" for f in unpredicted(answer)}
    for group in (*STANDARD_DELAYS, *answer.model.delays):
        if group.name in answer.at_bound:
            found |= {
                y: f"the delay of {y} is at its bound" for y in group.outputs if y not in found
            }
    return {s: found[s] for s in answer.model.states if s in found}


def _named(answer: Answer, names: Iterable[str], reason: str) -> list[Doubt]:
    aircraft = (p.name for p in answer.model.parameters if not p.name.startswith("imu_"))
    return doubt(names, aircraft, reason)


def _reached(value: float, bound: float) -> bool:
    return bool(np.isfinite(bound)) and abs(value - bound) <= NEAR_BOUND * max(
        abs(bound), NEAR_BOUND
    )

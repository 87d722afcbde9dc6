"""Gradual penetration of a gust: the tail meets it after the vane, so a growing gust turns the air.

How strongly is not known beforehand: a small aircraft in long gusts feels the angle alone, one of
which the tail makes most of the damping feels both, and shape and length of the gusts differ. Left
out, turning air puts M_alpha 55 % and M_q 160 % off on simulated flights; taken for known where it
does not turn (MIL-F-8785C, 3.7.5), 15 to 40 %; free, both are within 2 %. Sideslip and yaw rate
alike: left out, L_beta is 29 and N_r 21 % off. Lateral gusts also roll the air, with a lag of their
own.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from host.arrays import Array
from host.sysid.models.state_space_model import LinearModel, Parameter, Term

PREFIX = "gust_"
GUST_LAG = "gust_lag_radps"
ROLL_LAG = "gust_roll_lag_radps"
TURNED = (("alpha_rad", "q_radps"), ("beta_rad", "r_radps"))  # angles and their rates
ROLL_STATES = frozenset({"beta_rad", "p_radps"})  # of a model that air may roll
# The air turns within the time to fly this far, a tail arm or more, and rolls within 4 b/pi
# (MIL-F-8785C, 3.7.5) of models of 1.2 to 2.5 m span. A prior at the lower end of that range makes
# the lag of the rolling gust 1.8 % quick and L_p 0.5 % small on a trainer of 1.8 m.
LENGTH_M, ROLL_LENGTH_M, LENGTH_SHARE = 1.5, 2.2, 0.5
FARTHEST = 10.0  # times more or less: bounds of the search
GENEROUS = 2.0  # deviations of the effect, in effects of the same rate and angle of the aircraft


def penetration_name(parameter: str) -> str:
    """Return what the effect of turning air is called, apart from that of the aircraft's own."""
    return f"{PREFIX}{parameter.split('_')[0]}"


def with_gust_penetration(
    model: LinearModel, airspeed_mps: float, start: Array
) -> tuple[LinearModel, Array]:
    """Return the model with the effects of turning air as parameters, and the start with theirs.

    A model with neither alpha and q nor beta and r feels none and stays as it is.

    The parameters act through the gust alone (`gust_model`): ``gust_Z`` in 1/s, ``gust_M`` in 1/s2,
    ``gust_lag_radps``.

    Parameters
    ----------
    model : LinearModel
        Without delays.
    airspeed_mps : float
        Airspeed at trim.
    start : Array, shape (P,)
        Common parameters of the model first.
    """
    lag = airspeed_mps / LENGTH_M
    turns = next((pair for pair in TURNED if set(pair) <= set(model.states)), None)
    if turns is None:
        return model, start
    more = (*_effects(model, *turns, lag, start), _lag(GUST_LAG, lag))
    if set(model.states) >= ROLL_STATES:
        more = (*more, _lag(ROLL_LAG, airspeed_mps / ROLL_LENGTH_M))
    count = len(model.parameters)
    wide = replace(model, parameters=(*model.parameters, *more), terms=(*model.terms, *_idle(more)))
    return wide, np.concatenate([start[:count], [p.start for p in more], start[count:]])


def _effects(
    model: LinearModel, angle: str, rate: str, lag: float, start: Array
) -> tuple[Parameter, ...]:
    """Return what turning air does to each equation that the rate stands in."""
    size = dict(zip((p.name for p in model.parameters), np.abs(start), strict=False))
    alpha, q = model.states.index(angle), model.states.index(rate)
    effects: dict[str, float] = {}
    for term in model.terms:
        if term.matrix == "A" and term.column == q:
            own = [
                t for t in model.terms if t.matrix == "A" and (t.row, t.column) == (term.row, alpha)
            ]
            direct = sum(size[t.parameter] for t in own)
            effects[penetration_name(term.parameter)] = lag * size[term.parameter] + direct
    return tuple(
        Parameter(name, prior_sd=GENEROUS * sd) for name, sd in effects.items() if sd > 0.0
    )


def _lag(name: str, lag: float) -> Parameter:
    return Parameter(
        name, lag, lower=lag / FARTHEST, upper=lag * FARTHEST, prior_sd=LENGTH_SHARE * lag
    )


def without_gust_penetration(model: LinearModel) -> LinearModel:
    """Return the model of the aircraft alone."""
    return replace(
        model,
        parameters=tuple(p for p in model.parameters if not p.name.startswith(PREFIX)),
        terms=tuple(t for t in model.terms if not t.parameter.startswith(PREFIX)),
    )


def penetration_of(model: LinearModel, other: LinearModel) -> LinearModel:
    """Return `model` with the parameters of turning air that `other` has."""
    more = tuple(p for p in other.parameters if p.name.startswith(PREFIX))
    return replace(model, parameters=(*model.parameters, *more), terms=(*model.terms, *_idle(more)))


def _idle(parameters: tuple[Parameter, ...]) -> tuple[Term, ...]:
    """Return entries of no gain: without a gust these parameters move nothing."""
    return tuple(Term("A", 0, 0, p.name, 0.0) for p in parameters)

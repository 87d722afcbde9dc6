"""Gradual penetration of a gust: the tail meets it after the vane, so a growing gust turns the air.

How strongly is not known beforehand: a small aircraft in long gusts feels the angle alone, one of
which the tail makes most of the damping feels both, and shape and length of the gusts differ. Left
out, M_alpha was 55 % and M_q 160 % off on simulated flights in which the air turns, taken for known
(MIL-F-8785C, 3.7.5) they were 15 to 40 % off where it does not; free, both are within 2 %.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from host.arrays import Array
from host.sysid.models.state_space_model import LinearModel, Parameter, Term

PREFIX = "gust_"
GUST_LAG = "gust_lag_radps"
# The air turns within the time to fly this far: tail arm or 4 b/pi of models of 1.2 to 2.5 m span.
LENGTH_M, LENGTH_SHARE = 1.5, 0.5
FARTHEST = 10.0  # times more or less: bounds of the search
GENEROUS = 2.0  # deviations of the effect, in effects of the same rate and angle of the aircraft


def penetration_name(parameter: str) -> str:
    """Return what the effect of turning air is called beside the effect of the aircraft's own."""
    return f"{PREFIX}{parameter.split('_')[0]}"


def with_gust_penetration(
    model: LinearModel, airspeed_mps: float, start: Array
) -> tuple[LinearModel, Array]:
    """Return the model with the effects of turning air as parameters, and the start with theirs.

    A model without alpha or q feels none and stays as it is.

    The parameters act through the gust alone (`gust_model`): ``gust_Z`` in 1/s, ``gust_M`` in 1/s2,
    ``gust_lag_radps``.

    Parameters
    ----------
    model : LinearModel
        Without delays.
    airspeed_mps : float
        Of the trim.
    start : Array, shape (P,)
        Common parameters of the model first.
    """
    if not {"alpha_rad", "q_radps"} <= set(model.states):
        return model, start
    count = len(model.parameters)
    size = dict(zip((p.name for p in model.parameters), np.abs(start), strict=False))
    alpha, q = model.states.index("alpha_rad"), model.states.index("q_radps")
    lag = airspeed_mps / LENGTH_M
    effects: dict[str, float] = {}
    for term in model.terms:
        if term.matrix == "A" and term.column == q:
            own = [
                t for t in model.terms if t.matrix == "A" and (t.row, t.column) == (term.row, alpha)
            ]
            beside = sum(size[t.parameter] for t in own)
            effects[penetration_name(term.parameter)] = lag * size[term.parameter] + beside
    more = (
        *(Parameter(name, prior_sd=GENEROUS * sd) for name, sd in effects.items() if sd > 0.0),
        Parameter(
            GUST_LAG,
            lag,
            lower=lag / FARTHEST,
            upper=lag * FARTHEST,
            prior_sd=LENGTH_SHARE * lag,
        ),
    )
    wide = replace(
        model, parameters=(*model.parameters, *more), terms=(*model.terms, *_idle(model, more))
    )
    return wide, np.concatenate([start[:count], [p.start for p in more], start[count:]])


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
    return replace(
        model, parameters=(*model.parameters, *more), terms=(*model.terms, *_idle(model, more))
    )


def _idle(model: LinearModel, parameters: tuple[Parameter, ...]) -> tuple[Term, ...]:
    """Return entries of no gain: without a gust these parameters move nothing."""
    if not parameters:
        return ()
    alpha = model.states.index("alpha_rad")
    return tuple(Term("A", alpha, alpha, p.name, 0.0) for p in parameters)

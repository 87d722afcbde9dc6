"""A linear model with the gust among its states."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from host.errors import IdentificationError
from host.sysid.estimators.gust_penetration import GUST_LAG, ROLL_LAG, penetration_name
from host.sysid.models.fit_result import FitResult
from host.sysid.models.state_space_model import LinearModel, Parameter, Term

SCALE_M = 30.0  # of vertical gusts: about the height flown (MIL-F-8785C, sec. 3.7, low altitude)
VANES = ("alpha_rad", "beta_rad")
TURNS = {"alpha_rad": ("q_radps", -1.0), "beta_rad": ("r_radps", 1.0)}  # a gust at the tail later
ROLL_GUST = "gust_roll_radps"
LAGGED_GUST = "gust_lagged_rad"


def gust_model(
    base: LinearModel,
    airspeed_mps: float,
    scale_m: float = SCALE_M,
    *,
    span_m: float | None = None,
    scale_share: float = 0.0,
) -> LinearModel:
    """Return a model with the gust angle as an extra state.

    A vertical (or side) gust is an angle of attack (sideslip) to vanes, forces and moments alike,
    so its entries are those of the angle and only its intensity is new. Where the model has the
    parameters of `gust_penetration.with_gust_penetration`, the tail meets it later. Its
    Dryden spectrum (EQUATIONS.md, eq. 9) is that of white noise behind 1 / (1 + T s) with
    T = L / V, or with `span_m` behind (1 + sqrt(3) T s) / (1 + T s)^2; air that turns is eq. 10.

    Parameters
    ----------
    base : LinearModel
        A template; alpha or beta must be a measured state of it.
    airspeed_mps : float
        Airspeed at trim, for the gust's time scale, m/s.
    scale_m : float
        Scale length L of the gusts, m.
    span_m : float, optional
        Wing span, m. With it the gust has the second-order spectrum across the flight path, acts as
        a pitch (yaw) rate because it reaches the tail later, and has a rolling component in the
        lateral motion; without it the first-order spectrum of the angle alone.
    scale_share : float
        Relative deviation of `scale_m`; above zero the rate V / L is a parameter, ``gust_rate``,
        after the others.

    Raises
    ------
    IdentificationError
        If neither alpha nor beta is a measured state of it.
    """
    vane, rate = _vane(base), airspeed_mps / scale_m
    lag = 0.0 if span_m is None else np.pi * airspeed_mps / (4.0 * span_m)
    gust_states, entries, fixed = _spectrum(base, vane, lag)
    penetrates, rolls = GUST_LAG in base.parameter_names, ROLL_LAG in base.parameter_names
    gust_states |= {LAGGED_GUST: {}} if penetrates else {}
    gust_states |= {ROLL_GUST: {"p_radps": 1.0}} if rolls else {}
    states = (*base.states, *gust_states)
    n, total = len(base.states), len(base.states) + len(gust_states)
    A, C = np.zeros((total, total)), np.zeros((len(base.outputs), total))
    A[:n, :n], C[:, :n] = base.A, base.C
    terms = list(base.terms)
    for column, acts in enumerate(gust_states.values(), start=n):
        terms += _acting_like(base, acts, column)
        if vane in acts:  # the vane measures the gust as well
            C[:, column] += acts[vane] * base.C[:, base.states.index(vane)]
    if penetrates:
        terms += _penetration_terms(base, states, base.states.index(TURNS[vane][0]))
    if rolls:
        roll = states.index(ROLL_GUST)
        terms.append(Term("A", roll, roll, ROLL_LAG, -1.0))
    parameters = base.parameters
    if scale_share > 0.0:
        terms += [
            Term("A", states.index(a), states.index(b), "gust_rate", g) for a, b, g in entries
        ]
        parameters += (
            Parameter(
                "gust_rate", rate, lower=0.1 * rate, upper=10.0 * rate, prior_sd=scale_share * rate
            ),
        )
    else:
        fixed += [(a, b, g * rate) for a, b, g in entries]
    for row, source, value in fixed:
        A[states.index(row), states.index(source)] = value
    return replace(
        base,
        name=f"{base.name} with gust",
        states=states,
        # The air rolls already where a record begins. Taken for still, it seems quicker than it is,
        # and L_p is 5 % small in rolling air of 1 m/s. The start of sideways air changes nothing.
        initial_states=(*base.initial_states, *((ROLL_GUST,) if rolls else ())),
        A=A,
        B=np.vstack([base.B, np.zeros((len(gust_states), len(base.inputs)))]),
        C=C,
        terms=tuple(terms),
        parameters=parameters,
        delays=(),
    )


def _vane(base: LinearModel) -> str:
    """Return the angle that a gust is; refuse a model without one."""
    vanes = [v for v in VANES if v in base.states and v in base.outputs]
    if not vanes:
        raise IdentificationError(f"model {base.name}: no vane angle a gust could act on")
    return vanes[0]


def _spectrum(
    base: LinearModel, vane: str, lag: float
) -> tuple[dict[str, dict[str, float]], list[tuple[str, str, float]], list[tuple[str, str, float]]]:
    """Return the gust's states, each with the columns of the base that it acts like and gains.

    Behind them their entries times the gust's rate, and those that are fixed. `lag` is how fast
    the tail follows, 1/s; without one the spectrum is of first order.
    """
    if lag == 0.0:
        return {"gust_rad": {vane: 1.0}}, [("gust_rad", "gust_rad", -1.0)], []
    lead, trail = np.sqrt(3.0), 1.0 - np.sqrt(3.0)
    rate, sign = TURNS[vane]
    states = {
        "gust_rad": {vane: lead, rate: sign * lag * lead},
        "gust_lag_rad": {vane: trail, rate: sign * lag * trail},
        "gust_tail_rad": {rate: -sign * lag},
    }
    entries = [
        ("gust_rad", "gust_rad", -1.0),
        ("gust_lag_rad", "gust_rad", 1.0),
        ("gust_lag_rad", "gust_lag_rad", -1.0),
    ]
    fixed = [
        ("gust_tail_rad", "gust_rad", lag * lead),
        ("gust_tail_rad", "gust_lag_rad", lag * trail),
        ("gust_tail_rad", "gust_tail_rad", -lag),
    ]
    if vane == "beta_rad" and "p_radps" in base.states:
        states[ROLL_GUST] = {"p_radps": 1.0}
        fixed.append((ROLL_GUST, ROLL_GUST, -lag))
    return states, entries, fixed


def _acting_like(base: LinearModel, acts: Mapping[str, float], column: int) -> list[Term]:
    """Return the terms of a state that acts like others of the base, so many times each."""
    return [
        Term(t.matrix, t.row, column, t.parameter, t.gain * gain)
        for state, gain in acts.items()
        for t in base.terms
        if t.matrix in "AC" and t.column == base.states.index(state)
    ]


def driven_model(model: LinearModel, process: Sequence[str], airspeed_mps: float) -> LinearModel:
    """Return the model with every state that process noise drives: a template gets its gust.

    Parameters
    ----------
    model : LinearModel
        As fitted. A template has no gust state yet; a user's model has its own.
    process : sequence of str
        States that `innovations.driven_states` names.
    airspeed_mps : float
        Airspeed at trim, m/s.
    """
    return model if set(process) <= set(model.states) else gust_model(model, airspeed_mps)


def gust_deviation_mps(result: FitResult, airspeed_mps: float) -> float:
    """Return the deviation of the gusts that `gust_model` found, m/s; 0 of other methods."""
    name = "log_process.gust_rad"
    if name not in result.names:
        return 0.0
    return float(np.exp(result.value(name)) * np.sqrt(0.5 * SCALE_M * airspeed_mps))


def _penetration_terms(base: LinearModel, states: tuple[str, ...], rate: int) -> list[Term]:
    """Return what the gust's growth, seen from the tail, does to moments and forces.

    The air turns by lag (g - g_lagged), d g_lagged/dt = lag (g - g_lagged) (MIL-F-8785C, 3.7.5).
    """
    gust, lagged = states.index("gust_rad"), states.index(LAGGED_GUST)
    terms = [Term("A", lagged, gust, GUST_LAG), Term("A", lagged, lagged, GUST_LAG, -1.0)]
    for t in base.terms:
        name = penetration_name(t.parameter)
        if t.matrix in "AC" and t.column == rate and name in base.parameter_names:
            terms += [
                Term(t.matrix, t.row, gust, name, t.gain),
                Term(t.matrix, t.row, lagged, name, -t.gain),
            ]
    return terms

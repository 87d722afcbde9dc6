"""Filter error with the gust as a state, after output error has estimated the delays."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from host.arrays import Array
from host.sysid.estimators.filter_error import fit_filter_error
from host.sysid.estimators.innovations import innovations_of
from host.sysid.estimators.method_registry import fit
from host.sysid.estimators.start_values import start_values_of
from host.sysid.identification_error import IdentificationError
from host.sysid.models.fit_result import FitResult
from host.sysid.models.maneuver import Maneuver
from host.sysid.models.state_space_model import LinearModel, Parameter, Term

SCALE_M = 30.0  # of vertical gusts: about the height flown (MIL-F-8785C, sec. 3.7, low altitude)
VANES = ("alpha_rad", "beta_rad")
# What else disturbs: thrust and longitudinal gusts; the drift of the attitude filter.
OTHER_PROCESS_STATES = ("airspeed_mps", "phi_rad")
ROLL_GUST = "gust_roll_radps"


@dataclass(frozen=True)
class GustFit:
    """Result on the model without the gust, its maneuvers with delays removed, and the delays.

    `delays` has value and 95 % half-width of each, s.
    """

    result: FitResult
    model: LinearModel
    maneuvers: tuple[Maneuver, ...]
    delays: dict[str, tuple[float, float]]


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
    so its entries are those of the angle and only its intensity is new. Its Dryden spectrum
    (MIL-F-8785C, sec. 3.7) is that of white noise behind 1 / (1 + T s) with T = L / V, or with
    `span_m` behind (1 + sqrt(3) T s) / (1 + T s)^2.

    Parameters
    ----------
    base : LinearModel
        A template; alpha or beta must be a measured state of it.
    airspeed_mps : float
        Of the trim, for the gust's time scale, m/s.
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
    vanes = [v for v in VANES if v in base.states and v in base.outputs]
    if not vanes:
        raise IdentificationError(f"model {base.name}: no vane angle a gust could act on")
    vane, rate = vanes[0], airspeed_mps / scale_m
    lag = 0.0 if span_m is None else np.pi * airspeed_mps / (4.0 * span_m)
    rate_effect = {"alpha_rad": ("q_radps", -1.0), "beta_rad": ("r_radps", 1.0)}[vane]
    # Columns of the base that each gust state acts like, with gains.
    gust_states: dict[str, dict[str, float]] = {"gust_rad": {vane: 1.0}}
    entries = [("gust_rad", "gust_rad", -1.0)]
    fixed: list[tuple[str, str, float]] = []
    if span_m is not None:
        lead, trail = np.sqrt(3.0), 1.0 - np.sqrt(3.0)
        entries += [("gust_lag_rad", "gust_rad", 1.0), ("gust_lag_rad", "gust_lag_rad", -1.0)]
        gust_states = {
            "gust_rad": {vane: lead, rate_effect[0]: rate_effect[1] * lag * lead},
            "gust_lag_rad": {vane: trail, rate_effect[0]: rate_effect[1] * lag * trail},
            "gust_tail_rad": {rate_effect[0]: -rate_effect[1] * lag},
        }
        fixed = [
            ("gust_tail_rad", "gust_rad", lag * lead),
            ("gust_tail_rad", "gust_lag_rad", lag * trail),
            ("gust_tail_rad", "gust_tail_rad", -lag),
        ]
        if vane == "beta_rad" and "p_radps" in base.states:
            gust_states[ROLL_GUST] = {"p_radps": 1.0}
            fixed.append((ROLL_GUST, ROLL_GUST, -lag))
    states = (*base.states, *gust_states)
    n, total = len(base.states), len(base.states) + len(gust_states)
    A, C = np.zeros((total, total)), np.zeros((len(base.outputs), total))
    A[:n, :n], C[:, :n] = base.A, base.C
    terms = list(base.terms)
    for column, (_, acts) in enumerate(gust_states.items(), start=n):
        for state, gain in acts.items():
            source = base.states.index(state)
            terms += [
                Term(t.matrix, t.row, column, t.parameter, t.gain * gain)
                for t in base.terms
                if t.matrix in "AC" and t.column == source
            ]
            if state == vane:  # the vane measures the gust as well
                C[:, column] += gain * base.C[:, source]
    for row, source_name, value in fixed:
        A[states.index(row), states.index(source_name)] = value
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
        for a, b, g in entries:
            A[states.index(a), states.index(b)] = g * rate
    return replace(
        base,
        name=f"{base.name} with gust",
        states=states,
        A=A,
        B=np.vstack([base.B, np.zeros((len(gust_states), len(base.inputs)))]),
        C=C,
        terms=tuple(terms),
        parameters=parameters,
        delays=(),
    )


def fit_with_gust(
    model: LinearModel, maneuvers: Sequence[Maneuver], airspeed_mps: float
) -> GustFit:
    """Fit a template in two stages: delays by output error, then filter error with the gust.

    Parameters
    ----------
    model : LinearModel
        With the delays and accelerometer offsets to be estimated.
    maneuvers : sequence of Maneuver
        Data as measured.
    airspeed_mps : float
        Of the trim, for the gust's time scale, m/s.
    """
    if not model.delays:
        start = start_values_of(model, maneuvers)
        result = _fit_gust_state(model, model, list(maneuvers), airspeed_mps, start)
        return GustFit(result, model, tuple(maneuvers), {})
    first = fit("output-error-white", model, maneuvers, multiple_starts=False)
    half = first.half_width()
    delays = {d.name: (first.value(d.name), float(half[first.index(d.name)])) for d in model.delays}
    shifts = np.zeros(len(model.outputs))
    for delay in model.delays:
        for output in delay.outputs:
            shifts[model.outputs.index(output)] = delays[delay.name][0]
    shifted = [_advance_outputs(m, shifts) for m in maneuvers]
    count = len(model.parameters)
    start = np.concatenate([first.estimate[:count], first.estimate[len(model.parameter_names) :]])
    plain = replace(model, delays=())
    result = _fit_gust_state(model, plain, shifted, airspeed_mps, start)
    if result.residual_kind == "innovation":
        covariance = result.covariance.copy()
        covariance[:count, :count] += _delay_covariance(first, model)
        result = replace(result, covariance=covariance)
    return GustFit(result=result, model=plain, maneuvers=tuple(shifted), delays=delays)


def _fit_gust_state(
    model: LinearModel,
    plain: LinearModel,
    maneuvers: Sequence[Maneuver],
    airspeed_mps: float,
    start: Array,
) -> FitResult:
    """Return filter error with the gust as a state; output error if that does not converge."""
    process = ("gust_rad", *(s for s in OTHER_PROCESS_STATES if s in model.states))
    augmented = gust_model(model, airspeed_mps)
    try:
        result = fit_filter_error(
            augmented, maneuvers, process=process, start=start, compare_noise=False
        )
        failure = "" if result.converged else result.warnings[0]
    except IdentificationError as error:
        failure = str(error)
    if not failure:
        innovations = innovations_of(result, augmented, maneuvers)
        return replace(
            result,
            method="filter error with gust",
            model=plain,
            covariance=result.covariance
            if innovations is None
            else innovations.coloured_covariance(),
        )
    # Output error has wider intervals, but a search that has not converged has none.
    result = fit("output-error-white", plain, maneuvers, start=start, multiple_starts=False)
    return replace(
        result,
        warnings=(*result.warnings, f"filter error: {failure}; output error stands instead"),
    )


def _delay_covariance(first: FitResult, model: LinearModel) -> Array:
    """Return the covariance that the uncertain delays add to that of the parameters.

    The second stage takes the delays for known. By the first one the parameters depend on them as d
    theta / d tau = C_theta_tau C_tau_tau^-1, so that C_theta_tau C_tau_tau^-1 C_tau_theta is added.
    """
    count, names = len(model.parameters), len(model.parameter_names)
    own = first.covariance[count:names, count:names]
    cross = first.covariance[:count, count:names]
    estimated = np.flatnonzero(np.diag(own) > 0.0)
    if len(estimated) == 0:
        return np.zeros((count, count))
    part = (
        cross[:, estimated]
        @ np.linalg.pinv(own[np.ix_(estimated, estimated)])
        @ cross[:, estimated].T
    )
    return np.asarray(0.5 * (part + part.T), dtype=np.float64)


def _advance_outputs(maneuver: Maneuver, shifts_s: Array) -> Maneuver:
    """Return the maneuver with each output advanced by its delay (s)."""
    t = maneuver.time_s
    columns = [
        np.interp(t + shift, t, column)
        for shift, column in zip(shifts_s, maneuver.outputs.T, strict=True)
    ]
    return replace(maneuver, outputs=np.column_stack(columns))

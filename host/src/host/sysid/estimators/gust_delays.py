"""Delays of the sensors, estimated by filter error with the gust.

Output error takes the gust for noise of the sensors. What a gust does to vane, gyro and
accelerometers then passes for delays: on simulated flights without any, gusts of 1 m/s, it finds 16
ms of the vane and 4 ms of the IMU, and M_alpha is 6 to 10 % off by that, M_q 17 %. A filter that
has the gust tells both apart.

A delay tau of output y enters as y - tau dy/dt, with dy/dt = C (A x + B u) + D du/dt of the
estimate before: the model stays linear in its parameters. The columns are advanced by what was
found and the filter runs again, so that tau tends to zero, where this is exact. A vane in gusts has
no slope; its delay is a Pade filter (`_with_delay_terms`).
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from host.arrays import Array
from host.constants import NORMAL_95
from host.errors import IdentificationError
from host.sysid.estimators.filter_error import fit_filter_error, near_its_optimum
from host.sysid.estimators.gust_model import VANES, gust_deviation_mps, gust_model
from host.sysid.estimators.gust_penetration import PREFIX, with_gust_penetration
from host.sysid.models.fit_result import FitResult
from host.sysid.models.maneuver import Maneuver
from host.sysid.models.rate_forces import has_rate_forces
from host.sysid.models.residual_delays import advance_outputs, moved_outputs
from host.sysid.models.state_space_model import DelayGroup, LinearModel, Parameter, Term
from host.sysid.numerics.output_error_problem import OutputProblem

ROUNDS = 3
PADE_STATES = 3
SHORTEST_SHARE = 0.2  # of a sample: least delay that is left of a vane's, set back by one
# One deviation of what a line between samples of a moving surface, and gusts of another form, pass
# for, as a share of a sample: 0.2 to 0.6 ms of an IMU without any delay are found at 10 ms, known
# to 0.2. Given the delay that the line makes of the surface parameters are right (M_q +0.2 % at
# -0.4 ms, 50 flights in calm air, where 0.2 ms counted in full makes its interval 1.6 times as
# wide): only gusts count it for them.
HOLD_SHARE = 0.02
# The same of a vane against them: what gusts do between samples. 0.1 to 0.2 ms are found in
# Dryden's air and 0.3 to 0.5 in von Karman's of a vane without any delay, known to 0.17 at 10 ms (4
# and 8 flights of 1 m/s); half of it makes M_alpha 1.0 % large, known to 1.2 to 1.4.
VANE_SHARE = 0.03
CALM_MPS = 0.1  # deviation of gusts, well below which they pass for nothing
SETTLED_SD = 0.3  # a round that moves a delay by less is the last
# The pitot feels gusts along the path that the model has not: its delay goes to 50 ms.
GUST_BLIND = ("airspeed_mps",)
# Without the force that goes with a wind angle a vane's delay looks like a gust, and like the lift
# of pitching, which the model lacks then: -15 to +11 ms are found of vanes without any delay, known
# to 5, and M_q is 12 % off. What is known before stays.
FORCES = ("ay_mps2", "az_mps2")
# With the lift of pitching among the parameters gusts tell it, by what they are taken to be: 53 and
# 9 ms are found for 20 of a light aircraft, known to 4 and 3; ten other records hold.
GUST_FORM = 3.0


@dataclass(frozen=True)
class DelayEstimate:
    """Delays of the sensors and what they leave open of the parameters.

    Attributes
    ----------
    delays : dict
        Value and 95 % half-width of each, s.
    estimate : Array, shape (P,)
        Parameters estimated with them.
    covariance : Array, shape (P, P)
        What the uncertain delays add to that of the parameters.
    """

    delays: dict[str, tuple[float, float]]
    estimate: Array
    covariance: Array


def estimate_delays(
    model: LinearModel,
    maneuvers: Sequence[Maneuver],
    airspeed_mps: float,
    first: FitResult,
    start: Array,
    process: tuple[str, ...],
) -> DelayEstimate:
    """Return the delays by filter error with the gust; none, known as output error has it, if that
    fails.

    Parameters
    ----------
    model : LinearModel
        With delays.
    maneuvers : sequence of Maneuver
        As measured.
    airspeed_mps : float
    first : FitResult
        Fit of output error, with the delays.
    start : Array, shape (P + constants,)
        Parameters and constants of every maneuver, without delays.
    process : tuple of str
        States that process noise drives.
    """
    count = len(model.parameters)
    groups = [d for d in model.delays if not set(d.outputs) <= set(GUST_BLIND)]
    by_force = bool(set(FORCES) & set(model.outputs))
    vanes = [d for d in groups if not by_force and _late_by_pade(d)]
    by_prior = [] if has_rate_forces(model) else vanes
    found, estimate, values = _searched(
        model, groups, by_prior, maneuvers, airspeed_mps, start[:count], process
    )
    if found is None or not near_its_optimum(found):
        half = first.half_width()
        delays = {d.name: (0.0, float(half[first.index(d.name)])) for d in groups}
        return DelayEstimate(delays, estimate, _added_covariance(first, list(values), count))
    found = _known_no_better(found, vanes, np.inf if by_prior else GUST_FORM)
    uncertain, counted = _with_what_passes(found, groups, model, maneuvers, airspeed_mps)
    half = NORMAL_95 * uncertain.standard_error
    return DelayEstimate(
        {n: (v, float(half[uncertain.index(n)])) for n, v in values.items()},
        estimate,
        _added_covariance(counted, list(values), count),
    )


def _searched(
    model: LinearModel,
    groups: Sequence[DelayGroup],
    known: Sequence[DelayGroup],
    maneuvers: Sequence[Maneuver],
    airspeed_mps: float,
    estimate: Array,
    process: tuple[str, ...],
) -> tuple[FitResult | None, Array, dict[str, float]]:
    """Return the last round's fit, its parameters, and all of each delay, in rounds.

    What a round finds goes out of the outputs before the next; of delays that are `known` nothing.
    """
    dt_s = max(m.dt_s for m in maneuvers)
    values = {d.name: 0.0 for d in groups}
    found = None
    for _ in range(ROUNDS):
        removed = {d.name: _removable(d, values[d.name], dt_s) for d in groups}
        shifted = [advance_outputs(m, model, removed) for m in maneuvers]
        step = _round(model, groups, shifted, airspeed_mps, estimate, removed, process)
        if step is None:
            break
        found, estimate, before = step, step.estimate[: len(model.parameters)], values
        values = {
            d.name: float(np.clip(removed[d.name] + step.value(d.name), -d.limit_s, d.limit_s))
            for d in groups
        } | dict.fromkeys((d.name for d in known), 0.0)
        sd = step.standard_error
        if near_its_optimum(step) and all(
            abs(values[n] - before[n]) < SETTLED_SD * sd[step.index(n)] for n in values
        ):
            break
    return found, estimate, values


def _with_what_passes(
    found: FitResult,
    groups: Sequence[DelayGroup],
    model: LinearModel,
    maneuvers: Sequence[Maneuver],
    airspeed_mps: float,
) -> tuple[FitResult, FitResult]:
    """Return the fit with all that passes for a delay, and with what of it moves parameters."""
    dt_s = max(m.dt_s for m in maneuvers)
    gust_mps = gust_deviation_mps(found, airspeed_mps)
    by_gusts = gust_mps / float(np.hypot(gust_mps, CALM_MPS))
    passing_s = {
        d.name: by_gusts * VANE_SHARE * dt_s
        if _late_by_pade(d)
        else HOLD_SHARE * sampling_step_s(d, model, maneuvers)
        for d in groups
    }
    less_s = {d.name: passing_s[d.name] * (1.0 if _late_by_pade(d) else by_gusts) for d in groups}
    return _with_hold_error(found, groups, passing_s), _with_hold_error(found, groups, less_s)


def sampling_step_s(delay: DelayGroup, model: LinearModel, maneuvers: Sequence[Maneuver]) -> float:
    """Return the mean step at which the quickest output of a delay was measured, s."""
    columns = [model.outputs.index(y) for y in delay.outputs if y in model.outputs]
    quickest = [np.max(np.mean(m.seen[:, columns], axis=0), initial=0.0) for m in maneuvers]
    return max(m.dt_s / max(float(q), 1e-3) for m, q in zip(maneuvers, quickest, strict=True))


def _round(
    model: LinearModel,
    groups: Sequence[DelayGroup],
    maneuvers: Sequence[Maneuver],
    airspeed_mps: float,
    estimate: Array,
    removed: Mapping[str, float],
    process: tuple[str, ...],
) -> FitResult | None:
    """Fit parameters, gust and remaining delays; None if the filter fails."""
    plain, theta = with_gust_penetration(replace(model, delays=()), airspeed_mps, estimate)
    dt_s = max(m.dt_s for m in maneuvers)
    late = _with_delay_terms(gust_model(plain, airspeed_mps), groups, theta, removed, dt_s)
    centred = [_centred(m, model, dt_s) for m in maneuvers]
    start = OutputProblem(late, centred).first_guess()
    start[: len(theta)] = theta
    start[len(theta) : len(late.parameters)] = [
        1.0 / dt_s if _late_by_pade(d) else 0.0 for d in groups
    ]
    try:
        found = fit_filter_error(late, centred, process=process, start=start, compare_noise=False)
    except IdentificationError:
        return None
    return _as_delays(found, groups, dt_s)


def _with_delay_terms(
    wide: LinearModel,
    groups: Sequence[DelayGroup],
    theta: Array,
    removed: Mapping[str, float],
    dt_s: float,
) -> LinearModel:
    """Return the model with delays as parameters, rates of the inputs as further inputs.

    A vane in gusts has no slope, for what it measures is driven by white noise. It comes a sample
    later than it was measured (`_centred`), and its delay of that length is a Pade filter of third
    order, y = -u + 240 z1 + 24 z3 with T dz1/dt = z2, T dz2/dt = z3 and T dz3/dt = u - 120 z1 - 60
    z2 - 12 z3. The parameter is 1 / T, in which the model is linear (`_as_delays`). The filter of
    second order is 7 % short at half the sampling rate: a vane seems 0.9 ms late by it.
    """
    _, _, C, _ = wide.matrices(theta)
    n, count = len(wide.states), len(wide.inputs)
    vanes = [(d, y) for d in groups for y in d.outputs if y in VANES and y in wide.outputs]
    size = n + PADE_STATES * len(vanes)
    wider_A, wider_C = np.zeros((size, size)), np.zeros((len(wide.outputs), size))
    wider_A[:n, :n], wider_C[:, :n] = wide.A, wide.C
    late = {wide.outputs.index(y) for _, y in vanes}
    terms = [
        replace(t, gain=-t.gain) if t.matrix == "C" and t.row in late else t for t in wide.terms
    ]
    for number, (delay, name) in enumerate(vanes):
        k, first = wide.outputs.index(name), n + PADE_STATES * number
        last = first + 2
        wider_C[k, :n] *= -1.0
        wider_C[k, first], wider_C[k, last] = 240.0, 24.0
        terms += _pade_terms(delay.name, first, C[k])
    terms += _slope_terms(wide, groups, theta, late)
    still, by_force = np.zeros((size - n, 2 * count)), bool(set(FORCES) & set(wide.outputs))
    return replace(
        wide,
        states=(*wide.states, *(f"{y} late by {k}" for _, y in vanes for k in range(PADE_STATES))),
        inputs=(*wide.inputs, *(f"rate of {name}" for name in wide.inputs)),
        A=wider_A,
        B=np.vstack([np.hstack([wide.B, np.zeros_like(wide.B)]), still]),
        C=wider_C,
        D=np.hstack([wide.D, np.zeros_like(wide.D)]),
        terms=tuple(terms),
        parameters=(
            *wide.parameters,
            *(_parameter(d, removed[d.name], dt_s, by_force=by_force) for d in groups),
        ),
    )


def _pade_terms(name: str, first: int, gains: Array) -> list[Term]:
    """Return the filter of a vane that is late, its states from `first`, driven by what it sees."""
    last = first + 2
    return [
        Term("A", first, first + 1, name),
        Term("A", first + 1, last, name),
        *(Term("A", last, first + j, name, g) for j, g in enumerate((-120.0, -60.0, -12.0))),
        *(Term("A", last, j, name, float(g)) for j, g in enumerate(gains) if g),
    ]


def _slope_terms(
    wide: LinearModel, groups: Sequence[DelayGroup], theta: Array, late: Collection[int]
) -> list[Term]:
    """Return what delays of outputs but the `late` ones do: minus the outputs' rates.

    An output that sees the gust has no rate by gust states.
    """
    A, B, C, D = wide.matrices(theta)
    by_state, by_input, count = C @ A, C @ B, len(wide.inputs)
    gust = np.array([name.startswith(PREFIX) for name in wide.states])
    by_state[np.ix_(np.any(C[:, gust] != 0.0, axis=1), gust)] = 0.0
    at = [(d.name, wide.outputs.index(y)) for d in groups for y in d.outputs if y in wide.outputs]
    rates = (("C", 0, by_state), ("D", 0, by_input), ("D", count, D))
    return [
        Term(matrix, k, first + j, name, -float(gain))
        for name, k in at
        if k not in late
        for matrix, first, gains in rates
        for j, gain in enumerate(gains[k])
        if gain
    ]


def _late_by_pade(delay: DelayGroup) -> bool:
    return bool(set(delay.outputs) & set(VANES))


def _removable(delay: DelayGroup, value_s: float, dt_s: float) -> float:
    """Return what to advance by; of vanes whole samples, for interpolation would smooth gusts."""
    return dt_s * round(value_s / dt_s) if _late_by_pade(delay) else value_s


def _parameter(delay: DelayGroup, removed_s: float, dt_s: float, *, by_force: bool) -> Parameter:
    """Return a delay as parameter whose first part is removed; the prior is of all."""
    if not _late_by_pade(delay):
        return Parameter(delay.name, -removed_s, prior_sd=delay.prior_sd_s)
    return Parameter(
        delay.name,
        # About the whole of it where little else tells it. A force tells it better than the prior:
        # about T = dt, where what is left of it ends, searches end that did not about the whole.
        1.0 / dt_s + (0.0 if by_force else removed_s / dt_s**2),
        lower=1.0 / (dt_s + delay.limit_s),
        upper=1.0 / (SHORTEST_SHARE * dt_s),
        prior_sd=delay.prior_sd_s / dt_s**2,
    )


def _centred(maneuver: Maneuver, model: LinearModel, dt_s: float) -> Maneuver:
    """Return deviations from the means, vanes a sample later: of a trim a delay shows nothing."""
    late = moved_outputs(
        maneuver, np.array([-dt_s if name in VANES else 0.0 for name in model.outputs])
    )
    inputs = maneuver.inputs - maneuver.inputs.mean(axis=0)
    rates = np.gradient(inputs, maneuver.dt_s, axis=0)
    return replace(
        late,
        inputs=np.hstack([inputs, rates]),
        outputs=late.outputs - late.outputs.mean(axis=0),
    )


def _as_delays(found: FitResult, groups: Sequence[DelayGroup], dt_s: float) -> FitResult:
    """Return the fit with 1 / T of vanes as the delay beyond a sample, T - dt."""
    estimate, by = found.estimate.copy(), np.ones(len(found.estimate))
    for delay in groups:
        if _late_by_pade(delay):
            k = found.index(delay.name)
            by[k] = -1.0 / estimate[k] ** 2
            estimate[k] = 1.0 / estimate[k] - dt_s
    return replace(found, estimate=estimate, covariance=found.covariance * np.outer(by, by))


def _with_hold_error(
    found: FitResult, groups: Sequence[DelayGroup], sd_s: Mapping[str, float]
) -> FitResult:
    """Return the fit with what else passes for a delay, one deviation, parameters moving along."""
    covariance = found.covariance.copy()
    for delay in groups:
        k = found.index(delay.name)
        if covariance[k, k] > 0.0:
            by = covariance[:, k] / covariance[k, k]
            covariance += sd_s[delay.name] ** 2 * np.outer(by, by)
    return replace(found, covariance=covariance)


def _known_no_better(found: FitResult, groups: Sequence[DelayGroup], times: float) -> FitResult:
    """Return the fit with delays so many times less known, at most to their priors.

    Parameters move along.
    """
    covariance = found.covariance.copy()
    for delay in groups:
        k = found.index(delay.name)
        if 0.0 < covariance[k, k] < delay.prior_sd_s**2:
            by = covariance[:, k] / covariance[k, k]
            variance = min(delay.prior_sd_s**2, times**2 * covariance[k, k])
            covariance += (variance - covariance[k, k]) * np.outer(by, by)
    return replace(found, covariance=covariance)


def _added_covariance(found: FitResult, names: Sequence[str], count: int) -> Array:
    """Return the covariance that uncertain delays add to that of the first `count` parameters.

    The fit behind takes the delays for known. By the one before the parameters depend on them as d
    theta / d tau = C_theta_tau C_tau_tau^-1, so that C_theta_tau C_tau_tau^-1 C_tau_theta is added.
    """
    at = np.array([found.index(n) for n in names], dtype=np.int64)
    at = at[np.diag(found.covariance)[at] > 0.0]
    if len(at) == 0:
        return np.zeros((count, count))
    cross = found.covariance[:count, at]
    part = cross @ np.linalg.pinv(found.covariance[np.ix_(at, at)]) @ cross.T
    return np.asarray(0.5 * (part + part.T), dtype=np.float64)

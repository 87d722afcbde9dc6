"""A user's model: the method that was asked for, or the one for the noise that the data show.

Output error takes noise for white and pays for coloured residuals in its intervals (Morelli &
Klein), unless moving air that the aircraft follows tells more of what was not fitted. That is
filter error, with the gust as a state where the model has a vane and the airspeed is known. What
was asked for is done or refused, never replaced.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from host.arrays import Array
from host.errors import IdentificationError
from host.sysid.estimators.filter_error import near_its_optimum
from host.sysid.estimators.filter_error_gust import SLOW_IN_CALM, fit_with_gust
from host.sysid.estimators.gust_model import VANES
from host.sysid.estimators.method_fit import fit
from host.sysid.estimators.output_error_fit import sample_periods
from host.sysid.linear.linear_stages import LinearFit
from host.sysid.linear.one_step_evidence import (
    coloured,
    cost_by_innovations,
    cost_by_residuals,
    first_part,
)
from host.sysid.models.fit_result import FitResult
from host.sysid.models.maneuver import Maneuver
from host.sysid.models.residual_delays import advance_outputs
from host.sysid.models.state_space_model import LinearModel, has_equations
from host.sysid.numerics.model_problems import needs_compiler

GUST, FILTER = "filter-error-gust", "filter-error"
MEMORY, WHITE = "output-error", "output-error-white"
NOISE_CHOSEN = "noise model"  # begins what is said of the choice
AT_LIMIT = 1e-9
# Samples times unknowns times signals of another delay. By filter error 420 000, six degrees of
# freedom, take forty seconds of processor time, 950 000, flight-path reconstruction, thirteen.
MOST_WORK = 1_200_000


def fit_users_model(
    method: str,
    model: LinearModel,
    maneuvers: Sequence[Maneuver],
    airspeed_mps: float | None,
    options: Mapping[str, object],
) -> LinearFit:
    """Fit by a method that was asked for.

    Parameters
    ----------
    method : str
    model : LinearModel
    maneuvers : sequence of Maneuver
    airspeed_mps : float or None
        Airspeed at trim, for the time scale of gusts; None where nobody measured it.
    options : mapping
        Options of the method.

    Raises
    ------
    IdentificationError
        If the method cannot fit this model; in one line, with what can.
    """
    if method == GUST:
        return _gust_fit(model, maneuvers, airspeed_mps)
    if method == FILTER:
        return _filter_fit(model, maneuvers, options)
    own = method.startswith(MEMORY)
    single = {"multiple_starts": False, "model_error": False} if own else {}
    return _found(method, fit(method, model, maneuvers, **{**single, **options}), (*maneuvers,))


def fit_by_evidence(
    model: LinearModel, maneuvers: Sequence[Maneuver], airspeed_mps: float | None
) -> LinearFit:
    """Fit by white output error, or by filter error where that tells more of what it did not see.

    No filter is tried where residuals are white.

    Parameters
    ----------
    model, maneuvers, airspeed_mps
        As for `fit_users_model`.

    Raises
    ------
    IdentificationError
        If output error fails.
    """
    plain = fit_users_model(WHITE, model, maneuvers, airspeed_mps, {})
    if not coloured(plain.result, maneuvers):
        return replace(plain, remarks=(f"{NOISE_CHOSEN}: white, for residuals are not coloured",))
    why = no_filter(model, maneuvers) or _too_long(model, maneuvers, len(plain.result.estimate))
    if why:
        return replace(plain, remarks=(f"{NOISE_CHOSEN}: white; no gust tried: {why}",))
    by_filter = GUST if not no_gust_state(model, airspeed_mps) else FILTER
    first = [first_part(m) for m in maneuvers]
    try:
        still, moving = (
            fit_users_model(method, model, first, airspeed_mps, {}) for method in (WHITE, by_filter)
        )
        ahead = cost_by_residuals(model, still.result, maneuvers)
        ahead -= cost_by_innovations(model, moving, maneuvers, airspeed_mps)
        if ahead > 0.0:
            line = f"{NOISE_CHOSEN}: gusts ({_likelier(ahead)} sensors' noise)"
            found = fit_users_model(by_filter, model, maneuvers, airspeed_mps, {})
            return replace(found, remarks=(line, *found.remarks))
    except IdentificationError as error:
        return replace(plain, remarks=(f"{NOISE_CHOSEN}: white; gust: {error}",))
    return replace(plain, remarks=(f"{NOISE_CHOSEN}: white ({_likelier(-ahead)} gusts)",))


def _likelier(ahead: float) -> str:
    return f"what was not fitted is e^{ahead:.0f} times likelier than by"


def _too_long(model: LinearModel, maneuvers: Sequence[Maneuver], unknowns: int) -> str:
    """Return why a filter of equations takes minutes; empty where it does not."""
    late = sum(bool({*d.outputs} & {*model.outputs}) for d in model.delays)  # inputs cost nothing
    work = sum(m.samples for m in maneuvers) * unknowns * (1 + late)
    if has_equations(model) and work > MOST_WORK:
        return f"that would take many minutes; --method {FILTER} does it"
    return ""


def no_filter(model: LinearModel, maneuvers: Sequence[Maneuver]) -> str:
    """Return why no Kalman filter fits this model to these data; empty where one does."""
    why = needs_compiler(model, maneuvers)
    if why:
        return why
    if model.known_noise:
        return "a filter estimates the noise, and this one is known"
    if has_equations(model) and not model.process_noise:
        return "process_noise of the model is empty"
    return ""


def no_gust_state(model: LinearModel, airspeed_mps: float | None) -> str:
    """Return why the gust is no state of this model; empty where it can be.

    The gust acts where parameters of the vane's angle stand. A number there may be kinematics, in
    which the angle of the path counts, or a known derivative, in which that of the air does.
    """
    vane = next((v for v in VANES if v in model.states and v in model.outputs), None)
    if has_equations(model):
        return "it has equations"
    if vane is None:
        return "neither alpha_rad nor beta_rad is a measured state of it"
    if airspeed_mps is None:
        return "airspeed_mps, which tells how fast gusts pass, is not in the data"
    column = model.states.index(vane)
    free = {t.row for t in model.terms if t.matrix in "AB"}
    known = [s for i, s in enumerate(model.states) if i in free and model.A[i, column] != 0.0]
    if known:
        return f"the entry of {vane} in the row of {', '.join(known)} is a number"
    return ""


def _found(
    method: str,
    result: FitResult,
    maneuvers: tuple[Maneuver, ...],
    delays: Mapping[str, tuple[float, float]] | None = None,
    remarks: tuple[str, ...] = (),
) -> LinearFit:
    """Return a fit whose maneuvers are as it got them: a filter's without delays."""
    return LinearFit(
        result, result.model, method, maneuvers, result.fitted, dict(delays or {}), remarks=remarks
    )


def _gust_fit(
    model: LinearModel, maneuvers: Sequence[Maneuver], airspeed_mps: float | None
) -> LinearFit:
    why = no_gust_state(model, airspeed_mps) or no_filter(model, maneuvers)
    if why or airspeed_mps is None:
        raise IdentificationError(
            f"{GUST} cannot fit {model.name}: {why}; {FILTER} and {MEMORY} are there"
        )
    bare = replace(model, delays=())
    before = fit_with_gust(bare, maneuvers, airspeed_mps, roughly=True).result
    known = before.values if before.residual_kind == "innovation" else None
    found = fit_with_gust(model, maneuvers, airspeed_mps, known)
    if found.result.residual_kind != "innovation":
        calm = SLOW_IN_CALM in found.result.warnings
        why = "finds calm air and slow columns in" if calm else "does not converge on"
        raise IdentificationError(f"{GUST} {why} {model.name}; {FILTER} and {MEMORY} are there")
    return _found(GUST, found.result, found.maneuvers, found.delays)


def _filter_fit(
    model: LinearModel, maneuvers: Sequence[Maneuver], options: Mapping[str, object]
) -> LinearFit:
    """Fit by filter error, delays of output error taken out before it."""
    why = no_filter(model, maneuvers)
    if why:
        raise IdentificationError(f"{FILTER} cannot fit {model.name}: {why}; {MEMORY} is there")
    if not model.delays or has_equations(model):  # whose filter has delays
        found = fit(FILTER, model, maneuvers, compare_noise=False, **options)
        return _converged(_found(FILTER, found, (*maneuvers,)))
    one_rate = len(sample_periods(maneuvers)) == 1
    late = fit(MEMORY if one_rate else WHITE, model, maneuvers, multiple_starts=False)
    half = late.half_width()
    delays = {d.name: (late.value(d.name), float(half[late.index(d.name)])) for d in model.delays}
    values = {name: value for name, (value, _) in delays.items()}
    advanced = tuple(advance_outputs(m, model, values) for m in maneuvers)
    bare, count = replace(model, delays=()), len(model.parameters)
    start = np.delete(late.estimate, [late.index(name) for name in values])
    found = fit(FILTER, bare, advanced, start=start, compare_noise=False, **options)
    covariance = found.covariance.copy()
    covariance[:count, :count] += _of_delays(late, list(values), count)
    found = replace(found, covariance=covariance)
    done = _converged(_found(FILTER, found, advanced, delays))
    ends = [d.name for d in model.delays if abs(values[d.name]) >= d.limit_s * (1.0 - AT_LIMIT)]
    return replace(done, remarks=tuple(f"{name} is at its bound" for name in ends))


def _of_delays(late: FitResult, names: Sequence[str], count: int) -> Array:
    """Return the covariance that delays, known from here on, add to the first parameters."""
    at = [late.index(name) for name in names]
    cross = late.covariance[:count, at]
    part = cross @ np.linalg.pinv(late.covariance[np.ix_(at, at)], hermitian=True) @ cross.T
    return np.asarray(0.5 * (part + part.T))


def _converged(found: LinearFit) -> LinearFit:
    if not near_its_optimum(found.result):
        raise IdentificationError(
            f"{found.method} does not converge on {found.result.model.name}; {MEMORY} is there"
        )
    result = replace(found.result, converged=True, warnings=())
    return replace(found, result=result)

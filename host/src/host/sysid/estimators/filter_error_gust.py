"""Filter error with the gust as a state, delays estimated with it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from host.arrays import Array
from host.errors import IdentificationError
from host.sysid.estimators.filter_error import fit_filter_error, near_its_optimum
from host.sysid.estimators.gust_delays import CALM_MPS, estimate_delays
from host.sysid.estimators.gust_model import ROLL_GUST, gust_deviation_mps, gust_model
from host.sysid.estimators.gust_penetration import PREFIX, ROLL_STATES, with_gust_penetration
from host.sysid.estimators.innovations import innovations_of
from host.sysid.estimators.method_fit import fit
from host.sysid.estimators.noise_model_comparison import DECISIVE, bayes_criterion
from host.sysid.estimators.output_error_fit import NO_CONVERGENCE
from host.sysid.estimators.start_values import start_values_of
from host.sysid.models.fit_result import FitResult
from host.sysid.models.maneuver import Maneuver
from host.sysid.models.rate_forces import by_prior
from host.sysid.models.residual_delays import advance_outputs
from host.sysid.models.state_space_model import LinearModel
from host.sysid.numerics.output_error_problem import OutputProblem

# What else disturbs: thrust and longitudinal gusts; the drift of the attitude filter.
OTHER_PROCESS_STATES = ("airspeed_mps", "phi_rad")
# With every column held for five rows the delay of the IMU scatters by 0.5 ms in calm air, known
# to 0.2 by the filter, and 47 of 54 intervals hold: by output error all of them.
SLOW_IN_CALM = "the air is calm and every column slow; output error stands instead"
# Without a force the filter takes what it thinks are gusts for the delay of the vane: it finds 0
# and 30 ms for 20 of a light aircraft, known to 6, and output error 13, known to 9.
FORCELESS_IN_CALM = (
    "the air is calm and no accelerometer tells the vane's delay; output error stands instead"
)


@dataclass(frozen=True)
class GustFit:
    """Result on the model without gust states, its maneuvers with delays removed, and the delays.

    Parameters of turning air (`gust_penetration`) are in `model` too. `delays` has value and
    95 % half-width of each, s.
    """

    result: FitResult
    model: LinearModel
    maneuvers: tuple[Maneuver, ...]
    delays: dict[str, tuple[float, float]]


def fit_with_gust(
    model: LinearModel,
    maneuvers: Sequence[Maneuver],
    airspeed_mps: float,
    before: Mapping[str, float] | None = None,
    *,
    roughly: bool = False,
) -> GustFit:
    """Fit a template by filter error with the gust as a state, delays estimated with it.

    Parameters
    ----------
    model : LinearModel
        With the delays and accelerometer offsets to be estimated.
    maneuvers : sequence of Maneuver
        Data as measured.
    airspeed_mps : float
        Airspeed at trim, for the gust's time scale, m/s.
    before : mapping of str to float, optional
        Estimates of such a fit without delays, to start from; by default those of output error.
    roughly : bool
        End the search early, to start another from.
    """
    bare = replace(model, delays=())
    start = None
    if before is not None:
        start = np.array([before[n] for n in OutputProblem(bare, maneuvers).names])
    if not model.delays:
        start = start_values_of(model, maneuvers) if start is None else start
        result = fit_gust_state(model, list(maneuvers), airspeed_mps, start, before, roughly)
        return GustFit(result, result.model, tuple(maneuvers), {})
    first = fit("output-error-white", model, maneuvers, multiple_starts=False)
    count = len(model.parameters)
    constants = first.estimate[len(model.parameter_names) :]
    start = np.concatenate([first.estimate[:count], constants]) if start is None else start
    late = estimate_delays(model, maneuvers, airspeed_mps, first, start, gust_process(model))
    start = np.concatenate([late.estimate, start[count:]])
    delays_s = {name: value for name, (value, _) in late.delays.items()}
    shifted = [advance_outputs(m, model, delays_s) for m in maneuvers]
    result = fit_gust_state(bare, shifted, airspeed_mps, start, before, roughly)
    unfit = _unfit_in_calm(model, maneuvers)
    calm = gust_deviation_mps(result, airspeed_mps) < CALM_MPS
    if unfit and (calm or (by_prior(model) and not _moves(result, bare, shifted))):
        first = _ended(first)
        first = replace(first, warnings=(*first.warnings, unfit))
        return GustFit(first, model, tuple(maneuvers), {})
    if result.residual_kind == "innovation":
        covariance = result.covariance.copy()
        covariance[:count, :count] += late.covariance
        result = replace(result, covariance=covariance)
    return GustFit(result, result.model, tuple(shifted), late.delays)


def _unfit_in_calm(model: LinearModel, maneuvers: Sequence[Maneuver]) -> str:
    """Return why a gust that is none would spoil a fit; empty where it would not."""
    if by_prior(model):
        return FORCELESS_IN_CALM
    quick = any(m.seen.all(axis=0).any() for m in maneuvers)
    return "" if quick else SLOW_IN_CALM


def _ended(result: FitResult) -> FitResult:
    """Return output error that ended at a kink as converged: the cost over a delay has some."""
    if result.converged or not near_its_optimum(result):
        return result
    others = tuple(w for w in result.warnings if not w.startswith(NO_CONVERGENCE))
    return replace(result, converged=True, warnings=others)


def _moves(moving: FitResult, bare: LinearModel, shifted: Sequence[Maneuver]) -> bool:
    """Return whether the data show gusts: decisively better than white noise, on the same data."""
    if moving.residual_kind != "innovation":
        return False
    still = fit("output-error-white", bare, shifted, multiple_starts=False)
    return bayes_criterion(still, shifted) - bayes_criterion(moving, shifted) > DECISIVE


def gust_parameters(result: FitResult) -> list[str]:
    """Return the names of what gusts do, which is no derivative."""
    return [name for name in result.names if name.startswith(PREFIX)]


def _with_initial_gusts(
    start: Array, plain: LinearModel, augmented: LinearModel, maneuvers: int
) -> Array:
    """Return a start with the gusts in which each maneuver begins among its constants, none."""
    more = len(augmented.initial_states) - len(plain.initial_states)
    common = len(plain.parameter_names)
    constants = start[common:].reshape(maneuvers, -1)
    return np.concatenate([start[:common], np.pad(constants, ((0, 0), (0, more))).ravel()])


def gust_process(model: LinearModel) -> tuple[str, ...]:
    """Return the states that process noise drives."""
    rolling = (ROLL_GUST,) if set(model.states) >= ROLL_STATES else ()
    return ("gust_rad", *rolling, *(s for s in OTHER_PROCESS_STATES if s in model.states))


def fit_gust_state(
    model: LinearModel,
    maneuvers: Sequence[Maneuver],
    airspeed_mps: float,
    start: Array,
    before: Mapping[str, float] | None = None,
    roughly: bool = False,
) -> FitResult:
    """Return filter error with the gust as a state; output error if that does not converge.

    Gust and noise start where `before` found them: 9 iterations instead of 22.
    `start` has the parameters of the model, without delays, and the constants of every maneuver.
    """
    plain, first = with_gust_penetration(model, airspeed_mps, start)
    augmented = gust_model(plain, airspeed_mps)
    first = _with_initial_gusts(first, plain, augmented, len(maneuvers))
    noise = None
    if before is not None:
        noise = np.array([value for name, value in before.items() if name.startswith("log_")])
        for k, parameter in enumerate(plain.parameters):
            if parameter.name.startswith(PREFIX):
                first[k] = before[parameter.name]
    try:
        result = fit_filter_error(
            augmented,
            maneuvers,
            process=gust_process(model),
            start=first,
            noise=noise,
            roughly=roughly,
            compare_noise=False,
            must_end=True,
        )
    except IdentificationError as error:
        failure = str(error)
    else:
        innovations = innovations_of(result, augmented, maneuvers)
        details = dict(result.details)
        if isinstance(influence := details.get("maneuver_influence"), np.ndarray):
            # Gusts need not be the same in every maneuver: their parameters are not held to it.
            own = [not name.startswith(PREFIX) for name in result.names]
            details["maneuver_influence"] = influence * own
        return replace(
            result,
            details=details,
            method="filter error with gust",
            model=plain,
            converged=True,
            warnings=(),
            covariance=result.covariance
            if innovations is None
            else innovations.coloured_covariance(),
        )
    if before is not None:  # sensors that were late then have another noise now
        return fit_gust_state(model, maneuvers, airspeed_mps, start, roughly=roughly)
    # Output error has wider intervals, but a search that has not converged has none. It starts
    # afresh: where the filter gets lost a search would too (M_alpha -13000 of -90).
    result = fit("output-error-white", model, maneuvers, multiple_starts=False)
    return replace(
        result,
        warnings=(*result.warnings, f"filter error: {failure}; output error stands instead"),
    )

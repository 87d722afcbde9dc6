"""A reduced template fitted with the measured motion that it leaves out.

Its own parameters are then those of the whole aircraft, and what is not known of the terms left out
is in their intervals. On records of 1.5 to 5 s of a trainer N_beta of `dutch-roll` is 16 to 18 %
large without, known to 2, and L_p of `roll` 30 to 38 %, known to 35 (`studies.short_records`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from host.errors import IdentificationError
from host.sysid.aerodynamics.left_out_terms import LEFT_OUT_TERMS, NEEDED
from host.sysid.aerodynamics.thrust_terms import thrust_terms
from host.sysid.errors.departure import Departure
from host.sysid.errors.trim_departure import correct_trim_departure
from host.sysid.estimators.filter_error_gust import fit_with_gust
from host.sysid.estimators.gust_delays import CALM_MPS
from host.sysid.estimators.gust_model import gust_deviation_mps
from host.sysid.estimators.gust_penetration import penetration_of
from host.sysid.estimators.method_fit import fit
from host.sysid.estimators.noise_model_comparison import DECISIVE, bayes_criterion
from host.sysid.linear.linear_model import ChosenModel
from host.sysid.linear.linear_stages import LinearFit
from host.sysid.linear.model_names import DEFAULT_METHOD, GUST
from host.sysid.linear.prepared_columns import PreparedColumns
from host.sysid.linear.users_model import no_filter, no_gust_state
from host.sysid.models.fit_result import FitResult, without_parameters
from host.sysid.models.maneuver import Maneuver
from host.sysid.models.residual_delays import advance_outputs
from host.sysid.models.state_space_model import LinearModel

# Most deviations of a term from what is usual: gusts that turn the air pass for it at 4 to 9, in
# calm air it is at most 1.4.
LIKELY_SD = 2.0


def unaccounted_motion(
    chosen: ChosenModel, found: LinearFit, departure: Departure | None
) -> tuple[str, ...]:
    """Return what moves outside a template, acts in its equations and is in no interval."""
    if chosen.own or departure is not None:
        return found.left_out
    needed = NEEDED.get(found.model.name, ())
    return tuple(c for c in needed if c not in found.model.states)


def fit_with_left_out(
    method: str, columns: PreparedColumns, options: Mapping[str, object]
) -> LinearFit | None:
    """Return the fit of a reduced template; None of another, or where what it needs is missing.

    Where the data show gusts, filter error with the gust stands in place of the default method.

    Parameters
    ----------
    method : str
        Method of output error, or filter error with the gust: None where that does not converge.
    columns : PreparedColumns
    options : mapping
        Options of the method.
    """
    chosen, data, cuts = columns.chosen, columns.data, columns.departing
    model, trim, airframe = chosen.model, chosen.trim, columns.airframe
    reduced = model.name in LEFT_OUT_TERMS
    # Thrust is taken care of by the gust filter of other templates itself (`gust_at_trim`).
    if not reduced and (method == GUST or not thrust_terms(model, cuts, trim, airframe)):
        return None
    rough = fit("output-error-white", replace(model, delays=()), data, multiple_starts=False)
    found = correct_trim_departure(rough, data, cuts, airframe, trim, columns.spin)
    if found is None:
        return None
    if method == GUST:
        return _in_gusts(None, found, columns)
    wide = _fit(method, found.wide_model(model), found.maneuvers, options)
    by_evidence = reduced and chosen.asked == DEFAULT_METHOD
    moving = _in_gusts(wide, found, columns) if by_evidence else None
    return moving or replace(_alone(wide, found, model, data), method=chosen.method)


def _in_gusts(
    wide: FitResult | None, found: Departure, columns: PreparedColumns
) -> LinearFit | None:
    """Return a fit with the gust as a state; None if that fails, or does no better than `wide`."""
    model, trim = columns.chosen.model, columns.chosen.trim
    airspeed_mps = trim.airspeed_mps
    bare = found.wide_model(replace(model, delays=()))
    if not trim.known or no_gust_state(bare, airspeed_mps) or no_filter(bare, columns.data):
        return None
    try:
        first = (
            _first_with_gust(bare, found.maneuvers, airspeed_mps)
            if wide is None
            else _where_gusts_are(wide, bare, model, found.maneuvers, airspeed_mps)
        )
        if first is None:
            return None
        # What gusts do to output error is not to say how large the terms may be.
        found = found.expecting(first)
        moving = fit_with_gust(found.wide_model(model), found.maneuvers, airspeed_mps, first.values)
    except IdentificationError:
        return None
    if moving.result.residual_kind != "innovation":
        return None
    turned = penetration_of(replace(model, delays=()), moving.result.model)
    delays_s = {name: value for name, (value, _) in moving.delays.items()}
    measured = [advance_outputs(m, model, delays_s) for m in columns.data]
    return replace(_alone(moving.result, found, turned, measured), delays=moving.delays)


def _where_gusts_are(
    wide: FitResult,
    bare: LinearModel,
    model: LinearModel,
    data: Sequence[Maneuver],
    airspeed_mps: float,
) -> FitResult | None:
    """Return a first fit with the gust as a state where the data show gusts; None elsewhere.

    It is to explain them decisively better than white noise does, both on the same data, delays of
    output error taken out: a line between samples has less noise than they. In calm air 0 of 108
    records of linear aircraft show gusts, and a virtual flight, which is not linear, 0.06 m/s.
    Noise with a memory is no rival: it explains the gusts of a recorded flight better, and N_dr is
    then known to 106 %, by the filter to 4.
    """
    late = {d.name: wide.value(d.name) for d in model.delays}
    shifted = [advance_outputs(m, model, late) for m in data]
    moving = _first_with_gust(bare, shifted, airspeed_mps)
    if moving is None or gust_deviation_mps(moving, airspeed_mps) < CALM_MPS:
        return None
    start = wide.estimate[[name not in late for name in wide.names]]
    still = fit("output-error-white", bare, shifted, start=start)
    ahead = bayes_criterion(still, shifted) - bayes_criterion(moving, shifted)
    return moving if ahead > DECISIVE else None


def _first_with_gust(
    bare: LinearModel, data: Sequence[Maneuver], airspeed_mps: float
) -> FitResult | None:
    """Return a first fit with the gust as a state, without delays; None if it gets lost."""
    found = fit_with_gust(bare, data, airspeed_mps, roughly=True).result
    return found if found.residual_kind == "innovation" else None


def _alone(
    wide: FitResult, found: Departure, model: LinearModel, data: Sequence[Maneuver]
) -> LinearFit:
    """Return a fit on the template, what is not known of the added terms in its covariance."""
    attenuated = {t.name: found.nuisance[t.name][1] for t in found.varying.left_out if t.attenuated}
    wide = _known_no_better(wide, attenuated)
    result = without_parameters(wide, model, list(found.nuisance))
    unlikely = [
        term.column
        for term in found.varying.left_out
        for mean, sd in [found.nuisance[term.name]]
        if abs(wide.value(term.name) - mean) > LIKELY_SD * sd
    ]
    return LinearFit(
        result,
        model,
        GUST,
        tuple(data),
        result.fitted,
        departure=found.of_fit(wide, len(result.names)),
        left_out=tuple(dict.fromkeys(unlikely)),
    )


def _known_no_better(wide: FitResult, deviations: Mapping[str, float]) -> FitResult:
    """Return a fit in which some parameters are known no better than by these deviations.

    What they move the others by goes with them.
    """
    covariance = wide.covariance.copy()
    for name, sd in deviations.items():
        k = wide.index(name)
        variance = covariance[k, k]
        if 0.0 < variance < sd**2:
            by_it = covariance[:, k] / variance
            covariance += np.outer(by_it, by_it) * (sd**2 - variance)
    return replace(wide, covariance=covariance)


def _fit(
    method: str, wide: LinearModel, data: Sequence[Maneuver], options: Mapping[str, object]
) -> FitResult:
    """Fit with delays; held where they are if the search does not end with them.

    Measured columns that drive a model carry noise, and what is interpolated between noisy samples
    has a kink where a delay passes a sample: a search may stay there.
    """
    found = fit(method, wide, data, **options)
    if found.converged or not wide.delays:
        return found
    late = {d.name: found.value(d.name) for d in wide.delays}
    kept = np.array([n not in late for n in found.names])
    again = fit(
        method,
        replace(wide, delays=()),
        [advance_outputs(m, wide, late) for m in data],
        **{**options, "start": found.estimate[kept]},
    )
    estimate = found.estimate.copy()
    estimate[kept] = again.estimate
    return replace(found, estimate=estimate, converged=again.converged, warnings=again.warnings)

"""A reduced template fitted with the measured motion that it leaves out beside it.

Its own parameters are then those of the whole aircraft, and what is not known of the terms left
out is in their intervals. On records of 1.5 to 5 s of a trainer N_beta of `dutch-roll` was 16 to
18 % large without, known to 2, and L_p of `roll` 30 to 38 %, known to 35.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from host.aircraft.mass_properties import AirframeData
from host.arrays import Array
from host.errors import IdentificationError
from host.sysid.aerodynamics.left_out_terms import LEFT_OUT_TERMS, NEEDED
from host.sysid.aerodynamics.thrust_terms import thrust_terms
from host.sysid.errors.trim_departure import Departure, correct_trim_departure
from host.sysid.estimators.filter_error_gust import fit_with_gust
from host.sysid.estimators.gust_delays import CALM_MPS, advance_outputs
from host.sysid.estimators.gust_model import gust_deviation_mps
from host.sysid.estimators.gust_penetration import penetration_of
from host.sysid.estimators.method_registry import fit
from host.sysid.estimators.noise_model_comparison import DECISIVE, bayes_criterion
from host.sysid.estimators.users_model import GUST, no_filter, no_gust_state
from host.sysid.models.fit_result import FitResult, without_parameters
from host.sysid.models.maneuver import Maneuver
from host.sysid.models.state_space_model import LinearModel
from host.sysid.models.templates import Trim

# Of a term, from what is usual: gusts that turned both passed for it at 4 to 9, in calm air it was
# at most 1.4.
LIKELY_SD = 2.0


@dataclass(frozen=True)
class LeftOutFit:
    """A fit on the reduced template alone, and what was beside it.

    Attributes
    ----------
    result : FitResult
    departure : Departure
    unlikely : tuple of str
        Columns of which the fit says what no aircraft has.
    model : LinearModel
        As fitted; of a filter with the parameters of turning air, without delays.
    maneuvers : tuple of Maneuver
        As fitted: a filter gets its outputs without delays.
    in_gusts : bool
        By filter error with the gust as a state.
    delays : dict
        What was taken out: value and 95 % half-width, s.
    """

    result: FitResult
    departure: Departure
    unlikely: tuple[str, ...]
    model: LinearModel
    maneuvers: tuple[Maneuver, ...]
    in_gusts: bool = False
    delays: dict[str, tuple[float, float]] = field(default_factory=dict)


def unaccounted_motion(
    model: LinearModel, departure: Departure | None, beside: LeftOutFit | None
) -> tuple[str, ...]:
    """Return what moves beside a template, acts in its equations and is in no interval.

    Parameters
    ----------
    model : LinearModel
    departure : Departure or None
        None of a template that was fitted alone.
    beside : LeftOutFit or None
    """
    if beside is not None:
        return beside.unlikely
    needed = () if departure is not None else NEEDED.get(model.name, ())
    return tuple(c for c in needed if c not in model.states)


def fit_beside_left_out(
    method: str,
    model: LinearModel,
    data: Sequence[Maneuver],
    cuts: Sequence[Mapping[str, Array]],
    trim: Trim,
    airframe: AirframeData | None,
    spin: tuple[float, float],
    options: Mapping[str, object],
    *,
    by_evidence: bool = False,
) -> LeftOutFit | None:
    """Return the fit of a reduced template; None of another, or where what it needs is missing.

    Parameters
    ----------
    method : str
        Of output error, or filter error with the gust: None where that does not converge.
    model : LinearModel
    data : sequence of Maneuver
        As measured.
    cuts : sequence of mapping
        All columns of each.
    trim : Trim
    airframe : AirframeData or None
    spin : tuple of float
        Of the rotor.
    options : mapping
        Of the method.
    by_evidence : bool
        Where the data show gusts, filter error with the gust in place of output error.
    """
    reduced = model.name in LEFT_OUT_TERMS
    # Of thrust the gust filter of other templates takes care by itself (`gust_at_trim`).
    if not reduced and (method == GUST or not thrust_terms(model, cuts, trim, airframe)):
        return None
    rough = fit("output-error-white", replace(model, delays=()), data, multiple_starts=False)
    found = correct_trim_departure(rough, data, cuts, airframe, trim, spin)
    if found is None:
        return None
    speed = trim.airspeed_mps if trim.known else None
    if method == GUST:
        return _in_gusts(None, found, model, data, speed)
    wide = _fit(method, found.wide_model(model), found.maneuvers, options)
    moving = _in_gusts(wide, found, model, data, speed) if by_evidence and reduced else None
    return _alone(wide, found, model, data) if moving is None else moving


def _in_gusts(
    wide: FitResult | None,
    found: Departure,
    model: LinearModel,
    data: Sequence[Maneuver],
    airspeed_mps: float | None,
) -> LeftOutFit | None:
    """Return a fit with the gust as a state; None if that fails, or does no better than `wide`."""
    bare = found.wide_model(replace(model, delays=()))
    if airspeed_mps is None or no_gust_state(bare, airspeed_mps) or no_filter(bare, data):
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
    measured = tuple(advance_outputs(m, model, delays_s) for m in data)
    done = _alone(moving.result, found, turned, measured)
    return replace(done, in_gusts=True, delays=moving.delays)


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
    records of linear aircraft showed gusts, and of a virtual flight, which is not linear, 0.06 m/s.
    Noise with a memory is no rival: it explained the gusts of a recorded flight better, where N_dr
    was then known to 106 %, by the filter to 4.
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
) -> LeftOutFit:
    """Return a fit on the template, what is not known of the terms beside it in its covariance."""
    attenuated = {t.name: found.beside[t.name][1] for t in found.varying.left_out if t.attenuated}
    wide = _known_no_better(wide, attenuated)
    result = without_parameters(wide, model, list(found.beside))
    unlikely = [
        term.column
        for term in found.varying.left_out
        for mean, sd in [found.beside[term.name]]
        if abs(wide.value(term.name) - mean) > LIKELY_SD * sd
    ]
    departure = found.of_fit(wide, len(result.names))
    named = tuple(dict.fromkeys(unlikely))
    return LeftOutFit(result, departure, named, model, tuple(data))


def _known_no_better(wide: FitResult, deviations: Mapping[str, float]) -> FitResult:
    """Return a fit in which some parameters are known no better than by these deviations.

    What they move the others by goes with them. With 0.007 rad/s of noise on p the data told N_p to
    a tenth of its prior, a third of what it was, and N_beta came out 8 to 15 % large, known to 10.
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
    """Fit with delays; held where they are if the search does not end beside them.

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

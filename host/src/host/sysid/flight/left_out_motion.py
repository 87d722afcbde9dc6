"""A reduced template fitted with the measured motion that it leaves out beside it.

Its own parameters are then those of the whole aircraft, and what is not known of the terms left
out is in their intervals. On records of 1.5 to 5 s of a trainer N_beta of `dutch-roll` was 16 to
18 % large without, known to 2, and L_p of `roll` 30 to 38 %, known to 35.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from host.aircraft.mass_properties import AirframeData
from host.arrays import Array
from host.sysid.aerodynamics.left_out_terms import LEFT_OUT_TERMS, NEEDED
from host.sysid.aerodynamics.thrust_terms import thrust_terms
from host.sysid.estimators.gust_delays import advance_outputs
from host.sysid.estimators.method_registry import fit
from host.sysid.flight.trim_departure import Departure, correct_trim_departure
from host.sysid.models.fit_result import FitResult, without_parameters
from host.sysid.models.maneuver import Maneuver
from host.sysid.models.state_space_model import LinearModel
from host.sysid.models.templates import Trim

# Of a term, from what is usual: gusts that turned both passed for it at 4 to 9, in calm air it was
# at most 1.4.
LIKELY_SD = 2.0


@dataclass(frozen=True)
class LeftOutFit:
    """A fit on the reduced template alone, and what was beside it; `unlikely` names columns of
    which the fit says what no aircraft has."""

    result: FitResult
    departure: Departure
    unlikely: tuple[str, ...]


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
) -> LeftOutFit | None:
    """Return the fit of a reduced template; None of another, or where what it needs is missing.

    Parameters
    ----------
    method : str
        Of output error.
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
    """
    if model.name not in LEFT_OUT_TERMS and not thrust_terms(model, cuts, trim, airframe):
        return None
    rough = fit("output-error-white", replace(model, delays=()), data, multiple_starts=False)
    found = correct_trim_departure(rough, data, cuts, airframe, trim, spin)
    if found is None:
        return None
    wide = _fit(method, found.wide_model(model), found.maneuvers, options)
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
    return LeftOutFit(result, departure, tuple(dict.fromkeys(unlikely)))


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

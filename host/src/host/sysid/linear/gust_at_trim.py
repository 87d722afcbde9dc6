"""The fit with the gust as a state, to maneuvers as if airspeed and attitude had not varied."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from host.aircraft.mass_properties import AirframeData
from host.arrays import Array
from host.sysid.aerodynamics.thrust_terms import beside_thrust, thrust_terms
from host.sysid.errors.trim_departure import correct_trim_departure, without_further_inputs
from host.sysid.estimators.filter_error_gust import GustFit, fit_with_gust
from host.sysid.estimators.gust_delays import advance_outputs
from host.sysid.models.fit_result import without_parameters
from host.sysid.models.maneuver import Maneuver
from host.sysid.models.state_space_model import LinearModel, without_inputs
from host.sysid.models.templates import Trim
from host.sysid.models.thrust_column import THRUST


def fit_gust_at_trim(
    model: LinearModel,
    data: Sequence[Maneuver],
    cuts: Sequence[Mapping[str, Array]],
    trim: Trim,
    airframe: AirframeData | None,
    spin: tuple[float, float],
) -> tuple[GustFit, list[Maneuver], tuple[Array, ...]]:
    """Fit with the gust as a state, departures from the trim removed at a first such fit.

    One step behind the fit does not do: in calm air the IMU seemed 0.3 ms late by what the
    drag polar does to ax, and M_q was 1.8 % off. Nor does output error in front of it: in
    gusts of 1 m/s its M_alpha was up to six times too large.

    Parameters
    ----------
    model : LinearModel
        With the delays to be estimated.
    data : sequence of Maneuver
        As measured.
    cuts : sequence of mapping
        All columns of each.
    trim : Trim
    airframe : AirframeData or None
    spin : tuple of float
        Of the rotor.

    Returns
    -------
    GustFit, list of Maneuver, tuple of Array
        The fit, its maneuvers without delays as measured, and what it says of their outputs.
    """
    bare = replace(model, delays=())
    thrust = thrust_terms(bare, cuts, trim, airframe)
    wide, driven = beside_thrust(bare, data, cuts, thrust, trim) if thrust else (bare, list(data))
    rough = fit_with_gust(wide, driven, trim.airspeed_mps, roughly=True).result
    even = None  # as if thrust had not changed
    if thrust:
        even = without_further_inputs(rough.model, driven, data, rough.estimate)
        alone = without_inputs(rough.model, (THRUST,))
        rough = without_parameters(rough, alone, [t.name for t in thrust])
    at_trim, before = even or list(data), None
    if rough.residual_kind == "innovation":
        departure = correct_trim_departure(rough, data, cuts, airframe, trim, spin, even)
        estimate = rough.estimate
        if departure is not None:
            estimate = estimate + departure.step
            at_trim = departure.removed_from(data, estimate)
        before = dict(zip(rough.names, estimate.tolist(), strict=True))
    staged = fit_with_gust(model, at_trim, trim.airspeed_mps, before)
    delays_s = {name: value for name, (value, _) in staged.delays.items()}
    measured = [advance_outputs(m, model, delays_s) for m in data]
    fitted = tuple(
        y + m.outputs - still.outputs
        for y, m, still in zip(staged.result.fitted, measured, staged.maneuvers, strict=True)
    )
    return staged, measured, fitted

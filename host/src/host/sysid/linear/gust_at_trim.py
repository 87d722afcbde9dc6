"""The fit with the gust as a state, to maneuvers as if airspeed and attitude had not varied."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from host.sysid.aerodynamics.thrust_terms import thrust_terms, with_thrust_input
from host.sysid.errors.departure import without_further_inputs
from host.sysid.errors.trim_departure import correct_trim_departure
from host.sysid.estimators.filter_error_gust import fit_with_gust
from host.sysid.linear.linear_stages import LinearFit
from host.sysid.linear.model_names import GUST
from host.sysid.linear.prepared_columns import PreparedColumns
from host.sysid.models.fit_result import without_parameters
from host.sysid.models.maneuver import Maneuver
from host.sysid.models.reduced_model import without_inputs
from host.sysid.models.residual_delays import advance_outputs
from host.sysid.models.thrust_column import THRUST


def fit_gust_at_trim(columns: PreparedColumns) -> LinearFit:
    """Fit with the gust as a state, departures from the trim removed at a first such fit.

    One step behind the fit does not do: in calm air the IMU seems 0.3 ms late by what the drag
    polar does to ax, and M_q is 1.8 % off. Nor does output error in front of it: in gusts of 1 m/s
    its M_alpha is up to six times too large.
    """
    model, data, trim = columns.chosen.model, columns.data, columns.chosen.trim
    before, at_trim = _first_fit(columns)
    staged = fit_with_gust(model, at_trim, trim.airspeed_mps, before)
    delays_s = {name: value for name, (value, _) in staged.delays.items()}
    measured = tuple(advance_outputs(m, model, delays_s) for m in data)
    fitted = tuple(
        y + m.outputs - still.outputs
        for y, m, still in zip(staged.result.fitted, measured, staged.maneuvers, strict=True)
    )
    return LinearFit(
        staged.result, staged.model, GUST, measured, fitted, staged.delays, staged.maneuvers
    )


def _first_fit(columns: PreparedColumns) -> tuple[dict[str, float] | None, Sequence[Maneuver]]:
    """Return a first estimate with the gust, none if it gets lost, and the maneuvers at the trim.

    Thrust that changed is a further input of the model there.
    """
    chosen, data, cuts = columns.chosen, columns.data, columns.cuts
    trim, airframe = chosen.trim, columns.airframe
    bare = replace(chosen.model, delays=())
    thrust = thrust_terms(bare, cuts, trim, airframe)
    wide, driven = with_thrust_input(bare, data, cuts, thrust, trim) if thrust else (bare, data)
    rough = fit_with_gust(wide, driven, trim.airspeed_mps, roughly=True).result
    even = None  # as if thrust had not changed
    if thrust:
        even = without_further_inputs(rough.model, driven, data, rough.estimate)
        alone = without_inputs(rough.model, (THRUST,))
        rough = without_parameters(rough, alone, [t.name for t in thrust])
    if rough.residual_kind != "innovation":
        return None, even or data
    departure = correct_trim_departure(rough, data, cuts, airframe, trim, columns.spin, even)
    if departure is None:
        return rough.values, even or data
    estimate = rough.estimate + departure.step
    moved = dict(zip(rough.names, estimate.tolist(), strict=True))
    return moved, departure.removed_from(data, estimate)

"""A model fitted to prepared columns: what depends on the estimate is taken out of the outputs.

Delays of the sensors and departures from the trim are known only with the model. They go out where
it is fitted, by one of four ways: with what a template leaves out (`left_out_motion`),
with the gust as a state (`gust_at_trim`), a user's own model, or a template by one method.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from host.arrays import Array
from host.sysid.errors.departure import Departure
from host.sysid.errors.trim_departure import correct_trim_departure
from host.sysid.estimators.method_fit import fit, refuse_unless_finite
from host.sysid.flight.column_change import ColumnChange, Record
from host.sysid.linear.first_departures import remove_departures
from host.sysid.linear.gust_at_trim import fit_gust_at_trim
from host.sysid.linear.left_out_motion import fit_with_left_out
from host.sysid.linear.linear_stages import LinearFit
from host.sysid.linear.model_names import DEFAULT_METHOD, GUST
from host.sysid.linear.prepared_columns import PreparedColumns
from host.sysid.linear.users_model import fit_by_evidence, fit_users_model
from host.sysid.models.maneuver import Maneuver

OUTPUT_ERROR = "output-error"  # begins the names of its methods
FREE = ("output", "innovation")  # residuals of methods that simulate


def fit_columns(columns: PreparedColumns, options: Mapping[str, object]) -> LinearFit:
    """Fit the chosen model to prepared columns.

    Parameters
    ----------
    columns : PreparedColumns
    options : mapping
        Options of the method.

    Raises
    ------
    IdentificationError
        If the fit does not come about.
    """
    found = (_users if columns.chosen.own else _template)(columns, options)
    # The start of a gust filter that was lost may have run away: M_alpha -57 000 of one point.
    refuse_unless_finite(found.result, found.result.method)
    if columns.servo is None:
        return found
    return replace(found, result=columns.servo.added_to(found.result))


def departure_of(found: LinearFit, columns: PreparedColumns) -> Departure | None:
    """Return by how much airspeed and attitude that varied move the estimate."""
    chosen = columns.chosen
    if found.departure is not None:
        return found.departure
    if not chosen.trim.known or chosen.own or found.result.residual_kind not in FREE:
        return None
    return correct_trim_departure(
        found.result, found.maneuvers, columns.departing, columns.airframe, chosen.trim,
        columns.spin, found.at_trim,
    )  # fmt: skip


def changes_of(found: LinearFit, columns: PreparedColumns) -> Record:
    """Return what the fit took out of the outputs."""
    outputs = found.model.outputs
    measured, fitted = columns.data, found.at_trim or found.maneuvers
    late = _changed(outputs, measured, found.maneuvers)
    departing = _changed(outputs, found.maneuvers, fitted)
    done = (
        ColumnChange(late, "advanced by delays", "estimated before the fit"),
        ColumnChange(departing, "departures from the trim removed", "at a first fit of the model"),
    )
    return tuple(change for change in done if change.columns)


def _changed(
    names: Sequence[str], before: Sequence[Maneuver], after: Sequence[Maneuver]
) -> tuple[str, ...]:
    pairs = list(zip(before, after, strict=True))
    return tuple(
        name
        for k, name in enumerate(names)
        if any((was.outputs[:, k] != now.outputs[:, k]).any() for was, now in pairs)
    )


def _users(columns: PreparedColumns, options: Mapping[str, object]) -> LinearFit:
    """Fit a user's model by the method asked for, or by the one for the noise that data show."""
    chosen = columns.chosen
    speed = chosen.trim.airspeed_mps if chosen.trim.known else None
    if chosen.method == DEFAULT_METHOD:
        return fit_by_evidence(chosen.model, columns.data, speed)
    return fit_users_model(chosen.method, chosen.model, columns.data, speed, options)


def _template(columns: PreparedColumns, options: Mapping[str, object]) -> LinearFit:
    chosen = columns.chosen
    lost = chosen.method == GUST and not chosen.gust_is_state
    single = f"{OUTPUT_ERROR}-white" if lost else chosen.method
    if single.startswith(OUTPUT_ERROR):
        options = {"multiple_starts": False, "model_error": False, **options}
    wide = None
    if chosen.gust_is_state or single.startswith(OUTPUT_ERROR):
        wide = fit_with_left_out(single, columns, options)
    if wide is not None:
        return wide
    if chosen.gust_is_state:
        return fit_gust_at_trim(columns)
    return _by_one_method(single, columns, options)


def _by_one_method(
    method: str, columns: PreparedColumns, options: Mapping[str, object]
) -> LinearFit:
    """Fit a template by one method, first departures removed."""
    chosen, gone = columns.chosen, columns.first_departures
    at_trim = remove_departures(columns.data, gone)
    found = fit(method, chosen.model, at_trim, **options)
    said: tuple[Array, ...] = found.fitted
    both = list(zip(said, gone, strict=True))
    if all(y.shape == part.shape for y, part in both):  # of frequencies they are others
        said = tuple(y + part for y, part in both)
    return LinearFit(
        found, chosen.model, chosen.method, tuple(columns.data), said, at_trim=tuple(at_trim)
    )

"""Surfaces that a flight has only as commands, brought behind the servos that its data tell."""

from __future__ import annotations

import contextlib
from collections.abc import Collection, Sequence
from dataclasses import replace

from host.arrays import Array
from host.errors import IdentificationError
from host.sysid.estimators.filter_error_gust import fit_gust_state
from host.sysid.estimators.method_fit import fit
from host.sysid.estimators.servo_delay_profile import CoarseDelays, Fit
from host.sysid.estimators.servo_parameters import (
    ServoEstimate,
    considered_servo,
    estimate_servo,
)
from host.sysid.estimators.start_values import start_values_of
from host.sysid.flight.flown_maneuver import FlownManeuver
from host.sysid.flight.reconstructed_flight import ReconstructedFlight
from host.sysid.linear.first_departures import remove_departures
from host.sysid.linear.linear_model import ChosenModel
from host.sysid.models.fit_result import FitResult
from host.sysid.models.maneuver import Maneuver
from host.sysid.models.state_space_model import LinearModel
from host.sysid.reconstruction.servo_response import behind_servos


def servo_of(chosen: ChosenModel, departures: Sequence[Array]) -> tuple[ServoEstimate | None, str]:
    """Return the servos of the commanded inputs of a model, and a remark; None without any.

    Parameters
    ----------
    chosen : ChosenModel
    departures : sequence of Array
        What departures from the trim do to the outputs of each maneuver: without them.
    """
    flights = [m.flight for m in chosen.used if m.flight.servo is not None]
    commands = {u for f in flights for u in f.commands}
    commanded = [u for u in chosen.model.inputs if u in commands]
    if not commanded or flights[0].servo is None:
        return None, ""
    prior, plain = flights[0].servo, _without_places(chosen.model)

    def behind(values: tuple[float, float, float]) -> list[Maneuver]:
        moved = brought_behind(chosen.used, values, commanded)
        return remove_departures([m.cut(plain) for m in moved], departures)

    coarse = CoarseDelays(plain, behind, prior, _white)
    remark = ""
    if chosen.gust_is_state:
        try:
            by = _with_gust(chosen.trim.airspeed_mps)
            return estimate_servo(plain, behind, commanded, prior, by, coarse), ""
        except IdentificationError as error:
            remark = f"the servos are those of output error: {error}"
    try:
        return estimate_servo(plain, behind, commanded, prior, _white, coarse), remark
    except IdentificationError as error:
        considered = considered_servo(plain, behind, commanded, prior, _white)
        return considered, f"the servos were not estimated ({error}): carried as they usually are"


def _without_places(model: LinearModel) -> LinearModel:
    """Return a model without delays and places: what all sensors share is the servos' delay."""
    places = {x.parameter for x in model.accelerometer_offsets}
    return replace(
        model,
        delays=(),
        accelerometer_offsets=(),
        parameters=tuple(p for p in model.parameters if p.name not in places),
    )


def _white(model: LinearModel, data: Sequence[Maneuver], near: FitResult | None) -> FitResult:
    """Return white output error from its own start and from a neighbour's end: the better."""
    if near is None:
        return fit("output-error-white", model, data, multiple_starts=False)
    found = []
    for start in (near.estimate, None):
        with contextlib.suppress(IdentificationError):
            found.append(fit("output-error-white", model, data, start=start, restarts=False))
    if not found:
        raise IdentificationError("no search from these starts stays finite")
    return min(found, key=lambda one: float(one.details["cost"]))


def _with_gust(airspeed_mps: float) -> Fit:
    """Return filter error with the gust; where it loses itself, nothing of it is used."""

    def by(model: LinearModel, data: Sequence[Maneuver], _: FitResult | None) -> FitResult:
        # Afresh each time: from its neighbour's end the filter ran to a delay of 0.16 s on thor75.
        found = fit_gust_state(model, list(data), airspeed_mps, start_values_of(model, data))
        if found.residual_kind != "innovation":
            raise IdentificationError("the filter did not converge with the servos")
        return found

    return by


def brought_behind(
    used: Sequence[FlownManeuver],
    servo: tuple[float, float, float],
    surfaces: Collection[str] | None = None,
) -> list[FlownManeuver]:
    """Return maneuvers with commanded surfaces where servos of these numbers had brought them.

    With `surfaces` only these: a search moves those of its model alone.
    """
    own: dict[int, ReconstructedFlight] = {}
    for m in used:
        f = m.flight
        if id(f) not in own:
            own_commands = {
                name: values
                for name, values in f.commands.items()
                if surfaces is None or name in surfaces
            }
            at = behind_servos(own_commands, f.corrected["t_s"], servo) if own_commands else {}
            own[id(f)] = replace(f, corrected={**f.corrected, **at}) if at else f
    return [replace(m, flight=own[id(m.flight)]) for m in used]

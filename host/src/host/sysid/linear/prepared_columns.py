"""Columns of the maneuvers of one linear model, prepared once, with a record of what was done.

What does not depend on the estimate is done here: commands are brought behind their servos, lateral
columns are averaged for a filter, surfaces move between samples. Departures from the trim and
delays depend on it: they are taken out where the model is fitted (`linear_fit`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

from host.aircraft.mass_properties import AirframeData
from host.aircraft.powerplant import Powerplant
from host.arrays import Array
from host.sysid.errors.surface_motion import (
    HELD,
    HELD_SURFACES,
    SERVOS,
    between_samples,
    with_moving_surfaces,
)
from host.sysid.errors.trim_departure import NO_SPIN, spin_of
from host.sysid.estimators.servo_parameters import ServoEstimate
from host.sysid.flight.column_change import ColumnChange, Record, changed_columns
from host.sysid.flight.filter_step import STEP_S, with_filter_step
from host.sysid.flight.flown_maneuver import FlownManeuver
from host.sysid.linear.commanded_surfaces import brought_behind, servo_of
from host.sysid.linear.first_departures import first_departures
from host.sysid.linear.linear_model import ChosenModel
from host.sysid.linear.model_names import GUST
from host.sysid.models.maneuver import Maneuver


@dataclass(frozen=True)
class PreparedColumns:
    """Maneuvers with their columns as a model is fitted to them.

    Attributes
    ----------
    chosen : ChosenModel
        Its inputs are held between samples, or on lines, as the surfaces were.
    used, held_out : tuple of FlownManeuver
        In the fit, and kept for validation.
    airframe : AirframeData or None
    spin : tuple of float
        Angular momentum of the rotor (`spin_of`).
    first_departures : list of Array
        What departures from the trim do to the outputs of each maneuver, by a first fit: zero where
        a finer one finds them itself.
    record : tuple of ColumnChange
        What was done to the columns, that of the flights before it.
    servo : ServoEstimate or None
        Servo of the inputs that are commands.
    """

    chosen: ChosenModel
    used: tuple[FlownManeuver, ...]
    held_out: tuple[FlownManeuver, ...]
    airframe: AirframeData | None
    spin: tuple[float, float]
    first_departures: list[Array]
    record: Record = ()
    servo: ServoEstimate | None = None

    @cached_property
    def data(self) -> list[Maneuver]:
        """Inputs and outputs of the model over each maneuver."""
        return [m.cut(self.chosen.model) for m in self.used]

    @cached_property
    def cuts(self) -> list[dict[str, Array]]:
        """All columns of each maneuver."""
        return [m.inside() for m in self.used]

    @cached_property
    def departing(self) -> list[dict[str, Array]]:
        """The same with the angles that no vane measured."""
        return [m.departing() for m in self.used]


def prepare_columns(
    chosen: ChosenModel, airframe: AirframeData | None, powerplant: Powerplant | None
) -> PreparedColumns:
    """Return the columns of a model's maneuvers as it is fitted to them.

    Parameters
    ----------
    chosen : ChosenModel
    airframe : AirframeData or None
        Gives what body rates do to each other.
    powerplant : Powerplant or None
        Gives the rotor's spin.
    """
    departures = first_departures(chosen, airframe, powerplant)
    flights = {id(m.flight): m.flight for m in chosen.used}.values()
    done = dict.fromkeys(change for flight in flights for change in flight.record)
    columns = PreparedColumns(
        chosen, chosen.used, chosen.held_out, airframe, NO_SPIN, departures, tuple(done)
    )
    columns = _behind_servos(columns)
    if chosen.own:  # a user's equations get samples as they are
        return columns
    columns = _moving_between_samples(_in_means(columns))
    return replace(columns, spin=spin_of(powerplant, columns.departing))


def _behind_servos(columns: PreparedColumns) -> PreparedColumns:
    """Replace commands by surfaces behind the servos that were estimated."""
    servo, remark = servo_of(columns.chosen, columns.first_departures)
    if servo is None:
        return columns
    used, held = (brought_behind(m, servo.setting) for m in (columns.used, columns.held_out))
    why = "no pot measured the surfaces; the data tell delay and bandwidth"
    done = _change(columns.used, used, "commands brought behind their servos", why, remark)
    return replace(_with_columns(columns, used, held, done), servo=servo)


def _in_means(columns: PreparedColumns) -> PreparedColumns:
    """Average lateral columns of our log to the step of a filter with the gust."""
    if columns.chosen.method != GUST:
        return columns
    used = with_filter_step(columns.used, columns.chosen.model)
    what = f"means over {1000.0 * STEP_S:g} ms of the maneuvers fitted"
    why = "a filter takes what lies between our samples for the aircraft"
    return _with_columns(columns, used, columns.held_out, _change(columns.used, used, what, why))


def _moving_between_samples(columns: PreparedColumns) -> PreparedColumns:
    """Choose by the data whether surfaces move between samples as servos do or are held."""
    chosen, behind = columns.chosen, columns.servo is not None
    motion = between_samples(columns.used, chosen.model, chosen.trim, behind=behind)
    if motion == HELD:
        surfaces = tuple(chosen.model.controls())
        done = ColumnChange(surfaces, "held between samples", "the outputs show it", HELD_SURFACES)
        held = replace(chosen, model=replace(chosen.model, hold="zoh"))
        return replace(columns, chosen=held, record=(*columns.record, done))
    if motion != SERVOS:
        return columns
    used, held_out = (with_moving_surfaces(m) for m in (columns.used, columns.held_out))
    what, why = "samples between which lines have the mean", "a servo bends between samples"
    return _with_columns(columns, used, held_out, _change(columns.used, used, what, why))


def _with_columns(
    columns: PreparedColumns,
    used: Sequence[FlownManeuver],
    held_out: Sequence[FlownManeuver],
    done: ColumnChange,
) -> PreparedColumns:
    """Return other columns, and what was done to them in the record."""
    record = (*columns.record, done) if done.columns or done.remark else columns.record
    return replace(columns, used=tuple(used), held_out=tuple(held_out), record=record)


def _change(
    before: Sequence[FlownManeuver],
    after: Sequence[FlownManeuver],
    what: str,
    why: str,
    remark: str = "",
) -> ColumnChange:
    """Return the change from some maneuvers to the same with other columns."""
    names = (
        name
        for was, now in zip(before, after, strict=True)
        if was is not now
        for name in changed_columns(was.inside(), now.inside())
    )
    return ColumnChange(tuple(dict.fromkeys(names)), what, why, remark)

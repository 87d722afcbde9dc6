"""What each stage of a linear model hands on: estimate, intervals, validation."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from host.arrays import Array
from host.instrument.error_sources import ErrorSource
from host.sysid.aerodynamics.coefficient_table import CoefficientParts, ShiftedEstimate
from host.sysid.aerodynamics.thrust_terms import THRUST_AS_INPUT
from host.sysid.errors.departure import Departure
from host.sysid.flight.column_change import Record
from host.sysid.linear.prepared_columns import PreparedColumns
from host.sysid.models.diagnostics import SignalFit
from host.sysid.models.fit_result import FitResult
from host.sysid.models.maneuver import Maneuver
from host.sysid.models.state_space_model import LinearModel
from host.sysid.models.templates import Trim
from host.sysid.models.uncertainty import Uncertainty
from host.sysid.numerics.input_coherence import InputCoherence
from host.sysid.validation.prediction_limits import Prediction


@dataclass(frozen=True)
class LinearFit:
    """A fit of a chosen model, and what was taken out of its columns for it.

    Attributes
    ----------
    result : FitResult
        As the method returned it; its model has the parameters of turning air.
    model : LinearModel
        As fitted.
    method : str
    maneuvers : tuple of Maneuver
        As measured, delays taken out.
    fitted : tuple of Array
        What the fit says of their outputs.
    delays : dict
        What was taken out: value and 95 % half-width, s.
    at_trim : tuple of Maneuver or None
        What the result was fitted to, where departures had been removed from it.
    departure : Departure or None
        What was fitted in addition to a template.
    left_out : tuple of str
        Columns of which that fit says what no aircraft has.
    remarks : tuple of str
        Why this method.
    """

    result: FitResult
    model: LinearModel
    method: str
    maneuvers: tuple[Maneuver, ...]
    fitted: tuple[Array, ...]
    delays: dict[str, tuple[float, float]] = field(default_factory=dict)
    at_trim: tuple[Maneuver, ...] | None = None
    departure: Departure | None = None
    left_out: tuple[str, ...] = ()
    remarks: tuple[str, ...] = ()


@dataclass(frozen=True)
class LinearEstimate:
    """Result of estimation: a fit on prepared columns, and what departed from the trim.

    Attributes
    ----------
    columns : PreparedColumns
    found : LinearFit
    departure : Departure or None
        By how much airspeed and attitude that varied move the estimate.
    record : tuple of ColumnChange
        What was done to which columns, from the flight to the fit.
    left_out : tuple of str
        Columns that act and are not in a reduced template, and that the fit does not account for.
    """

    columns: PreparedColumns
    found: LinearFit
    departure: Departure | None
    record: Record
    left_out: tuple[str, ...]

    @property
    def fit(self) -> FitResult:
        """As the method returned it."""
        return self.found.result

    @property
    def trim(self) -> Trim:
        """Mean motion over the maneuvers of the fit."""
        return self.columns.chosen.trim

    @property
    def estimate(self) -> Array:
        """All parameters, (P,)."""
        return self.fit.estimate + (0.0 if self.departure is None else self.departure.step)

    @property
    def noise(self) -> Uncertainty:
        """What the noise of the fit leaves open, and what each maneuver says at the trim."""
        moved = {} if self.departure is None else self.departure.influence(self.fit.details)
        return replace(self.fit.uncertainty, details={**self.fit.details, **moved})

    @property
    def warnings(self) -> tuple[str, ...]:
        """What is said of preparation and fit."""
        thrust = self.departure is not None and self.departure.varying.thrust
        prepared = (change.remark for change in self.record if change.remark)
        return (
            *self.columns.chosen.remarks,
            *prepared,
            *self.found.remarks,
            *self.fit.warnings,
            *((THRUST_AS_INPUT,) if thrust else ()),
        )

    def at_trim(self, estimate: Array) -> list[Maneuver]:
        """Return the maneuvers as if airspeed and attitude had not varied."""
        if self.departure is None:
            return list(self.found.maneuvers)
        return self.departure.removed_from(self.found.maneuvers, estimate)


@dataclass(frozen=True)
class LinearIntervals:
    """Result of the intervals: noise, systematic errors and their sum.

    Attributes
    ----------
    statistical : FitResult
        The estimate at its trim; noise, scatter of maneuvers and what inputs drive outside the
        model are in its covariance.
    coherence : InputCoherence or None
        What the inputs drive outside the model.
    shifts : tuple of ShiftedEstimate
        The estimate moved by each systematic error.
    errors : tuple of ErrorSource
        Errors that widen intervals; of several flights the largest deviation of each.
    total : Uncertainty
        Uncertainty of the estimate with all of these.
    parts : CoefficientParts or None
        Parts of the coefficients, mass and inertia in theirs.
    """

    statistical: FitResult
    coherence: InputCoherence | None
    shifts: tuple[ShiftedEstimate, ...]
    errors: tuple[ErrorSource, ...]
    total: Uncertainty
    parts: CoefficientParts | None


@dataclass(frozen=True)
class LinearValidation:
    """Free simulation of the maneuvers fitted, and of those held out.

    Departures from the trim are as measured: airspeed and attitude in products with what moves.
    `predictions` compares the error of each output held out with what noise and covariance allow;
    `held_out_runs` are the maneuvers held out, with their outputs.
    """

    simulated: tuple[Array, ...]
    fits: tuple[SignalFit, ...]
    held_out: tuple[SignalFit, ...]
    predictions: dict[str, Prediction]
    held_out_runs: tuple[tuple[Maneuver, Array], ...] = ()

"""What each stage of a linear model hands on: estimate, intervals, validation."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from host.aircraft.mass_properties import Condition
from host.arrays import Array
from host.sysid.aerodynamics.coefficient_table import CoefficientParts, ShiftedEstimate
from host.sysid.aerodynamics.thrust_terms import THRUST_BESIDE
from host.sysid.errors.trim_departure import Departure
from host.sysid.estimators.servo_parameters import ServoEstimate
from host.sysid.flight.reconstructed_flight import FlownManeuver
from host.sysid.models.diagnostics import SignalFit
from host.sysid.models.fit_result import FitResult
from host.sysid.models.maneuver import Maneuver
from host.sysid.models.state_space_model import LinearModel
from host.sysid.models.templates import Trim
from host.sysid.models.uncertainty import Uncertainty
from host.sysid.numerics.input_coherence import InputCoherence
from host.sysid.validation.prediction_limits import Prediction


@dataclass(frozen=True)
class LinearEstimate:
    """What estimation made: a model, its fit, and the data both rest on.

    Attributes
    ----------
    template, method : str
    model : LinearModel
        As fitted.
    trim, condition
        Means over the maneuvers of the fit.
    used, held_out : tuple of FlownManeuver
        In the fit, and kept for validation.
    maneuvers : tuple of Maneuver
        Those used, as fitted.
    cuts : tuple of mapping
        All corrected columns of each.
    fit : FitResult
        As the method returned it.
    departure : Departure or None
        By how much airspeed and attitude that varied move the estimate.
    delays : dict
        Estimated before the fit: value and 95 % half-width, s.
    fitted : tuple of Array
        What the fit says of the outputs as measured.
    servo : ServoEstimate or None
        Of the inputs that are commands.
    left_out : tuple of str
        Columns that act beside a reduced template, and that the fit does not account for.
    remarks : tuple of str
        What is said of how model and columns were made.
    """

    template: str
    method: str
    model: LinearModel
    trim: Trim
    condition: Condition
    used: tuple[FlownManeuver, ...]
    held_out: tuple[FlownManeuver, ...]
    maneuvers: tuple[Maneuver, ...]
    cuts: tuple[Mapping[str, Array], ...]
    fit: FitResult
    departure: Departure | None
    delays: dict[str, tuple[float, float]]
    fitted: tuple[Array, ...]
    servo: ServoEstimate | None = None
    left_out: tuple[str, ...] = ()
    remarks: tuple[str, ...] = ()

    @property
    def estimate(self) -> Array:
        """All parameters, (P,)."""
        return self.fit.estimate + (0.0 if self.departure is None else self.departure.step)

    @property
    def noise(self) -> Uncertainty:
        """What the noise of the fit leaves open, what each maneuver says at the trim beside it."""
        moved = {} if self.departure is None else self.departure.influence(self.fit.details)
        return replace(self.fit.uncertainty, details={**self.fit.details, **moved})

    @property
    def warnings(self) -> tuple[str, ...]:
        """What is said of preparation and fit."""
        thrust = self.departure is not None and self.departure.varying.thrust
        return (*self.remarks, *self.fit.warnings, *((THRUST_BESIDE,) if thrust else ()))

    def at_trim(self, estimate: Array) -> list[Maneuver]:
        """Return the maneuvers as if airspeed and attitude had not varied."""
        if self.departure is None:
            return list(self.maneuvers)
        return self.departure.removed_from(self.maneuvers, estimate)


@dataclass(frozen=True)
class LinearIntervals:
    """What the intervals count.

    Attributes
    ----------
    statistical : FitResult
        The estimate at its trim; noise, scatter of maneuvers and what inputs drive beside the model
        are in its covariance.
    coherence : InputCoherence or None
        What the inputs drive beside the model.
    shifts : tuple of ShiftedEstimate
        The estimate moved by each systematic error.
    total : Uncertainty
        Of the estimate with all of these.
    parts : CoefficientParts or None
        Of the coefficients, mass and inertia in theirs.
    """

    statistical: FitResult
    coherence: InputCoherence | None
    shifts: tuple[ShiftedEstimate, ...]
    total: Uncertainty
    parts: CoefficientParts | None


@dataclass(frozen=True)
class LinearValidation:
    """Free simulation of the maneuvers fitted, and of those held out.

    Departures from the trim are as measured: airspeed and attitude in products with what moves.
    `predictions` sets the error of each output held out beside what noise and covariance allow;
    `held_out_runs` are the maneuvers held out, with their outputs. `explained` is the same of the
    maneuvers fitted, where process noise is estimated and an output is missed by half.
    """

    simulated: tuple[Array, ...]
    fits: tuple[SignalFit, ...]
    held_out: tuple[SignalFit, ...]
    predictions: dict[str, Prediction]
    held_out_runs: tuple[tuple[Maneuver, Array], ...] = ()
    explained: dict[str, Prediction] = field(default_factory=dict)

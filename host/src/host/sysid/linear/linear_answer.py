"""What one linear model of one axis says, and what it rests on: the answer of a flight."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from host.sysid.aerodynamics.coefficient import Coefficient, CoefficientTable
from host.sysid.aerodynamics.coefficient_table import CoefficientParts
from host.sysid.models.residual_delays import STANDARD_DELAYS

if TYPE_CHECKING:
    from host.aircraft.mass_properties import Condition
    from host.arrays import Array
    from host.instrument.error_sources import ErrorSource
    from host.sysid.estimators.servo_parameters import ServoEstimate
    from host.sysid.flight.column_change import Record
    from host.sysid.maneuvers.maneuver_detection import DetectedManeuver
    from host.sysid.models.collinearity import Collinearity
    from host.sysid.models.diagnostics import IdentifiabilityFlag, SignalFit
    from host.sysid.models.fit_result import FitResult
    from host.sysid.models.maneuver import Maneuver
    from host.sysid.models.modal_analysis import Mode
    from host.sysid.models.state_space_model import DelayGroup, LinearModel
    from host.sysid.models.templates import Trim
    from host.sysid.models.thrust_column import ThrustColumn
    from host.sysid.numerics.input_coherence import InputCoherence
    from host.sysid.reconstruction.sensor_corrections import Correction
    from host.sysid.validation.prediction_limits import Prediction


@dataclass(frozen=True)
class Answer:
    """Answer of one model of one axis, and what it rests on."""

    template: str
    method: str
    model: LinearModel
    trim: Trim
    condition: Condition
    maneuvers: tuple[Maneuver, ...]
    used: tuple[DetectedManeuver, ...]
    held_out: tuple[DetectedManeuver, ...]
    result: FitResult
    fits: tuple[SignalFit, ...]
    validation: tuple[SignalFit, ...]
    identifiability_flags: tuple[IdentifiabilityFlag, ...]
    collinearity: Collinearity
    modes: tuple[Mode, ...]
    coefficients: tuple[Coefficient, ...]
    constant_inputs: tuple[str, ...]
    delays: dict[str, tuple[float, float]]
    servo: ServoEstimate | None = None  # of inputs that are commands
    corrections: tuple[Correction, ...] = ()
    simulated: tuple[Array, ...] = ()  # outputs of the maneuvers by free simulation
    own_model: bool = False  # of the user, not a template
    coherence: InputCoherence | None = None  # of what free simulation leaves with the inputs
    predictions: dict[str, Prediction] = field(default_factory=dict)  # of outputs held out
    noise_covariance: Array | None = None  # of the estimate, without systematic errors
    coefficient_parts: CoefficientParts | None = None
    errors: tuple[ErrorSource, ...] = ()  # that widen its intervals
    standard_delays: tuple[DelayGroup, ...] = STANDARD_DELAYS  # that its sensors may have
    thrust: ThrustColumn | None = None  # that was measured and changed, apart from the model
    left_out: tuple[str, ...] = ()  # motion outside a reduced template that nothing accounts for
    causes: dict[str, str] = field(default_factory=dict)  # what widens each interval most
    held_out_runs: tuple[
        tuple[Maneuver, Array], ...
    ] = ()  # held out, with their outputs by free simulation
    record: Record = ()  # what was done to which columns, and why

    @property
    def at_bound(self) -> tuple[str, ...]:
        """Delays that the search wanted larger than a sensor can be late."""
        limits = {d.name: d.limit_s for d in (*self.standard_delays, *self.model.delays)}
        values = {name: value for name, (value, _) in self.delays.items()}
        values |= {
            d.name: self.result.value(d.name)
            for d in self.model.delays
            if d.name in self.result.names
        }
        return tuple(n for n, v in values.items() if abs(v) >= limits.get(n, np.inf) * (1.0 - 1e-9))

    @property
    def table(self) -> CoefficientTable:
        """The coefficients and what they rest on."""
        return CoefficientTable(self.template, self.method, self.trim.alpha_rad, self.coefficients)

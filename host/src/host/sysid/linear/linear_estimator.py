"""Linear models of a flight: estimation, intervals, validation, each a stage that adds its part.

A stage hands on what it made; none changes what an earlier one said.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from host.aircraft.mass_properties import AirframeData
from host.aircraft.powerplant import Powerplant
from host.sysid.aerodynamics.coefficient_table import coefficients
from host.sysid.errors.systematic_errors import in_level_flight
from host.sysid.errors.widest_errors import widest_errors
from host.sysid.estimators.filter_error_gust import gust_parameters
from host.sysid.estimators.gust_penetration import without_gust_penetration
from host.sysid.flight.reconstructed_flight import ReconstructedFlight
from host.sysid.linear.left_out_motion import unaccounted_motion
from host.sysid.linear.linear_answer import Answer
from host.sysid.linear.linear_fit import changes_of, departure_of, fit_columns
from host.sysid.linear.linear_intervals import linear_intervals
from host.sysid.linear.linear_model import choose_model, standard_delays
from host.sysid.linear.linear_stages import LinearEstimate, LinearIntervals, LinearValidation
from host.sysid.linear.linear_validation import linear_validation
from host.sysid.linear.model_names import DEFAULT_METHOD, GUST
from host.sysid.linear.prepared_columns import prepare_columns
from host.sysid.models.collinearity import collinearity, constant_inputs
from host.sysid.models.diagnostics import assess_identifiability
from host.sysid.models.fit_result import without_parameters
from host.sysid.models.modal_analysis import modes
from host.sysid.models.state_space_model import LinearModel
from host.sysid.reconstruction.sensor_corrections import corrections


@dataclass(frozen=True)
class LinearEstimator:
    """One linear model by one method, in the stages of the pipeline.

    Attributes
    ----------
    template : str
        A template's name; of a model of the user's own what it is called in messages.
    own : LinearModel, optional
        Fit this in place of a template, to every maneuver where one of its inputs moved.
    method : str
    airframe : AirframeData, optional
        Gives coefficients.
    powerplant : Powerplant, optional
        Gives the rotor's spin.
    named : bool
        The user asked for this model: a stretch given is a maneuver of it, whatever moved more.
    options : mapping
        Options of the method, as keyword arguments of its function.
    """

    template: str
    own: LinearModel | None = None
    method: str = DEFAULT_METHOD
    airframe: AirframeData | None = None
    powerplant: Powerplant | None = None
    named: bool = False
    options: Mapping[str, object] = field(default_factory=dict)

    def estimate(self, flights: Sequence[ReconstructedFlight]) -> LinearEstimate:
        """Fit the model to the maneuvers of its axes, the last of an axis held out.

        Raises
        ------
        IdentificationError
            If there is no such maneuver, a column is missing, or the fit does not come about.
        """
        chosen = choose_model(flights, self.template, self.method, self.own, named=self.named)
        columns = prepare_columns(chosen, self.airframe, self.powerplant)
        found = fit_columns(columns, self.options)
        departure = departure_of(found, columns)
        record = (*columns.record, *changes_of(found, columns))
        left_out = unaccounted_motion(columns.chosen, found, departure)
        return LinearEstimate(columns, found, departure, record, left_out)

    def intervals(self, estimate: LinearEstimate) -> LinearIntervals:
        """Return the covariance from noise and repeats, and from every systematic error."""
        return linear_intervals(estimate, self.powerplant)

    def validation(self, estimate: LinearEstimate, intervals: LinearIntervals) -> LinearValidation:
        """Simulate the model freely over the maneuvers fitted and those held out."""
        return linear_validation(estimate, intervals, self.own)

    def answer(
        self, estimate: LinearEstimate, intervals: LinearIntervals, validation: LinearValidation
    ) -> Answer:
        """Return the parts of all stages as one answer, judged."""
        chosen, found = estimate.columns.chosen, estimate.found
        statistical, model = intervals.statistical, found.model
        gusts: list[str] = []  # what they do is no derivative
        if found.method == GUST:  # a user may name a parameter of his gust_..., and keeps it
            model = without_gust_penetration(model)
            gusts = gust_parameters(statistical)
        result = without_parameters(statistical, model, gusts, intervals.total)
        kept = np.array([name not in gusts for name in statistical.names])
        used = estimate.columns.used
        carrier = used[0].flight.compatibility
        return Answer(
            template=chosen.template if not chosen.own else found.model.name,
            method=found.method,
            model=model,
            trim=chosen.trim,
            thrust=None if estimate.departure is None else estimate.departure.thrust,
            condition=chosen.condition,
            maneuvers=found.maneuvers,
            used=tuple(m.found for m in used),
            held_out=tuple(m.found for m in estimate.columns.held_out),
            result=result,
            fits=validation.fits,
            validation=validation.held_out,
            identifiability_flags=assess_identifiability(result, found.maneuvers).flags,
            collinearity=collinearity(statistical, gusts),
            modes=modes(result, in_level_flight(model, chosen.trim)),
            coefficients=() if intervals.parts is None else coefficients(intervals.parts),
            coefficient_parts=intervals.parts,
            errors=intervals.errors,
            constant_inputs=constant_inputs(found.model, found.maneuvers),
            delays=found.delays,
            servo=estimate.columns.servo,
            corrections=() if carrier is None else corrections(carrier),
            simulated=validation.simulated,
            own_model=chosen.own,
            coherence=intervals.coherence,
            predictions=validation.predictions,
            held_out_runs=validation.held_out_runs,
            noise_covariance=statistical.covariance[np.ix_(kept, kept)],
            left_out=estimate.left_out,
            standard_delays=standard_delays(used),
            causes=widest_errors(found.result, statistical, intervals.total, intervals.shifts),
            record=estimate.record,
        )

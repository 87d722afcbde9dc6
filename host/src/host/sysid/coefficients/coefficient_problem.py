"""One flight as an estimation problem: its equations at assumed sensor errors, their slopes.

The record and what is known of the aircraft stay the same in all rounds of the search; only the
sensor errors change.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from host.aircraft.mass_properties import AirframeData
from host.aircraft.powerplant import Powerplant
from host.arrays import Array, IntArray
from host.constants import GRAVITY_MPS2
from host.instrument.deviations import SensorErrorModel
from host.instrument.error_sources import ErrorSource
from host.sysid.coefficients.aero_equations import KINEMATIC, Equation, FlightHistory, equations
from host.sysid.coefficients.vertical_gust import LENGTH_M
from host.sysid.coefficients.window_spectra import (
    EquationKey,
    Window,
    WindowTransform,
    equation_spectra,
    window_transform,
)
from host.sysid.models.coefficient_model import CoefficientModel
from host.sysid.reconstruction.inverse_sensor_model import (
    Record,
    Spectrum,
    apply_sensor_errors,
    attitude,
)

STEP = 0.3  # of a standard deviation: width of the numeric slopes
SensorErrorSlopes = dict[EquationKey, Spectrum]


@dataclass(slots=True)
class EquationData:
    """The equations of a flight for one set of sensor errors.

    Attributes
    ----------
    signals : dict
        Corrected signals of the whole flight, (n,) each, SI.
    equations : dict
        By name, at the samples of all windows (m,).
    spectra : dict
        Response and regressors by equation and window, (F, 1 + terms).
    lift, drag : Array, shape (m,)
    along_mps2 : float
        Mean specific force along the path of the whole flight.
    span_s : float
        How long the flight lasted.
    """

    signals: dict[str, Array]
    equations: dict[str, Equation]
    spectra: dict[EquationKey, Spectrum]
    lift: Array
    drag: Array
    along_mps2: float
    span_s: float


@dataclass(slots=True)
class FlightProblem:
    """A flight, its windows and what is known of the aircraft.

    Attributes
    ----------
    model : CoefficientModel
    record : Record
    history : FlightHistory
        For sensor errors of zero.
    airframe : AirframeData
    sensors : SensorErrorModel
    powerplant : Powerplant
    condition : tuple of float
        Mean airspeed (m/s) and dynamic pressure (Pa) of all maneuvers, mean angle of attack (rad)
        of the elevator maneuvers.
    airspeed_ratio : tuple of float
        Mean airspeed of the elevator maneuvers, and of the others, over that of all.
    windows : list of WindowTransform
    window_samples : IntArray, shape (m,)
        Samples of all windows.
    sources : tuple of ErrorSource
        Sensor errors in the order of the unknowns, with their deviations before the flight.
    """

    model: CoefficientModel
    record: Record
    history: FlightHistory
    airframe: AirframeData
    sensors: SensorErrorModel
    powerplant: Powerplant
    condition: tuple[float, float, float]
    airspeed_ratio: tuple[float, float]
    windows: list[WindowTransform]
    window_samples: IntArray
    sources: tuple[ErrorSource, ...]

    @property
    def error_names(self) -> tuple[str, ...]:
        """Sensor errors in the order of the unknowns."""
        return tuple(source.name for source in self.sources)

    @property
    def error_deviations(self) -> Array:
        """Their standard deviations before the flight, (errors,)."""
        return np.array([source.deviation for source in self.sources])

    @property
    def position(self) -> dict[str, int]:
        """Index of each coefficient among the unknowns, by name."""
        return {name: k for k, (name, _, _) in enumerate(self.model.named())}

    @property
    def positions(self) -> dict[str, IntArray]:
        """Indices of the coefficients of each equation, in the order of its terms."""
        of_term = [equation for _, equation, _ in self.model.named()]
        names = (*self.model.equations, *KINEMATIC)
        return {name: np.flatnonzero([x == name for x in of_term]) for name in names}

    def balance_deviation_mps2(self, gust_mps: float) -> float:
        """Return the standard deviation of the mean tangential balance.

        Parameters
        ----------
        gust_mps : float
            Standard deviation of the vertical gust, whose mean over the flight is not zero.
        """
        V = self.condition[0]
        lengths = V * self.record.samples * self.record.dt_s / LENGTH_M
        return float(GRAVITY_MPS2 * gust_mps / V / np.sqrt(lengths))

    def evaluate(
        self,
        record: Record,
        history: FlightHistory,
        errors: Array,
        coefficients: Mapping[str, Array] | None = None,
        signals: dict[str, Array] | None = None,
    ) -> EquationData:
        """Return all equations for given sensor errors, with their spectra.

        Parameters
        ----------
        record, history
            The flight, or its gust-free simulation.
        errors : Array, shape (errors,)
        coefficients : mapping, optional
            By equation. With them the response is the residual and there are no regressors.
        signals : dict, optional
            Corrected signals for the same sensor errors, where they are known already.
        """
        table = dict(zip(self.error_names, errors.tolist(), strict=True))
        record = record.on_clock(table.get("clock_share", 0.0))
        s = signals or apply_sensor_errors(record, table, self.sensors, self.condition[0])
        found = equations(
            self.model,
            record,
            s,
            table,
            history,
            self.airframe,
            self.powerplant,
            self.condition[2],
            self.window_samples,
        )
        by_name = found.by_name
        if coefficients is not None:
            by_name = {name: _residual(e, coefficients[name]) for name, e in by_name.items()}
        spectra = equation_spectra(by_name, self.windows)
        span_s = record.samples * record.dt_s
        return EquationData(s, by_name, spectra, found.lift, found.drag, found.along_mps2, span_s)


def _residual(equation: Equation, coefficients: Array) -> Equation:
    """Return the equation with its residual as response and no regressors."""
    residual = equation.response.copy()
    for factor, regressor in zip(coefficients, equation.regressors.values(), strict=True):
        residual -= factor * regressor
    return Equation(residual, {})


def sensor_error_slopes(
    problem: FlightProblem,
    record: Record,
    history: FlightHistory,
    base: EquationData,
    coefficients: Mapping[str, Array],
    errors: Array,
) -> tuple[SensorErrorSlopes, Array]:
    """Return the derivatives of residuals and mean levels by every sensor error.

    Parameters
    ----------
    problem : FlightProblem
    record, history
        The flight, or its gust-free simulation.
    base : EquationData
        Its equations at `errors`.
    coefficients : mapping
        By equation.
    errors : Array, shape (errors,)
        Sensor errors.

    Returns
    -------
    slopes : dict
        By equation and window, (F, errors).
    level_slopes : Array, shape (3, errors)
        Slopes of `mean_levels`.
    """
    start = {k: v[:, 0] - v[:, 1:] @ coefficients[k[0]] for k, v in base.spectra.items()}
    count = len(problem.sources)
    slopes = {k: np.zeros((len(v), count), np.complex128) for k, v in start.items()}
    base_levels = mean_levels(problem, base)
    level_slopes = np.zeros((len(base_levels), count))
    for j, source in enumerate(problem.sources):
        width = STEP * source.deviation
        perturbed = errors.copy()
        perturbed[j] += width
        same = None if source.kind.changes_data else base.signals
        other = problem.evaluate(record, history, perturbed, coefficients, same)
        level_slopes[:, j] = (mean_levels(problem, other) - base_levels) / width
        for key, spectrum in other.spectra.items():
            slopes[key][:, j] = (spectrum[:, 0] - start[key]) / width
    return slopes, level_slopes


def flight_problem(
    model: CoefficientModel,
    record: Record,
    t: Array,
    windows: Sequence[Window],
    airframe: AirframeData,
    sensors: SensorErrorModel,
    powerplant: Powerplant,
    sources: tuple[ErrorSource, ...],
) -> FlightProblem:
    """Return the problem of a record.

    Parameters
    ----------
    model : CoefficientModel
    record : Record
    t : Array, shape (n,)
        Its even grid, s.
    windows : sequence of Window
    airframe, sensors, powerplant
        Numbers of the aircraft file.
    sources : tuple of ErrorSource
        Sensor errors to estimate or to consider.
    """
    zero = dict.fromkeys((source.name for source in sources), 0.0)
    samples = [np.flatnonzero((t >= w.first_s) & (t <= w.last_s)) for w in windows]
    window_samples = np.unique(np.concatenate(samples))
    speed = np.sqrt(2.0 * np.maximum(record.columns["qbar_pa"], 1.0) / density(record))
    s = apply_sensor_errors(record, zero, sensors, float(speed[window_samples].mean()))
    axial = s["V"] * np.cos(s["alpha"])
    driving = (record.columns["throttle"], axial, density(record))
    thrust, spin, drive = powerplant.run(*driving, record.dt_s)
    slopes = powerplant.settled_slopes(*(float(x[window_samples].mean()) for x in driving))
    if "thrust_n" in record.columns:  # measured: no error of airspeed or density is in it
        thrust, slopes = record.columns["thrust_n"], (0.0, 0.0)
    history = FlightHistory(
        thrust,
        spin,
        drive,
        *attitude(record, s),
        s["V"] / float(s["V"][window_samples].mean()) - 1.0,
        axial,
        slopes,
    )
    along = _joined([k for k, w in zip(samples, windows, strict=True) if w.longitudinal], samples)
    condition = (
        float(s["V"][window_samples].mean()),
        float(s["qbar"][window_samples].mean()),
        float(s["alpha"][along].mean()),
    )
    across = _joined(
        [k for k, w in zip(samples, windows, strict=True) if not w.longitudinal], samples
    )
    own_mps = [float(s["V"][k].mean()) for k in (along, across)]
    return FlightProblem(
        model=model,
        record=record,
        history=history,
        airframe=airframe,
        sensors=sensors,
        powerplant=powerplant,
        condition=condition,
        airspeed_ratio=(own_mps[0] / condition[0], own_mps[1] / condition[0]),
        windows=[
            window_transform(
                inside, record.dt_s, window, model.forces, window_samples, set(model.equations)
            )
            for inside, window in zip(samples, windows, strict=True)
        ],
        window_samples=window_samples,
        sources=sources,
    )


def density(record: Record) -> Array:
    """Return the density of the air, (n,), kg/m3."""
    return record.columns["density_kgpm3"]


def mean_levels(problem: FlightProblem, data: EquationData) -> Array:
    """Return the tangential balance of the flight (m/s2) and the means of CD and CL, (3,).

    The balance is what mean specific force along the path, gain of speed and climb leave of each
    other: zero but for sensor errors and the mean gust.
    """
    s, record = data.signals, problem.record
    static = record.columns["static_pa"]
    span_s = data.span_s
    climb = -(static[-1] - static[0]) / (float(np.mean(density(record))) * GRAVITY_MPS2 * span_s)
    gain = (s["V"][-1] - s["V"][0]) / span_s
    balance = data.along_mps2 - gain - GRAVITY_MPS2 * climb / problem.condition[0]
    inside = _force_samples(problem)
    return np.array([balance, *(float(x[inside].mean()) for x in (data.drag, data.lift))])


def alpha_range(problem: FlightProblem, data: EquationData) -> tuple[float, float]:
    """Return the least and the largest angle of attack (rad) of the elevator maneuvers."""
    along = [w for w in problem.windows if "u" in w.equations]
    own = [data.signals["alpha"][w.samples] for w in along or problem.windows]
    return float(min(x.min() for x in own)), float(max(x.max() for x in own))


def mean_force_regressors(problem: FlightProblem, data: EquationData) -> dict[str, float]:
    """Return the mean of every regressor of the forces over the elevator maneuvers."""
    model = problem.model
    inside = _force_samples(problem)
    return {
        name: float(np.mean(data.equations[equation].regressors[term.label][inside]))
        for name, equation, term in model.named()
        if equation in model.forces
    }


def regressor_rms(problem: FlightProblem, data: EquationData) -> dict[str, float]:
    """Return the rms of every regressor about its mean in each window, by name of the term."""
    result = {}
    for name, equation in data.equations.items():
        windows = [w.positions for w in problem.windows if name in w.equations]
        for term, values in equation.regressors.items():
            parts = np.concatenate([values[k] - values[k].mean() for k in windows])
            result[f"{name}_{term}"] = float(np.sqrt(np.mean(parts**2)))
    return result


def _force_samples(problem: FlightProblem) -> IntArray:
    """Return the positions of the samples of all elevator maneuvers; of all without any."""
    along = [w.positions for w in problem.windows if "u" in w.equations]
    return _joined(along, [w.positions for w in problem.windows])


def _joined(own: Sequence[IntArray], every: Sequence[IntArray]) -> IntArray:
    """Return samples one behind the other; all where an axis has none of its own."""
    return np.concatenate(list(own or every))

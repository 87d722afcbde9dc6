"""The equations of one flight at assumed errors of the instrument, and the means of the flight.

What `fit` asks for at every round: the flight as recorded and the aircraft as known stay, errors of
the instrument change.
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
from host.sysid.coefficients.aero_equations import KINEMATIC, Equation, Flown, equations
from host.sysid.coefficients.coefficient_model import CoefficientModel
from host.sysid.coefficients.slow_gusts import LENGTH_M
from host.sysid.coefficients.window_spectra import Block, Key, Window, transformed, window_block
from host.sysid.compatibility.inverse_sensor_model import (
    Record,
    Spectrum,
    apply_sensor_errors,
    attitude,
)

STEP = 0.3  # of a standard deviation: width of the numeric slopes
OF_THE_BODY = ("mass_share", "ixx_share", "iyy_share", "izz_share", "thrust_share")  # no sensor's
Slopes = dict[Key, Spectrum]


@dataclass(slots=True)
class Rows:
    """Signals of a whole flight; its equations at the samples of all windows, and transformed per
    window: left side, then regressors.

    `lift` and `drag` are the coefficients at these samples; `along_mps2` is the mean specific force
    along the path of the whole flight.
    """

    signals: dict[str, Array]
    equations: dict[str, Equation]
    spectra: dict[Key, Spectrum]
    lift: Array
    drag: Array
    along_mps2: float


@dataclass(slots=True)
class FlightProblem:
    """A flight, its windows and what is known of the aircraft.

    Attributes
    ----------
    record : Record
    flown : Flown
        As far as the instrument is right.
    condition : tuple of float
        Mean airspeed (m/s) and dynamic pressure (Pa) of all maneuvers, mean angle of attack (rad)
        of the elevator's.
    faster : tuple of float
        Mean airspeed of the elevator's maneuvers, and of the others, over that of all.
    blocks : list of Block
        One a window.
    every : (m,) IntArray
        Samples of all windows.
    names : tuple of str
        Errors of the instrument, in their order.
    """

    model: CoefficientModel
    record: Record
    flown: Flown
    airframe: AirframeData
    data: SensorErrorModel
    plant: Powerplant
    condition: tuple[float, float, float]
    faster: tuple[float, float]
    blocks: list[Block]
    every: IntArray
    names: tuple[str, ...]

    @property
    def position(self) -> dict[str, int]:
        """Where coefficients stand among the unknowns, by name."""
        return {name: k for k, (name, _, _) in enumerate(self.model.named())}

    @property
    def places(self) -> dict[str, IntArray]:
        """Where those of each equation stand, in the order of its terms."""
        rows = [row for _, row, _ in self.model.named()]
        every = (*self.model.rows, *KINEMATIC)
        return {name: np.flatnonzero([row == name for row in rows]) for name in every}

    def balance_mps2(self, gust_mps: float) -> float:
        """Return the deviation of the mean tangential balance: vertical gusts left in the mean."""
        V = self.condition[0]
        lengths = V * self.record.samples * self.record.dt_s / LENGTH_M["w"]
        return float(GRAVITY_MPS2 * gust_mps / V / np.sqrt(lengths))

    def rows(
        self,
        record: Record,
        flown: Flown,
        errors: Array,
        own: Mapping[str, Array] | None = None,
        signals: dict[str, Array] | None = None,
    ) -> Rows:
        """Return all equations for given instrument errors, transformed.

        With `own`, the coefficients of each equation, only what they leave of the left side.
        `signals` are those for the same errors of the sensors, where they are known already.
        """
        table = dict(zip(self.names, errors.tolist(), strict=True))
        s = signals or apply_sensor_errors(record, table, self.data, self.condition[0])
        found = equations(
            self.model, record, s, table, flown, self.airframe, self.plant, self.condition[2],
            self.every,
        )  # fmt: skip
        full = found.rows
        if own is not None:
            full = {name: _left_over(e, own[name]) for name, e in full.items()}
        spectra = transformed(full, self.blocks)
        return Rows(s, full, spectra, found.lift, found.drag, found.along_mps2)


def _left_over(equation: Equation, own: Array) -> Equation:
    """Return what coefficients leave of the left side."""
    left = equation.left.copy()
    for factor, regressor in zip(own, equation.terms.values(), strict=True):
        left -= factor * regressor
    return Equation(left, {})


def moved_by_errors(
    problem: FlightProblem,
    record: Record,
    flown: Flown,
    rows: Rows,
    own: Mapping[str, Array],
    errors: Array,
    sd: Array,
) -> tuple[Slopes, Array]:
    """Return how residuals and mean levels (3, errors) move with every instrument error.

    Parameters
    ----------
    problem : FlightProblem
    record, flown
        The flight, or a gust-free one.
    rows : Rows
        Its equations at `errors`.
    own : mapping
        Coefficients of each equation.
    errors, sd : (errors,) Array
        Of the instrument, and their standard deviations before.
    """
    start = {k: v[:, 0] - v[:, 1:] @ own[k[0]] for k, v in rows.spectra.items()}
    slopes = {k: np.zeros((len(v), len(sd)), np.complex128) for k, v in start.items()}
    base = mean_levels(problem, rows)
    levels = np.zeros((len(base), len(sd)))
    for j, (name, width) in enumerate(zip(problem.names, STEP * sd, strict=True)):
        moved = errors.copy()
        moved[j] += width
        same = rows.signals if name in OF_THE_BODY else None
        other = problem.rows(record, flown, moved, own, same)
        levels[:, j] = (mean_levels(problem, other) - base) / width
        for key, spectrum in other.spectra.items():
            slopes[key][:, j] = (spectrum[:, 0] - start[key]) / width
    return slopes, levels


def prepared(
    model: CoefficientModel,
    record: Record,
    t: Array,
    windows: Sequence[Window],
    airframe: AirframeData,
    data: SensorErrorModel,
    plant: Powerplant,
    names: tuple[str, ...],
) -> FlightProblem:
    """Return the problem of a record, cut to an even grid `t` (n,), s.

    `names` are those of the instrument's errors.
    """
    zero = dict.fromkeys(names, 0.0)
    picked = [np.flatnonzero((t >= w.first_s) & (t <= w.last_s)) for w in windows]
    every = np.unique(np.concatenate(picked))
    speed = np.sqrt(2.0 * np.maximum(record.columns["qbar_pa"], 1.0) / density(record))
    s = apply_sensor_errors(record, zero, data, float(speed[every].mean()))
    flying = s["V"] * np.cos(s["alpha"])
    driving = (record.columns["throttle"], flying, density(record))
    flown = Flown(
        *plant.run(*driving, record.dt_s),
        *attitude(record, s),
        s["V"] / float(s["V"][every].mean()) - 1.0,
        flying,
        plant.settled_slopes(*(float(x[every].mean()) for x in driving)),
    )
    along = np.concatenate([k for k, w in zip(picked, windows, strict=True) if w.longitudinal])
    condition = (
        float(s["V"][every].mean()),
        float(s["qbar"][every].mean()),
        float(s["alpha"][along].mean()),
    )
    across = np.concatenate([k for k, w in zip(picked, windows, strict=True) if not w.longitudinal])
    own_mps = [float(s["V"][k].mean()) for k in (along, across)]
    faster = (own_mps[0] / condition[0], own_mps[1] / condition[0])
    blocks = [
        window_block(samples, record.dt_s, window, model.forces, every)
        for samples, window in zip(picked, windows, strict=True)
    ]
    return FlightProblem(
        model, record, flown, airframe, data, plant, condition, faster, blocks, every, names
    )


def density(record: Record) -> Array:
    """Return the density of the air, (n,), kg/m3."""
    return record.columns["density_kgpm3"]


def mean_levels(problem: FlightProblem, rows: Rows) -> Array:
    """Return the tangential balance of the flight (m/s2) and the means of CD and CL."""
    s, record = rows.signals, problem.record
    static = record.columns["static_pa"]
    span = record.samples * record.dt_s
    climb = -(static[-1] - static[0]) / (float(np.mean(density(record))) * GRAVITY_MPS2 * span)
    gain = (s["V"][-1] - s["V"][0]) / span
    balance = rows.along_mps2 - gain - GRAVITY_MPS2 * climb / problem.condition[0]
    inside = np.concatenate(
        [b.places for b in problem.blocks if problem.model.forces[0] in b.names]
    )
    return np.array([balance, *(float(x[inside].mean()) for x in (rows.drag, rows.lift))])


def flown_range(problem: FlightProblem, rows: Rows) -> tuple[float, float]:
    """Return the least and the largest angle of attack (rad) of the elevator's maneuvers."""
    own = [rows.signals["alpha"][b.samples] for b in problem.blocks if "u" in b.names]
    return float(min(x.min() for x in own)), float(max(x.max() for x in own))


def force_means(problem: FlightProblem, rows: Rows) -> dict[str, float]:
    """Return the mean of every regressor of the forces over the elevator's maneuvers."""
    model = problem.model
    inside = np.concatenate([b.places for b in problem.blocks if model.forces[0] in b.names])
    return {
        name: float(np.mean(rows.equations[row].terms[term.label][inside]))
        for name, row, term in model.named()
        if row in model.forces
    }


def regressor_sizes(problem: FlightProblem, rows: Rows) -> dict[str, float]:
    """Return the rms of every regressor about its mean in each window, by name of the term."""
    result = {}
    for name, equation in rows.equations.items():
        windows = [b.places for b in problem.blocks if name in b.names]
        for term, values in equation.terms.items():
            parts = np.concatenate([values[k] - values[k].mean() for k in windows])
            result[f"{name}_{term}"] = float(np.sqrt(np.mean(parts**2)))
    return result

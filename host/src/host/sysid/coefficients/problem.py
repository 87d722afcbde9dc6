"""The equations of one flight at assumed errors of the instrument, and the means of the flight.

What `fit` asks for at every round: the flight as recorded and the aircraft as known stay, errors of
the instrument change.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from host.compiled import Array
from host.sysid.aircraft.airframe import AirframeData
from host.sysid.aircraft.instrument_errors import InstrumentData
from host.sysid.aircraft.powerplant import Powerplant
from host.sysid.coefficients.model import CoefficientModel
from host.sysid.coefficients.rows import Equation, Flown, equations
from host.sysid.coefficients.turning import LENGTH_M
from host.sysid.coefficients.windows import Block, Key, Window, transformed, window_block
from host.sysid.compatibility.signals import Record, Spectrum, attitude, corrected
from host.sysid.models.templates import GRAVITY_MPS2


@dataclass(slots=True)
class Rows:
    """Equations of a flight in time, and transformed per window: left side, then regressors.

    `lift` and `drag` are the coefficients, (n,).
    """

    signals: dict[str, Array]
    equations: dict[str, Equation]
    spectra: dict[Key, Spectrum]
    lift: Array
    drag: Array


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
    """

    model: CoefficientModel
    record: Record
    flown: Flown
    airframe: AirframeData
    data: InstrumentData
    plant: Powerplant
    condition: tuple[float, float, float]
    faster: tuple[float, float]
    blocks: list[Block]

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
        names: Sequence[str],
        own: Mapping[str, Array] | None = None,
    ) -> Rows:
        """Return all equations for given instrument errors, transformed.

        With `own`, the coefficients of each equation, only what they leave of the left side.
        """
        table = dict(zip(names, errors.tolist(), strict=True))
        s = corrected(record, table, self.data, self.condition[0])
        found = equations(
            self.model, record, s, table, flown, self.airframe, self.plant, self.condition[2]
        )
        full = found.rows
        if own is not None:
            full = {
                name: Equation(
                    sum((-k * x for k, x in zip(own[name], e.terms.values(), strict=True)), e.left),
                    {},
                )
                for name, e in full.items()
            }
        return Rows(s, full, transformed(full, self.blocks), found.lift, found.drag)


def prepared(
    model: CoefficientModel,
    record: Record,
    t: Array,
    windows: Sequence[Window],
    airframe: AirframeData,
    data: InstrumentData,
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
    s = corrected(record, zero, data, float(speed[every].mean()))
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
        window_block(samples, record.dt_s, window, model.forces)
        for samples, window in zip(picked, windows, strict=True)
    ]
    return FlightProblem(model, record, flown, airframe, data, plant, condition, faster, blocks)


def density(record: Record) -> Array:
    """Return the density of the air, (n,), kg/m3."""
    return record.columns["density_kgpm3"]


def mean_levels(problem: FlightProblem, rows: Rows) -> Array:
    """Return the tangential balance of the flight (m/s2) and the means of CD and CL."""
    s, record = rows.signals, problem.record
    static = record.columns["static_pa"]
    span = record.samples * record.dt_s
    climb = -(static[-1] - static[0]) / (float(np.mean(density(record))) * GRAVITY_MPS2 * span)
    plane = s["ax"] * np.cos(s["alpha"]) + s["az"] * np.sin(s["alpha"])
    along = plane * np.cos(s["beta"]) + s["ay"] * np.sin(s["beta"])
    gain = (s["V"][-1] - s["V"][0]) / span
    balance = float(np.mean(along)) - gain - GRAVITY_MPS2 * climb / problem.condition[0]
    inside = np.concatenate(
        [b.samples for b in problem.blocks if problem.model.forces[0] in b.names]
    )
    return np.array([balance, *(float(x[inside].mean()) for x in (rows.drag, rows.lift))])


def flown_range(problem: FlightProblem, rows: Rows) -> tuple[float, float]:
    """Return the least and the largest angle of attack (rad) of the elevator's maneuvers."""
    own = [rows.signals["alpha"][b.samples] for b in problem.blocks if "u" in b.names]
    return float(min(x.min() for x in own)), float(max(x.max() for x in own))


def force_means(problem: FlightProblem, rows: Rows) -> dict[str, float]:
    """Return the mean of every regressor of the forces over the elevator's maneuvers."""
    model = problem.model
    inside = np.concatenate([b.samples for b in problem.blocks if model.forces[0] in b.names])
    return {
        name: float(np.mean(rows.equations[row].terms[term.label][inside]))
        for name, row, term in model.named()
        if row in model.forces
    }


def regressor_sizes(problem: FlightProblem, rows: Rows) -> dict[str, float]:
    """Return the rms of every regressor about its mean in each window, by name of the term."""
    result = {}
    for name, equation in rows.equations.items():
        windows = [b.samples for b in problem.blocks if name in b.names]
        for term, values in equation.terms.items():
            parts = np.concatenate([values[k] - values[k].mean() for k in windows])
            result[f"{name}_{term}"] = float(np.sqrt(np.mean(parts**2)))
    return result

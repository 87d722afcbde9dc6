"""Non-dimensional derivatives straight from flight, with every stated uncertainty in the interval.

Force, moment and kinematic equations of all maneuvers are compared in the frequency domain, their
coefficients and the errors of the instrument found together (Gauss-Newton; the errors have the
aircraft file's and the calibration's uncertainty as prior). Left factors are gust-free
(`gust_free`), so neither gusts nor sensor noise bias the answer; the weight of each equation comes
from its own residuals. Klein & Morelli, Aircraft System Identification, ch. 5 and 7, for equation
error in the frequency domain.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from host.compiled import Array
from host.sysid.aircraft.airframe import AirframeData
from host.sysid.aircraft.instrument_errors import InstrumentData, deviations
from host.sysid.aircraft.powerplant import Powerplant
from host.sysid.coefficients.answer import (
    CoefficientFit,
    Flight,
    Pull,
    derivatives,
    informed,
    trace,
)
from host.sysid.coefficients.gust_free import gust_free
from host.sysid.coefficients.joint import LastStep, prediction, pulls, told_inverse
from host.sysid.coefficients.local import Local, Mean, local_derivatives, zero_lift_drag
from host.sysid.coefficients.model import CoefficientModel, standard_model
from host.sysid.coefficients.rows import (
    GRAVITY_MPS2,
    KINEMATIC,
    Equation,
    Flown,
    equations,
)
from host.sysid.coefficients.turning import LENGTH_M, gust_information, gust_strength, turned
from host.sysid.coefficients.windows import (
    Block,
    Key,
    Window,
    noise_spectra,
    stacked,
    transformed,
    window_block,
)
from host.sysid.compatibility.signals import (
    Record,
    Spectrum,
    attitude,
    corrected,
    thinned,
    usable_length,
)
from host.sysid.errors import IdentificationError
from host.sysid.numerics.repeats import scatter

STEP = 0.3  # of a standard deviation: width of the numeric slopes
PLAIN_ROUNDS, FULL_ROUNDS = 3, 2
# Not estimated, only carried into the intervals: a vane's lag of 0.5 ms looks like an arm of 8 mm,
# and estimating the arm drew CL_de 15 % and CY_beta 11 % off (simulated flights, seeds 300-303).
# Pitot and density stay as calibrated too: the flight tells them no better than that, and what it
# seems to tell drew CL_alpha 0.5 % and CD_0 off (seeds 900-939).
CONSIDERED = (
    "cg_x_m", "imu_x_m", "ixx_share", "iyy_share", "izz_share",
    "pitot_scale", "pitot_drift_pa", "density_share",
)  # fmt: skip
HELD = 1e30
COLUMNS = (
    "alpha_rad", "beta_rad", "p_radps", "q_radps", "r_radps", "ax_mps2", "ay_mps2", "az_mps2",
    "phi_rad", "theta_rad", "elevator_rad", "aileron_rad", "rudder_rad", "throttle", "qbar_pa",
    "density_kgpm3", "static_pa",
)  # fmt: skip


@dataclass(slots=True)
class _Rows:
    """Equations of a flight in time, and transformed per window: left side, then regressors."""

    signals: dict[str, Array]
    equations: dict[str, Equation]
    spectra: dict[Key, Spectrum]
    lift: Array
    drag: Array


@dataclass(slots=True)
class _Search:
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
    ) -> _Rows:
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
        return _Rows(s, full, transformed(full, self.blocks), found.lift, found.drag)


def fit_coefficients(
    columns: Mapping[str, Array],
    windows: Sequence[Window],
    airframe: AirframeData,
    data: InstrumentData,
    plant: Powerplant,
    model: CoefficientModel | None = None,
) -> CoefficientFit:
    """Find the coefficients of lift, drag, side force and moments.

    Parameters
    ----------
    columns : mapping
        SI columns on an even grid as decoded, not moved to the CG; airborne throughout.
    windows : sequence of Window
        Maneuvers; at least one with the elevator and one with aileron and rudder.
    airframe, data, plant
        Of the aircraft file.
    model : CoefficientModel, optional
        The terms of every coefficient; `standard_model` by default.

    Raises
    ------
    IdentificationError
        If a column or an axis is missing, the search meets an unstable aircraft, or a term cannot
        be told from others at all.
    """
    missing = [c for c in ("t_s", *COLUMNS) if c not in columns]
    if missing:
        raise IdentificationError(f"coefficients need the columns {', '.join(missing)}")
    if not any(w.longitudinal for w in windows) or all(w.longitudinal for w in windows):
        raise IdentificationError(
            "coefficients need maneuvers of the elevator and of aileron and rudder"
        )
    t = columns["t_s"]
    kept = usable_length(len(t))
    late = max(w.last_s for w in windows) > t[kept - 1]
    shift = len(t) - kept if late else 0
    cut = {k: np.ascontiguousarray(columns[k][shift : shift + kept]) for k in COLUMNS}
    t = t[shift : shift + kept]
    record = thinned(cut, float(t[-1] - t[0]) / (kept - 1))
    t = t[0] + np.arange(record.samples) * record.dt_s
    prior = deviations(data, airframe)
    names = tuple(prior)
    search = _prepare(model or standard_model(), record, t, windows, airframe, data, plant, names)
    return _solve(search, names, np.array(list(prior.values())))


def _prepare(
    model: CoefficientModel,
    record: Record,
    t: Array,
    windows: Sequence[Window],
    airframe: AirframeData,
    data: InstrumentData,
    plant: Powerplant,
    names: tuple[str, ...],
) -> _Search:
    zero = dict.fromkeys(names, 0.0)
    picked = [np.flatnonzero((t >= w.first_s) & (t <= w.last_s)) for w in windows]
    every = np.unique(np.concatenate(picked))
    speed = np.sqrt(2.0 * np.maximum(record.columns["qbar_pa"], 1.0) / _density(record))
    s = corrected(record, zero, data, float(speed[every].mean()))
    flying = s["V"] * np.cos(s["alpha"])
    driving = (record.columns["throttle"], flying, _density(record))
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
    return _Search(model, record, flown, airframe, data, plant, condition, faster, blocks)


def _density(record: Record) -> Array:
    return record.columns["density_kgpm3"]


def _solve(search: _Search, names: tuple[str, ...], sd: Array) -> CoefficientFit:
    rows = search.rows(search.record, search.flown, np.zeros(len(sd)), names)
    position = {name: k for k, (name, _, _) in enumerate(search.model.named())}
    theta, errors = np.zeros(len(position)), np.zeros(len(sd))
    noise: dict[str, tuple[Array, Array]] = {}
    slopes: dict[Key, Spectrum] = {}
    left_slopes: dict[Key, Spectrum] = {}
    covariance: Array = np.zeros((0, 0))
    levels: Array = np.zeros((3, len(sd)))
    held = np.array([names.index(n) - len(sd) for n in CONSIDERED])
    for round_ in range(PLAIN_ROUNDS + FULL_ROUNDS):
        full = round_ >= PLAIN_ROUNDS
        rows = search.rows(search.record, search.flown, errors, names)
        own = {n: np.array([theta[position[f"{n}_{k}"]] for k in e.terms])
               for n, e in rows.equations.items()}  # fmt: skip
        terms = {n: tuple(e.terms) for n, e in rows.equations.items()}
        left = rows
        if round_ > 0:
            found = _local(search, rows, theta, position)
            calm = gust_free(
                search.record, rows.signals, search.flown, _reader(found),
                search.airframe, search.data, search.condition,
            )  # fmt: skip
            left = search.rows(*calm, errors, names)
            if round_ == PLAIN_ROUNDS:
                slopes, levels = _slopes(
                    search, search.record, search.flown, rows, own, errors, names, sd
                )
                left_slopes, _ = _slopes(search, *calm, left, own, errors, names, sd)
        A, Z, y, owner = stacked(
            search.blocks,
            rows.spectra,
            left.spectra,
            terms,
            slopes,
            left_slopes,
            own,
            position,
            len(sd),
            noise,
            (turned(rows.signals, search.blocks), turned(left.signals, search.blocks))
            if full
            else ({}, {}),
        )
        prior = np.zeros(A.shape[1])
        prior[-len(sd) :] = sd**-2.0 if full else HELD
        prior[held] = HELD
        miss = np.zeros(A.shape[1])
        miss[-len(sd) :] = -prior[-len(sd) :] * errors
        known = np.diag(prior)
        strength = gust_strength(noise, search.condition[0], search.record.dt_s) if full else {}
        if full:
            gusts = gust_information(
                search.blocks, strength, search.condition[0], search.record.dt_s
            )
            inside = slice(-len(sd) - len(gusts), -len(sd))
            known[inside, inside] += gusts
        normal = Z.T @ A + known
        meat = Z.T @ Z + known
        right = Z.T @ y + miss
        if full:
            balance = np.zeros(A.shape[1])
            left_mps2 = search.balance_mps2(strength["w"])
            balance[-len(sd) :] = levels[0] / left_mps2
            normal += np.outer(balance, balance)
            meat += np.outer(balance, balance)
            right -= balance * (_levels(search, rows)[0] / left_mps2)
        scale = 1.0 / np.sqrt(np.maximum(np.abs(np.diag(normal)), 1e-30))
        inverse = told_inverse(normal * np.outer(scale, scale), position) * np.outer(scale, scale)
        step = inverse @ right
        covariance = inverse @ meat @ inverse.T
        drawn = -inverse @ (Z.T @ A[:, held])  # Schmidt: what the considered errors do
        drawn[held] = np.eye(len(held))
        covariance += (drawn * sd[held] ** 2) @ drawn.T
        theta, errors = theta + step[: len(theta)], errors + step[-len(sd) :]
        last = LastStep(
            A, Z, y, normal, right, inverse, tuple(owner), noise, rows.spectra, len(theta), len(sd)
        )
        noise = noise_spectra(search.blocks, y - A @ step, owner, noise)
    return _answer(search, names, theta, errors, covariance, position, levels, last)


def _reader(found: Local) -> Callable[[str], float]:
    """Return slopes by name, 0 where no term makes one."""
    return lambda name: found[name][0] if name in found else 0.0


def _local(
    search: _Search,
    rows: _Rows,
    state: Array,
    position: Mapping[str, int],
    levels: Array | None = None,
) -> Local:
    """Return told terms and what follows from them: value, slope with the state."""
    _, drag, lift = _levels(search, rows)
    moved = np.zeros((3, len(state)))
    if levels is not None:
        moved[:, -levels.shape[1] :] = levels
    mean = Mean(search.condition[2], lift, drag, moved[2], moved[1])
    return local_derivatives(search.model, state, position, mean)


def _slopes(
    search: _Search,
    record: Record,
    flown: Flown,
    rows: _Rows,
    own: Mapping[str, Array],
    errors: Array,
    names: tuple[str, ...],
    sd: Array,
) -> tuple[dict[Key, Spectrum], Array]:
    """Return how residuals and mean levels move with every instrument error."""
    result = {k: np.zeros((len(v), len(sd)), np.complex128) for k, v in rows.spectra.items()}
    start = {k: v[:, 0] - v[:, 1:] @ own[k[0]] for k, v in rows.spectra.items()}
    base = _levels(search, rows)
    levels = np.zeros((len(base), len(sd)))
    for j, width in enumerate(STEP * sd):
        moved = errors.copy()
        moved[j] += width
        other = search.rows(record, flown, moved, names, own)
        levels[:, j] = (_levels(search, other) - base) / width
        for key, spectrum in other.spectra.items():
            result[key][:, j] = (spectrum[:, 0] - start[key]) / width
    return result, levels


def _levels(search: _Search, rows: _Rows) -> Array:
    """Return the tangential balance of the flight (m/s2) and the means of CD and CL."""
    s, record = rows.signals, search.record
    static = record.columns["static_pa"]
    span = record.samples * record.dt_s
    climb = -(static[-1] - static[0]) / (float(np.mean(_density(record))) * GRAVITY_MPS2 * span)
    plane = s["ax"] * np.cos(s["alpha"]) + s["az"] * np.sin(s["alpha"])
    along = plane * np.cos(s["beta"]) + s["ay"] * np.sin(s["beta"])
    gain = (s["V"][-1] - s["V"][0]) / span
    balance = float(np.mean(along)) - gain - GRAVITY_MPS2 * climb / search.condition[0]
    inside = np.concatenate([b.samples for b in search.blocks if search.model.forces[0] in b.names])
    return np.array([balance, *(float(x[inside].mean()) for x in (rows.drag, rows.lift))])


def _answer(
    search: _Search,
    names: tuple[str, ...],
    theta: Array,
    errors: Array,
    covariance: Array,
    position: Mapping[str, int],
    levels: Array,
    last: LastStep,
) -> CoefficientFit:
    """Add what geometry says, then drag at zero lift."""
    rows = search.rows(search.record, search.flown, errors, names)
    state = np.concatenate([theta, np.zeros(len(covariance) - len(theta) - len(errors)), errors])
    before = _local(search, rows, state, position)
    state, covariance, kept = informed(state, covariance, before, search.airframe)
    found = _local(search, rows, state, position, levels)
    _, drag, lift = _levels(search, rows)
    if "CL_alpha" in found and "CD_alpha" in found:
        mean = Mean(search.condition[2], lift, drag, levels[2], levels[1])
        means = _force_means(search, rows)
        found["CD_0"] = zero_lift_drag(search.model, state, position, mean, means, found)
    values = {name: value for name, (value, _) in found.items()}
    slopes = np.vstack([*(slope for _, slope in found.values()), np.eye(len(state))[-len(names) :]])
    own = slopes @ covariance @ slopes.T
    agreement = scatter(tuple(values), *pulls(last, search.blocks, slopes[: len(values)] @ kept))
    own[np.diag_indices(len(values))] += agreement.extra_variance
    left = np.sqrt(np.maximum(np.diag(covariance)[-len(names) :], 0.0))
    air, plant = float(np.mean(_density(search.record))), search.plant
    spin, thrust = (float(np.mean(x)) for x in (search.flown.spin_radps, search.flown.thrust_n))
    pull = Pull(
        thrust,
        plant.slope(spin, search.condition[0], air),
        float(plant.hub_m[2] * plant.axis[0] - plant.hub_m[0] * plant.axis[2]),
    )
    return CoefficientFit(
        derivatives(values, own[: len(values), : len(values)], _sizes(search, rows)),
        own,
        {
            n: (float(e), float(d))
            for n, e, d in zip(names, state[-len(names) :], left, strict=True)
        },
        Flight(*search.condition, lift, drag, pull, _flown_range(search, rows), search.faster),
        {
            name: trace(
                equation.left,
                sum(float(state[position[f"{name}_{k}"]]) * x for k, x in equation.terms.items())
                + np.zeros(search.record.samples),
                [b.samples for b in search.blocks if name in b.names],
            )
            for name, equation in rows.equations.items()
            if name not in KINEMATIC
        },
        prediction(last, search.blocks),
        agreement,
    )


def _flown_range(search: _Search, rows: _Rows) -> tuple[float, float]:
    """Return the least and the largest angle of attack of the elevator's maneuvers."""
    own = [rows.signals["alpha"][b.samples] for b in search.blocks if "u" in b.names]
    return float(min(x.min() for x in own)), float(max(x.max() for x in own))


def _force_means(search: _Search, rows: _Rows) -> dict[str, float]:
    """Return the mean of every regressor of the forces over the elevator's maneuvers."""
    model = search.model
    inside = np.concatenate([b.samples for b in search.blocks if model.forces[0] in b.names])
    return {
        name: float(np.mean(rows.equations[row].terms[term.label][inside]))
        for name, row, term in model.named()
        if row in model.forces
    }


def _sizes(search: _Search, rows: _Rows) -> dict[str, float]:
    """Return the rms of every regressor about its mean in each window."""
    result = {}
    for name, equation in rows.equations.items():
        windows = [b.samples for b in search.blocks if name in b.names]
        for term, values in equation.terms.items():
            parts = np.concatenate([values[k] - values[k].mean() for k in windows])
            result[f"{name}_{term}"] = float(np.sqrt(np.mean(parts**2)))
    return result

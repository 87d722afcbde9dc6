"""Non-dimensional derivatives straight from flight, with every stated uncertainty in the interval.

Force, moment and kinematic equations of all maneuvers are compared in the frequency domain, their
coefficients and the errors of the instrument found together (Gauss-Newton; the errors have the
aircraft file's and the calibration's uncertainty as prior). Left factors are gust-free
(`gust_free`), so neither gusts nor sensor noise bias the answer; the weight of each equation comes
from its own residuals. Klein & Morelli, Aircraft System Identification, ch. 5 and 7, for equation
error in the frequency domain.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from host.compiled import Array, BoolArray, IntArray
from host.sysid.airframe import AirframeData
from host.sysid.coefficient_rows import (
    GRAVITY_MPS2,
    KINEMATIC,
    LATERAL,
    LONGITUDINAL,
    Equation,
    Flown,
    equations,
)
from host.sysid.coefficient_signals import Record, Spectrum, attitude, corrected, usable_length
from host.sysid.errors import IdentificationError
from host.sysid.gust_free import gust_free
from host.sysid.instrument_errors import InstrumentData, deviations
from host.sysid.powerplant import Powerplant

LOW_HZ, HIGH_HZ = 0.1, 4.5
KINEMATIC_LOW_HZ = 0.4  # below, the attitude filter's own errors rule
TRENDS = 4  # constant to cubic, taken out of the kinematic equations; constant and slope elsewhere
SMOOTHING_HZ, GRID = 0.5, 12  # of residual spectra
STEP = 0.3  # of a standard deviation: width of the numeric slopes
PLAIN_ROUNDS, FULL_ROUNDS = 3, 2
QUANTILE = 1.96
FLAG_SHARE = 0.15  # a wider half-width is named as not to be relied on
# Mean of the tangential balance over a flight: vertical wind of 0.08 m/s left after averaging.
BALANCE_MPS2 = 0.05
# Not estimated, only carried into the intervals: a vane's lag of 0.5 ms looks like an arm of 8 mm,
# and estimating the arm drew CL_de 15 % and CY_beta 11 % off (simulated flights, seeds 300-303).
CONSIDERED = ("cg_x_m", "imu_x_m")
HELD = 1e30
COLUMNS = (
    "alpha_rad", "beta_rad", "p_radps", "q_radps", "r_radps", "ax_mps2", "ay_mps2", "az_mps2",
    "phi_rad", "theta_rad", "elevator_rad", "aileron_rad", "rudder_rad", "throttle", "qbar_pa",
    "density_kgpm3", "static_pa",
)  # fmt: skip
Key = tuple[str, int]


@dataclass(frozen=True, slots=True)
class Window:
    """A maneuver: from and to in the time of the columns, and whether the elevator moved."""

    first_s: float
    last_s: float
    longitudinal: bool


@dataclass(frozen=True, slots=True)
class Derivative:
    """A coefficient with its 95 % half-width; `flagged` if it is too wide to be relied on."""

    name: str
    value: float
    half_width: float
    flagged: bool


@dataclass(frozen=True, slots=True)
class CoefficientFit:
    """Coefficients, and the instrument's errors as value and standard deviation left."""

    derivatives: tuple[Derivative, ...]
    errors: dict[str, tuple[float, float]]


@dataclass(frozen=True, slots=True)
class _Block:
    """One window: its samples, frequencies, transform, transformed trends."""

    samples: IntArray
    hertz: Array
    transform: Spectrum
    trends: Spectrum
    names: tuple[str, ...]


@dataclass(slots=True)
class _Rows:
    """Equations of a flight in time, and transformed per window: left side, then regressors."""

    signals: dict[str, Array]
    equations: dict[str, Equation]
    spectra: dict[Key, Spectrum]


@dataclass(slots=True)
class _Search:
    record: Record
    flown: Flown
    airframe: AirframeData
    data: InstrumentData
    plant: Powerplant
    condition: tuple[float, float, float]
    blocks: list[_Block]

    def rows(self, record: Record, flown: Flown, errors: Array, names: Sequence[str]) -> _Rows:
        """Return all equations for given instrument errors, transformed."""
        table = dict(zip(names, errors.tolist(), strict=True))
        s = corrected(record, table, self.data, self.condition[0])
        full = equations(
            record, s, table, flown, self.airframe, self.plant, self.condition[2]
        )  # fmt: skip
        return _Rows(s, full, _transformed(full, self.blocks))


def fit_coefficients(
    columns: Mapping[str, Array],
    windows: Sequence[Window],
    airframe: AirframeData,
    data: InstrumentData,
    plant: Powerplant,
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

    Raises
    ------
    IdentificationError
        If a column or an axis is missing, or the search meets an unstable aircraft.
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
    record = Record(float(np.median(np.diff(t))), cut)
    prior = deviations(data, airframe)
    names = tuple(prior)
    search = _prepare(record, t, windows, airframe, data, plant, names)
    return _solve(search, names, np.array(list(prior.values())))


def _prepare(
    record: Record,
    t: Array,
    windows: Sequence[Window],
    airframe: AirframeData,
    data: InstrumentData,
    plant: Powerplant,
    names: tuple[str, ...],
) -> _Search:
    zero = dict.fromkeys(names, 0.0)
    inside = [(t >= w.first_s) & (t <= w.last_s) for w in windows]
    every = np.any(inside, axis=0)
    speed = np.sqrt(2.0 * np.maximum(record.columns["qbar_pa"], 1.0) / _density(record))
    s = corrected(record, zero, data, float(speed[every].mean()))
    flying = s["V"] * np.cos(s["alpha"])
    flown = Flown(
        *plant.run(record.columns["throttle"], flying, _density(record), record.dt_s),
        *attitude(record, s),
    )
    along = np.any([m for m, w in zip(inside, windows, strict=True) if w.longitudinal], axis=0)
    condition = (
        float(s["V"][every].mean()),
        float(s["qbar"][every].mean()),
        float(s["alpha"][along].mean()),
    )
    blocks = []
    for mask, window in zip(inside, windows, strict=True):
        samples = np.flatnonzero(mask)
        n = len(samples)
        if n < 200:
            raise IdentificationError(f"window of {n} samples at {window.first_s:.1f} s: too short")
        length = n * record.dt_s
        hertz = np.arange(1, int(HIGH_HZ * length) + 1) / length
        hertz = hertz[hertz >= LOW_HZ]
        phase = np.outer(hertz, np.arange(n) * record.dt_s)
        transform = np.exp(-2j * np.pi * phase) / np.sqrt(n)
        trend = np.linspace(-1.0, 1.0, n)[None, :] ** np.arange(TRENDS)[:, None]
        names_here = LONGITUDINAL if window.longitudinal else LATERAL
        blocks.append(_Block(samples, hertz, transform, transform @ trend.T, names_here))
    return _Search(record, flown, airframe, data, plant, condition, blocks)


def _density(record: Record) -> Array:
    return record.columns["density_kgpm3"]


def _transformed(full: Mapping[str, Equation], blocks: Sequence[_Block]) -> dict[Key, Spectrum]:
    result: dict[Key, Spectrum] = {}
    for number, block in enumerate(blocks):
        columns, ends = [], [0]
        for name in block.names:
            columns += [full[name].left, *full[name].terms.values()]
            ends.append(len(columns))
        table = np.stack([c[block.samples] for c in columns], axis=1)
        spectra = block.transform @ (table - table.mean(axis=0))
        for k, name in enumerate(block.names):
            result[name, number] = spectra[:, ends[k] : ends[k + 1]]
    return result


def _solve(search: _Search, names: tuple[str, ...], sd: Array) -> CoefficientFit:
    rows = search.rows(search.record, search.flown, np.zeros(len(sd)), names)
    position: dict[str, int] = {}
    for name in dict.fromkeys((*LONGITUDINAL, *LATERAL)):
        for term in rows.equations[name].terms:
            position[f"{name}_{term}"] = len(position)
    theta, errors = np.zeros(len(position)), np.zeros(len(sd))
    noise: dict[str, tuple[Array, Array]] = {}
    slopes: dict[Key, Spectrum] = {}
    covariance: Array = np.zeros((0, 0))
    levels: Array = np.zeros((4, len(sd)))
    held = np.array([names.index(n) - len(sd) for n in CONSIDERED])
    for round_ in range(PLAIN_ROUNDS + FULL_ROUNDS):
        full = round_ >= PLAIN_ROUNDS
        rows = search.rows(search.record, search.flown, errors, names)
        own = {n: np.array([theta[position[f"{n}_{k}"]] for k in e.terms])
               for n, e in rows.equations.items()}  # fmt: skip
        left, left_slopes = rows, slopes
        if round_ > 0:
            found = {name: float(theta[k]) for name, k in position.items()}
            calm = gust_free(
                search.record, rows.signals, search.flown, found.__getitem__,
                search.airframe, search.data, search.condition,
            )  # fmt: skip
            left = search.rows(*calm, errors, names)
            if full:
                slopes, levels = _slopes(
                    search, search.record, search.flown, rows, own, errors, names, sd
                )
                left_slopes, _ = _slopes(search, *calm, left, own, errors, names, sd)
        A, Z, y, owner = _stacked(
            search.blocks, rows, left, slopes, left_slopes, own, position, len(sd), noise
        )
        prior = np.zeros(A.shape[1])
        prior[-len(sd) :] = sd**-2.0 if full else HELD
        prior[held] = HELD
        miss = np.zeros(A.shape[1])
        miss[-len(sd) :] = -prior[-len(sd) :] * errors
        normal = Z.T @ A + np.diag(prior)
        meat = Z.T @ Z + np.diag(prior)
        right = Z.T @ y + miss
        if full:
            balance = np.zeros(A.shape[1])
            balance[-len(sd) :] = levels[0] / BALANCE_MPS2
            normal += np.outer(balance, balance)
            meat += np.outer(balance, balance)
            right -= balance * (_levels(search, rows)[0] / BALANCE_MPS2)
        scale = 1.0 / np.sqrt(np.maximum(np.abs(np.diag(normal)), 1e-30))
        inverse = np.linalg.inv(normal * np.outer(scale, scale)) * np.outer(scale, scale)
        step = inverse @ right
        covariance = inverse @ meat @ inverse.T
        drawn = -inverse @ (Z.T @ A[:, held])  # Schmidt: what the considered errors do
        drawn[held] = np.eye(len(held))
        covariance += (drawn * sd[held] ** 2) @ drawn.T
        theta, errors = theta + step[: len(theta)], errors + step[-len(sd) :]
        noise = _noise(search.blocks, y - A @ step, owner, noise)
    return _answer(search, names, theta, errors, covariance, position, levels)


def _used(block: _Block, name: str) -> BoolArray:
    return block.hertz >= (KINEMATIC_LOW_HZ if name in KINEMATIC else LOW_HZ)


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
    base = _levels(search, rows)
    levels = np.zeros((len(base), len(sd)))
    for j, width in enumerate(STEP * sd):
        moved = errors.copy()
        moved[j] += width
        other = search.rows(record, flown, moved, names)
        levels[:, j] = (_levels(search, other) - base) / width
        for key, spectrum in other.spectra.items():
            slope = (spectrum - rows.spectra[key]) / width
            result[key][:, j] = slope[:, 0] - slope[:, 1:] @ own[key[0]]
    return result, levels


def _levels(search: _Search, rows: _Rows) -> Array:
    """Return the tangential balance of the flight (m/s2) and means of CD, alpha and elevator."""
    s, record = rows.signals, search.record
    static = record.columns["static_pa"]
    span = record.samples * record.dt_s
    climb = -(static[-1] - static[0]) / (float(np.mean(_density(record))) * GRAVITY_MPS2 * span)
    along = s["ax"] * np.cos(s["alpha"]) + s["az"] * np.sin(s["alpha"])
    gain = (s["V"][-1] - s["V"][0]) / span
    balance = float(np.mean(along)) - gain - GRAVITY_MPS2 * climb / search.condition[0]
    inside = np.concatenate([b.samples for b in search.blocks if "CD" in b.names])
    means = [rows.equations["CD"].left, s["alpha"], s["de"]]
    return np.array([balance, *(float(x[inside].mean()) for x in means)])


def _stacked(
    blocks: Sequence[_Block],
    rows: _Rows,
    left: _Rows,
    slopes: Mapping[Key, Spectrum],
    left_slopes: Mapping[Key, Spectrum],
    own: Mapping[str, Array],
    position: Mapping[str, int],
    n_errors: int,
    noise: Mapping[str, tuple[Array, Array]],
) -> tuple[Array, Array, Array, list[tuple[str, int]]]:
    """Return slopes, left factors and residuals, real and imaginary parts weighted."""
    keys = [(name, k) for k, block in enumerate(blocks) for name in block.names]
    degrees = [TRENDS if name in KINEMATIC else 2 for name, _ in keys]
    begin = len(position) + np.concatenate([[0], np.cumsum(degrees)])
    width = int(begin[-1]) + n_errors
    A: list[Array] = []
    Z: list[Array] = []
    y: list[Array] = []
    for n, (name, k) in enumerate(keys):
        block, used = blocks[k], _used(blocks[k], name)
        weight = np.sqrt(2.0) / np.ones(int(used.sum()))
        if name in noise:
            weight = np.sqrt(2.0 / np.interp(block.hertz[used], *noise[name]))
        places = [position[f"{name}_{term}"] for term in rows.equations[name].terms]
        spectrum = rows.spectra[name, k]
        for source, its_slopes, target in ((rows, slopes, A), (left, left_slopes, Z)):
            M = np.zeros((len(block.hertz), width), np.complex128)
            M[:, places] = source.spectra[name, k][:, 1:]
            M[:, begin[n] : begin[n + 1]] = block.trends[:, : degrees[n]]
            if its_slopes:
                M[:, -n_errors:] = -its_slopes[name, k]
            target.append(_real(M[used] * weight[:, None]))
        y.append(_real((spectrum[:, 0] - spectrum[:, 1:] @ own[name])[used] * weight))
    return np.vstack(A), np.vstack(Z), np.concatenate(y), keys


def _real(values: Spectrum) -> Array:
    return np.concatenate([values.real, values.imag])


def _noise(
    blocks: Sequence[_Block],
    residual: Array,
    keys: Sequence[Key],
    before: Mapping[str, tuple[Array, Array]],
) -> dict[str, tuple[Array, Array]]:
    """Return the smoothed residual spectrum of every equation, pooled over maneuvers."""
    found: dict[str, list[tuple[Array, Array]]] = {}
    at = 0
    for name, k in keys:
        hertz = blocks[k].hertz[_used(blocks[k], name)]
        own = residual[at : at + 2 * len(hertz)].reshape(2, -1)
        at += 2 * len(hertz)
        power = 0.5 * np.sum(own**2, axis=0)
        if name in before:
            power = power * np.interp(hertz, *before[name])
        found.setdefault(name, []).append((hertz, power))
    grid = np.linspace(LOW_HZ, HIGH_HZ, GRID)
    result: dict[str, tuple[Array, Array]] = {}
    for name, parts in found.items():
        hertz = np.concatenate([h for h, _ in parts])
        power = np.concatenate([p for _, p in parts])
        near = np.exp(-0.5 * ((hertz[None, :] - grid[:, None]) / SMOOTHING_HZ) ** 2)
        result[name] = (grid, np.maximum(near @ power / near.sum(axis=1), 1e-30))
    return result


def _answer(
    search: _Search,
    names: tuple[str, ...],
    theta: Array,
    errors: Array,
    covariance: Array,
    position: Mapping[str, int],
    levels: Array,
) -> CoefficientFit:
    rows = search.rows(search.record, search.flown, errors, names)
    _, drag, alpha, elevator = _levels(search, rows)
    values = {name: float(theta[k]) for name, k in position.items() if name != "CD_alpha2"}
    slopes = {name: np.eye(len(covariance))[position[name]] for name in values}
    curved = theta[position["CD_alpha2"]] * _spread(search, rows)
    values["CD_0"] = drag - curved - values["CD_alpha"] * alpha - values["CD_de"] * elevator
    slope = -alpha * slopes["CD_alpha"] - elevator * slopes["CD_de"]
    slope[-len(names) :] += levels[1] - values["CD_alpha"] * levels[2] - values["CD_de"] * levels[3]
    slopes["CD_0"] = slope
    derivatives = []
    for name, value in values.items():
        half = QUANTILE * float(np.sqrt(max(slopes[name] @ covariance @ slopes[name], 0.0)))
        derivatives.append(Derivative(name, value, half, half > FLAG_SHARE * abs(value)))
    left = np.sqrt(np.maximum(np.diag(covariance)[-len(names) :], 0.0))
    return CoefficientFit(
        tuple(derivatives),
        {n: (float(e), float(d)) for n, e, d in zip(names, errors, left, strict=True)},
    )


def _spread(search: _Search, rows: _Rows) -> float:
    inside = np.concatenate([b.samples for b in search.blocks if "CD" in b.names])
    return float(np.mean(rows.equations["CD"].terms["alpha2"][inside]))

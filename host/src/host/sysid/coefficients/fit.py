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
from host.sysid.coefficients.problem import (
    FlightProblem,
    Rows,
    density,
    flown_range,
    force_means,
    mean_levels,
    prepared,
    regressor_sizes,
)
from host.sysid.coefficients.rows import KINEMATIC, Flown
from host.sysid.coefficients.turning import gust_information, gust_strength, turned
from host.sysid.coefficients.windows import Key, Window, noise_spectra, stacked
from host.sysid.compatibility.signals import Record, Spectrum, thinned, usable_length
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
HELD = 1e30  # inverse variance of what is not estimated, or not yet
COLUMNS = (
    "alpha_rad", "beta_rad", "p_radps", "q_radps", "r_radps", "ax_mps2", "ay_mps2", "az_mps2",
    "phi_rad", "theta_rad", "elevator_rad", "aileron_rad", "rudder_rad", "throttle", "qbar_pa",
    "density_kgpm3", "static_pa",
)  # fmt: skip


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
    problem = prepared(model or standard_model(), record, t, windows, airframe, data, plant, names)
    return _solve(problem, names, np.array(list(prior.values())))


def _solve(problem: FlightProblem, names: tuple[str, ...], sd: Array) -> CoefficientFit:
    rows = problem.rows(problem.record, problem.flown, np.zeros(len(sd)), names)
    position = {name: k for k, (name, _, _) in enumerate(problem.model.named())}
    theta, errors = np.zeros(len(position)), np.zeros(len(sd))
    noise: dict[str, tuple[Array, Array]] = {}
    slopes: dict[Key, Spectrum] = {}
    left_slopes: dict[Key, Spectrum] = {}
    covariance: Array = np.zeros((0, 0))
    levels: Array = np.zeros((3, len(sd)))
    held = np.array([names.index(n) - len(sd) for n in CONSIDERED])
    for round_ in range(PLAIN_ROUNDS + FULL_ROUNDS):
        full = round_ >= PLAIN_ROUNDS
        rows = problem.rows(problem.record, problem.flown, errors, names)
        own = {n: np.array([theta[position[f"{n}_{k}"]] for k in e.terms])
               for n, e in rows.equations.items()}  # fmt: skip
        terms = {n: tuple(e.terms) for n, e in rows.equations.items()}
        left = rows
        if round_ > 0:
            found = _local(problem, rows, theta, position)
            calm = gust_free(
                problem.record, rows.signals, problem.flown, _reader(found),
                problem.airframe, problem.data, problem.condition,
            )  # fmt: skip
            left = problem.rows(*calm, errors, names)
            if round_ == PLAIN_ROUNDS:
                slopes, levels = _slopes(
                    problem, problem.record, problem.flown, rows, own, errors, names, sd
                )
                left_slopes, _ = _slopes(problem, *calm, left, own, errors, names, sd)
        A, Z, y, owner = stacked(
            problem.blocks,
            rows.spectra,
            left.spectra,
            terms,
            slopes,
            left_slopes,
            own,
            position,
            len(sd),
            noise,
            (turned(rows.signals, problem.blocks), turned(left.signals, problem.blocks))
            if full
            else ({}, {}),
        )
        prior = np.zeros(A.shape[1])
        prior[-len(sd) :] = sd**-2.0 if full else HELD
        prior[held] = HELD
        miss = np.zeros(A.shape[1])
        miss[-len(sd) :] = -prior[-len(sd) :] * errors
        known = np.diag(prior)
        strength = gust_strength(noise, problem.condition[0], problem.record.dt_s) if full else {}
        if full:
            gusts = gust_information(
                problem.blocks, strength, problem.condition[0], problem.record.dt_s
            )
            inside = slice(-len(sd) - len(gusts), -len(sd))
            known[inside, inside] += gusts
        normal = Z.T @ A + known
        meat = Z.T @ Z + known
        right = Z.T @ y + miss
        if full:
            balance = np.zeros(A.shape[1])
            left_mps2 = problem.balance_mps2(strength["w"])
            balance[-len(sd) :] = levels[0] / left_mps2
            normal += np.outer(balance, balance)
            meat += np.outer(balance, balance)
            right -= balance * (mean_levels(problem, rows)[0] / left_mps2)
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
        noise = noise_spectra(problem.blocks, y - A @ step, owner, noise)
    return _answer(problem, names, theta, errors, covariance, position, levels, last)


def _reader(found: Local) -> Callable[[str], float]:
    """Return slopes by name, 0 where no term makes one."""
    return lambda name: found[name][0] if name in found else 0.0


def _local(
    problem: FlightProblem,
    rows: Rows,
    state: Array,
    position: Mapping[str, int],
    levels: Array | None = None,
) -> Local:
    """Return told terms and what follows from them: value, slope with the state."""
    _, drag, lift = mean_levels(problem, rows)
    moved = np.zeros((3, len(state)))
    if levels is not None:
        moved[:, -levels.shape[1] :] = levels
    mean = Mean(problem.condition[2], lift, drag, moved[2], moved[1])
    return local_derivatives(problem.model, state, position, mean)


def _slopes(
    problem: FlightProblem,
    record: Record,
    flown: Flown,
    rows: Rows,
    own: Mapping[str, Array],
    errors: Array,
    names: tuple[str, ...],
    sd: Array,
) -> tuple[dict[Key, Spectrum], Array]:
    """Return how residuals and mean levels move with every instrument error."""
    result = {k: np.zeros((len(v), len(sd)), np.complex128) for k, v in rows.spectra.items()}
    start = {k: v[:, 0] - v[:, 1:] @ own[k[0]] for k, v in rows.spectra.items()}
    base = mean_levels(problem, rows)
    levels = np.zeros((len(base), len(sd)))
    for j, width in enumerate(STEP * sd):
        moved = errors.copy()
        moved[j] += width
        other = problem.rows(record, flown, moved, names, own)
        levels[:, j] = (mean_levels(problem, other) - base) / width
        for key, spectrum in other.spectra.items():
            result[key][:, j] = (spectrum[:, 0] - start[key]) / width
    return result, levels


def _answer(
    problem: FlightProblem,
    names: tuple[str, ...],
    theta: Array,
    errors: Array,
    covariance: Array,
    position: Mapping[str, int],
    levels: Array,
    last: LastStep,
) -> CoefficientFit:
    """Add what geometry says, then drag at zero lift."""
    rows = problem.rows(problem.record, problem.flown, errors, names)
    state = np.concatenate([theta, np.zeros(len(covariance) - len(theta) - len(errors)), errors])
    before = _local(problem, rows, state, position)
    state, covariance, kept = informed(state, covariance, before, problem.airframe)
    found = _local(problem, rows, state, position, levels)
    _, drag, lift = mean_levels(problem, rows)
    if "CL_alpha" in found and "CD_alpha" in found:
        mean = Mean(problem.condition[2], lift, drag, levels[2], levels[1])
        means = force_means(problem, rows)
        found["CD_0"] = zero_lift_drag(problem.model, state, position, mean, means, found)
    values = {name: value for name, (value, _) in found.items()}
    slopes = np.vstack([*(slope for _, slope in found.values()), np.eye(len(state))[-len(names) :]])
    own = slopes @ covariance @ slopes.T
    agreement = scatter(tuple(values), *pulls(last, problem.blocks, slopes[: len(values)] @ kept))
    own[np.diag_indices(len(values))] += agreement.extra_variance
    left = np.sqrt(np.maximum(np.diag(covariance)[-len(names) :], 0.0))
    air, plant = float(np.mean(density(problem.record))), problem.plant
    spin, thrust = (float(np.mean(x)) for x in (problem.flown.spin_radps, problem.flown.thrust_n))
    pull = Pull(
        thrust,
        plant.slope(spin, problem.condition[0], air),
        float(plant.hub_m[2] * plant.axis[0] - plant.hub_m[0] * plant.axis[2]),
    )
    return CoefficientFit(
        derivatives(values, own[: len(values), : len(values)], regressor_sizes(problem, rows)),
        own,
        {
            n: (float(e), float(d))
            for n, e, d in zip(names, state[-len(names) :], left, strict=True)
        },
        Flight(*problem.condition, lift, drag, pull, flown_range(problem, rows), problem.faster),
        {
            name: trace(
                equation.left,
                sum(float(state[position[f"{name}_{k}"]]) * x for k, x in equation.terms.items())
                + np.zeros(problem.record.samples),
                [b.samples for b in problem.blocks if name in b.names],
            )
            for name, equation in rows.equations.items()
            if name not in KINEMATIC
        },
        prediction(last, problem.blocks),
        agreement,
    )

"""Joint estimation of states and parameters by Kalman filters, extended and unscented."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from host.arrays import Array
from host.errors import IdentificationError
from host.sysid.estimators.start_values import start_values_of
from host.sysid.models.fit_result import FitResult
from host.sysid.models.maneuver import Maneuver
from host.sysid.models.state_space_model import LinearModel
from host.sysid.numerics.discretisation import discretise
from host.sysid.numerics.output_error_problem import check_shapes

PASSES = 2  # over the record: the second starts from the parameters of the first
INITIAL_RELATIVE_SD = 0.5  # first standard deviation of a parameter, relative to its size
PROCESS_SHARE = 1e-4  # default process noise per root second, of the rms of a state
SIGMA_POINT_SPREAD = 1e-1  # alpha of the sigma points
NEGLIGIBLE_CORRELATION = 0.05  # twice the deviation of a correlation over 1600 samples
REPORTED_INFLATION = 2.0  # from here on there is a warning


@dataclass(slots=True)
class _Filter:
    """What both filters share: model, noise, layout of the augmented state."""

    model: LinearModel
    R: Array
    process: Array
    names: tuple[str, ...]
    n_states: int

    def split(self, joint: Array) -> tuple[Array, Array, Array]:
        """Return states, common parameters and [rate biases, output biases]."""
        n, q = self.n_states, len(self.model.parameters)
        return joint[..., :n], joint[..., n : n + q], joint[..., n + q :]


def fit_extended(
    model: LinearModel,
    maneuvers: Sequence[Maneuver],
    *,
    process: Array | None = None,
    noise: Array | None = None,
    start: Array | None = None,
) -> FitResult:
    """Fit by an extended Kalman filter; see `fit_unscented` for the parameters.

    The state is augmented by the parameters as constants; the filter is linearised with the exact
    derivatives of the discretised model (Jategaonkar, Flight Vehicle System Identification, 2nd
    ed., ch. 7).
    """
    return _run(model, maneuvers, process, noise, start, unscented=False)


def fit_unscented(
    model: LinearModel,
    maneuvers: Sequence[Maneuver],
    *,
    process: Array | None = None,
    noise: Array | None = None,
    start: Array | None = None,
) -> FitResult:
    """Fit by an unscented Kalman filter.

    The state is augmented by the parameters as constants; sigma points are propagated by one
    Runge-Kutta step per sample (Julier & Uhlmann, Proceedings of the IEEE 92, 2004).

    Parameters
    ----------
    model, maneuvers
        Model and data; maneuvers are filtered one after another.
    process : Array, optional
        Process noise of each state, per root second, shape (n,).
    noise : Array, optional
        Standard deviation of each output, shape (p,); by default from third differences.
    start : Array, optional
        Common parameters; by default the mean of a prior, else from equation error.
    """
    return _run(model, maneuvers, process, noise, start, unscented=True)


def noise_deviation(maneuvers: Sequence[Maneuver]) -> Array:
    """Return the deviation of white output noise from third differences (20 times its power)."""
    stacked = np.vstack([np.diff(m.outputs, n=3, axis=0) for m in maneuvers])
    floor = 1e-6 * np.max(np.abs(np.vstack([m.outputs for m in maneuvers])), axis=0) + 1e-12
    return np.asarray(np.maximum(np.sqrt(np.mean(stacked**2, axis=0) / 20.0), floor))


def change_by_priors(model: LinearModel, covariance: Array, began: Array) -> Array:
    """Return what an estimate moves by, so that priors count once, about their own means.

    A pass takes where it starts for the mean. Moved by P P0^-1 (mean - start) the answer is exact
    where the model is linear, and stays linearised about the pass before.

    Parameters
    ----------
    model : LinearModel
    covariance : Array, shape (P, k)
        Behind the pass, of all unknowns by the k parameters and delays of the model.
    began : Array, shape (k,)
        Where the pass started.
    """
    mean = np.append(model.start, np.zeros(len(model.delays)))
    sd = [*(p.prior_sd for p in model.parameters), *(d.prior_sd_s for d in model.delays)]
    return np.asarray(covariance @ (np.array(sd) ** -2.0 * (mean - began)))


def innovation_inflation(white: Sequence[Array]) -> float:
    """Return the factor by which coloured innovations inflate a variance, at least 1.

    It is the power of the whitened innovations times their correlation time in samples, which is
    summed until the correlation is negligible (initial sequence estimator: Geyer, Statistical
    Science 7, 1992); mean over outputs.

    Parameters
    ----------
    white : sequence of Array
        Per maneuver (samples, outputs); of unit power and white where the noise model is right.
    """
    total = 0.0
    for column in range(white[0].shape[1]):
        parts = [w[:, column] for w in white]
        lags = min(len(x) for x in parts) // 4
        moments = np.array(
            [sum(float(x[k:] @ x[: len(x) - k]) for x in parts) for k in range(lags)]
        )
        moments /= sum(len(x) for x in parts)
        negligible = np.flatnonzero(moments < NEGLIGIBLE_CORRELATION * moments[0])
        end = int(negligible[0]) if len(negligible) else lags
        total += max(float(2.0 * np.sum(moments[:end]) - moments[0]), 0.0)
    return float(max(total / white[0].shape[1], 1.0))


def inflation_lines(excess: float) -> tuple[str, ...]:
    """Return the warning about an inflated variance; none below `REPORTED_INFLATION`."""
    if excess <= REPORTED_INFLATION:
        return ()
    return (
        f"innovations tell {excess:.0f} times less than the noise model says (gusts, coloured"
        f" noise): intervals are {np.sqrt(excess):.1f} times wider for it, and the estimate is"
        " not the best one",
    )


def _run(
    model: LinearModel,
    maneuvers: Sequence[Maneuver],
    process: Array | None,
    noise: Array | None,
    start: Array | None,
    *,
    unscented: bool,
) -> FitResult:
    if model.delays or model.accelerometer_offsets:
        raise IdentificationError(
            "Kalman filters have no delays or levers: estimate those by output error"
        )
    for maneuver in maneuvers:
        check_shapes(model, maneuver)
    n, q = len(model.states), len(model.parameters)
    deviation = noise_deviation(maneuvers) if noise is None else np.asarray(noise)
    spread = np.array(
        [
            np.std(maneuvers[0].outputs[:, model.outputs.index(s)]) if s in model.outputs else 1.0
            for s in model.states
        ]
    )
    intensity = PROCESS_SHARE * spread if process is None else np.asarray(process)
    locals_ = [f"bias_rate.{s}" for s in model.state_biases]
    locals_ += [f"bias.{y}" for y in model.output_biases]
    names = (*(p.name for p in model.parameters), *locals_)
    filter_ = _Filter(model, np.diag(deviation**2), intensity, names, n)
    first = start_values_of(model, maneuvers)[:q] if start is None else np.array(start)
    size = n + len(names)
    joint: Array = np.zeros(size)
    P: Array = np.zeros((size, size))
    spread_first = INITIAL_RELATIVE_SD * np.abs(first) + 1e-3 * np.max(np.abs(first))
    for k, parameter in enumerate(model.parameters):
        if np.isfinite(parameter.prior_sd):
            spread_first[k] = parameter.prior_sd
            first[k] = parameter.start if start is None else first[k]
    joint[n : n + q] = began = first
    residuals: list[Array] = []
    white: list[Array] = []
    for _ in range(PASSES):
        # Each pass starts with the first covariance: data must not be counted twice.
        began = joint[n : n + q].copy()
        P[:] = 0.0
        P[n : n + q, n : n + q] = np.diag(spread_first**2)
        residuals, white = [], []
        for maneuver in maneuvers:
            for k, state in enumerate(model.states):
                is_measured = state in model.outputs
                joint[k] = maneuver.outputs[0, model.outputs.index(state)] if is_measured else 0.0
                P[k, :] = P[:, k] = 0.0
                known = deviation[model.outputs.index(state)] if is_measured else spread[k]
                P[k, k] = (3.0 * known) ** 2
            for k in range(n + q, size):
                joint[k] = 0.0
                P[k, :] = P[:, k] = 0.0
                P[k, k] = _bias_variance(model, maneuver, k - n - q)
            step = _unscented_pass if unscented else _extended_pass
            joint, P, e, whitened = step(filter_, maneuver, joint, P)
            if not np.isfinite(joint).all():
                raise IdentificationError(
                    f"{maneuver.name}: the Kalman filter diverged; give better start values"
                )
            residuals.append(e)
            white.append(whitened)
    return filter_result(
        "unscented Kalman filter" if unscented else "extended Kalman filter",
        (model, names, joint[n:] + change_by_priors(model, P[n:, n : n + q], began), P[n:, n:]),
        maneuvers,
        (residuals, white),
        {"noise_deviation": deviation, "process": intensity},
    )


def filter_result(
    method: str,
    estimated: tuple[LinearModel, tuple[str, ...], Array, Array],
    maneuvers: Sequence[Maneuver],
    innovations: tuple[Sequence[Array], Sequence[Array]],
    details: Mapping[str, float | Array],
) -> FitResult:
    """Return the result of a Kalman filter, its covariance inflated by the coloured innovations.

    Parameters
    ----------
    method : str
    estimated : tuple
        Model, names, estimate (n,), covariance for white innovations (n, n).
    maneuvers : sequence of Maneuver
    innovations : tuple of sequences of Array
        Of each maneuver: in the units of the outputs and whitened, (samples, p).
    details : mapping
    """
    model, names, estimate, covariance = estimated
    residuals, white = innovations
    excess = innovation_inflation(white)
    return FitResult(
        method=method,
        model=model,
        names=names,
        estimate=estimate,
        covariance=excess * covariance,
        covariance_white=covariance,
        degrees_of_freedom=np.full(len(names), np.inf),
        residuals=tuple(residuals),
        fitted=tuple(m.outputs - e for m, e in zip(maneuvers, residuals, strict=True)),
        residual_kind="innovation",
        noise_covariance=np.atleast_2d(np.cov(np.vstack(residuals).T)),
        iterations=PASSES,
        converged=True,
        warnings=inflation_lines(excess),
        details={**details, "innovation_inflation": excess},
    )


def _bias_variance(model: LinearModel, maneuver: Maneuver, k: int) -> float:
    rates = len(model.state_biases)
    if k >= rates:
        column = model.outputs.index(model.output_biases[k - rates])
        return float(np.mean(maneuver.outputs[:, column] ** 2)) + 1e-12
    state = model.state_biases[k]
    if state not in model.outputs:
        return 1.0
    series = maneuver.outputs[:, model.outputs.index(state)]
    return float(np.var(np.diff(series)) / maneuver.dt_s**2 + np.mean(series**2)) + 1e-12


def _extended_pass(
    filter_: _Filter, maneuver: Maneuver, joint: Array, P: Array
) -> tuple[Array, Array, Array, Array]:
    model, n = filter_.model, filter_.n_states
    m, q = len(model.inputs), len(model.parameters)
    foh = model.hold == "foh"
    entries, outputs = model.entries("AB"), model.entries("CD")
    rates = len(model.state_biases)
    bias_rows = [model.states.index(s) for s in model.state_biases]
    row = np.concatenate([entries.row, np.array(bias_rows, dtype=np.int64)])
    column = np.concatenate([entries.column, np.full(rates, n + m, dtype=np.int64)])
    parameter = np.concatenate([entries.parameter, np.arange(q, q + rates, dtype=np.int64)])
    gain = np.concatenate([entries.gain, np.ones(rates)])
    Q = np.zeros_like(P)
    Q[:n, :n] = np.diag(filter_.process**2) * maneuver.dt_s
    e, white = np.zeros_like(maneuver.outputs), np.zeros_like(maneuver.outputs)
    increments = np.diff(maneuver.inputs, axis=0, append=maneuver.inputs[-1:])
    for k in range(maneuver.samples):
        x, theta, biases = filter_.split(joint)
        A, B, C, D = model.matrices(theta)
        u = maneuver.inputs[k]
        wide = np.concatenate([x, u])
        H = np.zeros((len(model.outputs), len(joint)))
        H[:, :n] = C
        for t in range(len(outputs.row)):
            place = n + outputs.parameter[t]
            H[outputs.row[t], place] += outputs.gain[t] * wide[outputs.column[t]]
        predicted = C @ x + D @ u
        for b, output in enumerate(model.output_biases):
            predicted[model.outputs.index(output)] += biases[rates + b]
            H[model.outputs.index(output), n + q + rates + b] = 1.0
        e[k] = maneuver.outputs[k] - predicted
        S = H @ P @ H.T + filter_.R
        white[k] = np.linalg.solve(np.linalg.cholesky(S), e[k])
        K = np.linalg.solve(S, H @ P).T
        joint = joint + K @ e[k]
        keep = np.eye(len(joint)) - K @ H
        P = keep @ P @ keep.T + K @ filter_.R @ K.T
        x, theta, biases = filter_.split(joint)
        A, B, _, _ = model.matrices(theta)
        AB = np.zeros((n, n + m + 1))
        AB[:, :n], AB[:, n : n + m] = A, B
        for b, place in enumerate(bias_rows):
            AB[place, -1] = biases[b]
        step, slopes = discretise(
            AB, n, m, foh, maneuver.dt_s, row, column, parameter, gain, q + rates
        )
        parts = [x, u, [1.0]]
        if foh:
            parts.append(increments[k])
        z = np.concatenate(parts)
        F = np.eye(len(joint))
        F[:n, :n] = step[:, :n]
        F[:n, n : n + q + rates] = np.einsum("ijq,j->iq", slopes, z)
        joint[:n] = step @ z
        P = F @ P @ F.T + Q
        P = 0.5 * (P + P.T)
    return joint, P, e, white


def _unscented_pass(
    filter_: _Filter, maneuver: Maneuver, joint: Array, P: Array
) -> tuple[Array, Array, Array, Array]:
    model, n, size = filter_.model, filter_.n_states, len(joint)
    Q = np.zeros_like(P)
    Q[:n, :n] = np.diag(filter_.process**2) * maneuver.dt_s
    scale = SIGMA_POINT_SPREAD**2 * size
    mean_weight = np.full(2 * size + 1, 0.5 / scale)
    mean_weight[0] = 1.0 - size / scale
    weight = mean_weight.copy()
    weight[0] += 3.0 - SIGMA_POINT_SPREAD**2
    e, white = np.zeros_like(maneuver.outputs), np.zeros_like(maneuver.outputs)
    next_inputs = np.vstack([maneuver.inputs[1:], maneuver.inputs[-1:]])
    if model.hold == "zoh":
        next_inputs = maneuver.inputs
    for k in range(maneuver.samples):
        points = _sigma_points(joint, P, scale)
        y = _outputs(filter_, points, maneuver.inputs[k])
        mean = mean_weight @ y
        dy, dx = y - mean, points - joint
        S = (weight[:, None] * dy).T @ dy + filter_.R
        K = np.linalg.solve(S, (weight[:, None] * dy).T @ dx).T
        e[k] = maneuver.outputs[k] - mean
        white[k] = np.linalg.solve(np.linalg.cholesky(S), e[k])
        joint = joint + K @ e[k]
        P = P - K @ S @ K.T
        P = 0.5 * (P + P.T)
        points = _sigma_points(joint, P, scale)
        propagated = _advance(filter_, points, maneuver.inputs[k], next_inputs[k], maneuver.dt_s)
        joint = mean_weight @ propagated
        d = propagated - joint
        P = (weight[:, None] * d).T @ d + Q
        P = 0.5 * (P + P.T)
    return joint, P, e, white


def _sigma_points(joint: Array, P: Array, scale: float) -> Array:
    size = np.sqrt(np.maximum(np.diag(P), 1e-300))
    scaled = P / np.outer(size, size)
    ridge = 0.0
    while True:
        try:
            root = np.linalg.cholesky(scaled + ridge * np.eye(len(joint)))
            break
        except np.linalg.LinAlgError:
            ridge = max(10.0 * ridge, 1e-12)
            if ridge > 1.0:
                raise IdentificationError(
                    "the unscented filter lost its covariance; give better start values"
                ) from None
    spread = np.sqrt(scale) * (size[:, None] * root).T
    return np.vstack([joint, joint + spread, joint - spread])


def _systems(filter_: _Filter, theta: Array, pair: str) -> Array:
    """Return [A B] or [C D] of every sigma point, (points, rows, columns)."""
    model = filter_.model
    base = np.hstack([getattr(model, pair[0]), getattr(model, pair[1])])
    result = np.repeat(base[None], len(theta), axis=0)
    entries = model.entries(pair)
    for t in range(len(entries.row)):
        result[:, entries.row[t], entries.column[t]] += (
            entries.gain[t] * theta[:, entries.parameter[t]]
        )
    return result


def _outputs(filter_: _Filter, points: Array, u: Array) -> Array:
    x, theta, biases = filter_.split(points)
    model = filter_.model
    wide = np.hstack([x, np.repeat(u[None], len(x), axis=0)])
    y = np.einsum("sij,sj->si", _systems(filter_, theta, "CD"), wide)
    rates = len(model.state_biases)
    for b, output in enumerate(model.output_biases):
        y[:, model.outputs.index(output)] += biases[:, rates + b]
    return np.asarray(y)


def _advance(filter_: _Filter, points: Array, u0: Array, u1: Array, dt_s: float) -> Array:
    x, theta, biases = filter_.split(points)
    model = filter_.model
    systems = _systems(filter_, theta, "AB")
    constant = np.zeros_like(x)
    for b, state in enumerate(model.state_biases):
        constant[:, model.states.index(state)] = biases[:, b]

    def rate(value: Array, u: Array) -> Array:
        wide = np.hstack([value, np.repeat(u[None], len(value), axis=0)])
        return np.asarray(np.einsum("sij,sj->si", systems, wide) + constant)

    middle = 0.5 * (u0 + u1)
    k1 = rate(x, u0)
    k2 = rate(x + 0.5 * dt_s * k1, middle)
    k3 = rate(x + 0.5 * dt_s * k2, middle)
    k4 = rate(x + dt_s * k3, u1)
    propagated = points.copy()
    propagated[:, : x.shape[1]] = x + dt_s / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
    return propagated

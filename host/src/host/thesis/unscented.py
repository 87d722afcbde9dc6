"""Joint estimation of states and parameters by the unscented Kalman filter."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from host.arrays import Array
from host.errors import IdentificationError
from host.sysid.estimators.kalman import JointFilter, fit_jointly
from host.sysid.models import FitResult, LinearModel, Maneuver

SIGMA_POINT_SPREAD = 1e-1  # alpha of the sigma points


def fit_unscented(
    model: LinearModel,
    maneuvers: Sequence[Maneuver],
    *,
    process: Array | None = None,
    noise: Array | None = None,
    start: Array | None = None,
) -> FitResult:
    """Fit by an unscented Kalman filter; see `fit_jointly` for the parameters.

    The state is augmented by the parameters as constants; sigma points are propagated by one
    Runge-Kutta step per sample (Julier & Uhlmann, Proceedings of the IEEE 92, 2004).
    """
    return fit_jointly(
        "unscented Kalman filter", _unscented_pass, model, maneuvers, process, noise, start
    )


def _unscented_pass(
    filter_: JointFilter, maneuver: Maneuver, joint: Array, P: Array
) -> tuple[Array, Array, Array, Array]:
    model, n, size = filter_.model, filter_.n_states, len(joint)
    Q = np.zeros_like(P)
    Q[:n, :n] = np.diag(filter_.process**2) * maneuver.dt_s
    scale = SIGMA_POINT_SPREAD**2 * size
    mean_weight = np.full(2 * size + 1, 0.5 / scale)
    mean_weight[0] = 1.0 - size / scale
    weight = mean_weight.copy()
    # 1 - alpha^2 + beta, beta = 2 of a normal law (Wan & van der Merwe, 2000).
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


def _systems(filter_: JointFilter, theta: Array, pair: str) -> Array:
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


def _outputs(filter_: JointFilter, points: Array, u: Array) -> Array:
    x, theta, biases = filter_.split(points)
    model = filter_.model
    wide = np.hstack([x, np.repeat(u[None], len(x), axis=0)])
    y = np.einsum("sij,sj->si", _systems(filter_, theta, "CD"), wide)
    rates = len(model.state_biases)
    for b, output in enumerate(model.output_biases):
        y[:, model.outputs.index(output)] += biases[:, rates + b]
    return np.asarray(y)


def _advance(filter_: JointFilter, points: Array, u0: Array, u1: Array, dt_s: float) -> Array:
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

"""The same fit by other means: scipy's least squares, an lsim-based fit, the AeroID package."""

from __future__ import annotations

import time
from collections.abc import Mapping

import aeroid
import numpy as np
from host.arrays import Array
from host.sysid.estimators.start_values import start_values
from host.sysid.numerics import OutputProblem
from numpy.typing import NDArray
from scipy import optimize, signal

Float = NDArray[np.float64]
STATES = ("u_mps", "alpha_rad", "q_radps", "theta_rad")


def scipy_distance(problem: OutputProblem, theta: Array, bound: Array) -> float:
    """Return the largest distance to scipy's optimum in bounds, weights of our optimum.

    scipy starts where ours did: at equation error, many bounds away.
    """
    outputs = problem.outputs(theta)
    assert outputs is not None
    weight = 1.0 / np.std(problem.measured(0) - outputs[0], axis=1)[:, None]

    def residual(t: Array) -> Array:
        y = problem.outputs(t)
        if y is None:
            return np.full(problem.measured(0).size, 1e6)
        return np.asarray(((y[0] - problem.measured(0)) * weight).ravel())

    peer = optimize.least_squares(residual, start_values(problem), method="lm", x_scale=bound)
    return float(np.max(np.abs(peer.x - theta) / bound))


def lsim_s(problem: OutputProblem, bound: Array) -> float:
    """Return the seconds of the same fit built on scipy's lsim and finite differences."""
    maneuver = problem.maneuvers[0]
    model = problem.model
    time_s = maneuver.time_s
    deviation = np.ones(4)

    def residual(t: Array) -> Array:
        A, B, C, D = model.matrices(t)
        _, y, _ = signal.lsim((A, B, C, D), maneuver.inputs, time_s, X0=t[20:], interp=False)
        return np.asarray(((y - maneuver.outputs) / deviation).ravel())

    begin = time.process_time()
    now = start_values(problem)
    deviation = np.std(residual(now).reshape(-1, 4), axis=0)
    for _ in range(8):  # noise re-estimated until the answer rests, as ours does
        found = optimize.least_squares(residual, now, method="lm", x_scale=bound, xtol=1e-6)
        moved = float(np.max(np.abs(found.x - now) / bound))
        now = found.x
        deviation = deviation * np.std(residual(now).reshape(-1, 4), axis=0)
        if moved < 0.01:
            break
    return time.process_time() - begin


def aeroid_fit(problem: OutputProblem, theta: Array, bound: Array) -> tuple[float, float]:
    """Return the seconds of the AeroID package and its largest distance from ours in bounds.

    It is given the noise (ours estimates it) and starts where ours does. It knows no free start
    states, so they are parameters of a shift: x = x0 + xi, xi(0) = 0.
    """
    maneuver = problem.maneuvers[0]
    names = list(problem.model.parameter_names) + [f"start{k}" for k in range(4)]
    order = {(t.matrix, t.row, t.column): t.parameter for t in problem.model.terms}
    A_names = [order["A", i, j] for i in range(4) for j in range(4)]
    B_names = [order["B", i, 0] for i in range(4)]

    def dynamics(_t: float, xi: Float, u: Float, p: Mapping[str, float]) -> Float:
        A = np.array([p[n] for n in A_names]).reshape(4, 4)
        x0 = np.array([p[f"start{k}"] for k in range(4)])
        return np.asarray(A @ (xi + x0) + np.array([p[n] for n in B_names]) * u[0])

    def measurement(_t: float, xi: Float, _u: Float, p: Mapping[str, float]) -> Float:
        return np.asarray(xi + np.array([p[f"start{k}"] for k in range(4)]))

    start = start_values(problem)
    outputs = problem.outputs(theta)
    assert outputs is not None
    deviation = np.std(problem.measured(0) - outputs[0], axis=1)
    model = aeroid.Model(
        states=STATES,
        controls=("elevator",),
        parameters=dict(zip(names, map(float, start), strict=True)),
        dynamics=dynamics,
        outputs=tuple(f"{s}_measured" for s in STATES),
        measurement=measurement,
    )
    measured = np.asarray(np.hstack([maneuver.outputs, maneuver.inputs]), dtype=np.float64)
    columns = (*(f"{s}_measured" for s in STATES), "elevator")
    data = aeroid.FlightData(
        np.asarray(maneuver.time_s, dtype=np.float64), dict(zip(columns, measured.T, strict=True))
    )
    weights = {f"{s}_measured": 1.0 / float(d) for s, d in zip(STATES, deviation, strict=True)}
    begin = time.process_time()
    found = aeroid.identify(model, data, names, weights=weights, x0=np.zeros(4))
    seconds = time.process_time() - begin
    peer = np.array([found.parameters[n] for n in names])
    return seconds, float(np.max(np.abs(peer - theta) / bound))

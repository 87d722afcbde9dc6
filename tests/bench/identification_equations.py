"""A user's non-linear model against the same model hand-written in numpy with scipy's solver.

    python tests/bench/identification_equations.py

The longitudinal model that is shipped, without its delay, over 6 s at 50 Hz with known noise, wings
level: ours by `output-error-white`; the peer by `solve_ivp` and `least_squares` with finite
differences, which is what one writes by hand. Processor time of one fit, compilation apart. That of
six degrees of freedom is measured by itself: responses and slopes in a new process whose cache is
empty, and in the next one.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
import tempfile
import time
from importlib.resources import files
from pathlib import Path

import numpy as np
from host.arrays import Array
from host.constants import GRAVITY_MPS2
from host.errors import IdentificationError
from host.files.user_text import parse_toml
from host.sysid import Maneuver, fit
from host.sysid.models import NonlinearModel, equations_from
from host.sysid.numerics import output_problem
from scipy import integrate, optimize

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from tests.bench.fixed_work import unit_s

MOST_BOUNDS, LEAST_RATIO = 0.01, 30.0
MOST_COMPILED, MOST_KEPT = 130.0, 20.0  # units of the fixed computation: a first run, and the next
MOST_OFF = 2.0  # what is said of the time, and the time
DT_S, SAMPLES = 0.02, 300
STEP = 1e-2  # of the peer's finite differences, in bounds
NOISE = {
    "airspeed_mps": 0.1, "alpha_rad": 0.003, "theta_rad": 0.003, "q_radps": 0.006,
    "ax_mps2": 0.1, "az_mps2": 0.2,
}  # fmt: skip
TRUTH = (  # the last turns no calm air
    0.12, 4.1, 8.0, 0.5, 0.05, 0.09, 0.02, 0.01, -0.8, -1.0, -9.0, -1.0, 1.0,
)  # fmt: skip
START = (17.0, 0.1, 0.1, 0.0)
RESPOND = "--respond"


def shipped(name: str, **changed: object) -> NonlinearModel:
    """Return a model that is shipped, some sections changed."""
    text = files("host.sysid.models").joinpath("equations", name).read_text(encoding="utf-8")
    return equations_from({**parse_toml(text, name, IdentificationError), **changed})


def record(model: NonlinearModel) -> Maneuver:
    """Return a 3-2-1-1 at varying thrust, flown by the truth, with noise."""
    rng = np.random.default_rng(4)
    t = np.arange(SAMPLES) * DT_S
    u = np.zeros(SAMPLES)
    for begin, end, sign in ((0.6, 1.5, 1), (1.5, 2.1, -1), (2.1, 2.4, 1), (2.4, 2.7, -1)):
        u[(t >= begin) & (t < end)] = 0.05 * sign
    level: Array = np.zeros((SAMPLES, 3))
    inputs = np.column_stack([u, 2.5 + 0.5 * np.sin(t), level])
    noise = rng.standard_normal((SAMPLES, 6)) * list(NOISE.values())
    blank = Maneuver(DT_S, inputs, noise)
    outputs = output_problem(model, [blank]).outputs(np.array([*TRUTH, *START, 0.0, 0.0, 0.0]))
    assert outputs is not None
    return Maneuver(DT_S, inputs, outputs[0].T + noise)


def by_hand(theta: Array, inputs: Array) -> Array:
    """Return the outputs, (samples, 6), as numpy and scipy compute them."""
    m, iyy, area, chord, rho, g, ref = 1.943, 0.0722, 0.32, 0.25, 1.225, GRAVITY_MPS2, 0.1
    CL_0, CL_alpha, CL_q, CL_de, CD_0, induced, CD_de = theta[:7]
    Cm_0, Cm_alpha, Cm_alpha2, Cm_q, Cm_de = theta[7:12]
    t = np.arange(len(inputs)) * DT_S

    def coefficients(V: Array, alpha: Array, q: Array, de: Array) -> tuple[Array, ...]:
        qhat = q * chord / (2.0 * V)
        steady = CL_0 + CL_alpha * alpha + CL_de * de
        CD = CD_0 + induced * steady**2 + CD_de * de
        Cm = Cm_0 + Cm_alpha * alpha + Cm_alpha2 * (alpha - ref) ** 2 + Cm_q * qhat + Cm_de * de
        return steady + CL_q * qhat, CD, Cm, 0.5 * rho * V**2 * area

    def rates(time_s: float, x: Array) -> Array:
        V, alpha, attitude, q = x
        de, thrust = (np.asarray(np.interp(time_s, t, u)) for u in inputs.T[:2])
        CL, CD, Cm, q_ms = coefficients(V, alpha, q, de)
        climb = attitude - alpha
        return np.array(
            [
                (thrust * np.cos(alpha) - q_ms * CD) / m - g * np.sin(climb),
                q - (thrust * np.sin(alpha) + q_ms * CL) / (m * V) + g * np.cos(climb) / V,
                q,
                q_ms * chord * Cm / iyy,
            ]
        )

    found = integrate.solve_ivp(
        rates, (0.0, t[-1]), theta[13:17], t_eval=t, max_step=DT_S, rtol=1e-10, atol=1e-12
    )
    V, alpha, attitude, q = found.y
    CL, CD, _, q_ms = coefficients(V, alpha, q, inputs[:, 0])
    ax = (inputs[:, 1] - q_ms * (CD * np.cos(alpha) - CL * np.sin(alpha))) / m
    az = -q_ms * (CD * np.sin(alpha) + CL * np.cos(alpha)) / m
    bias_q, bias_x, bias_z = theta[17:]
    return np.column_stack([V, alpha, attitude, q + bias_q, ax + bias_x, az + bias_z])


def six_degrees_s() -> tuple[float, float, float, bool]:
    """Return processor times of the responses in two processes, what the first said that
    compiling takes, and whether the second said nothing."""
    spent, said = [], []
    with tempfile.TemporaryDirectory() as cache:
        for _ in range(2):
            ended = subprocess.run(
                [sys.executable, __file__, RESPOND],
                env={**os.environ, "NUMBA_CACHE_DIR": cache},
                capture_output=True,
                text=True,
                check=True,
            )
            spent.append(float(ended.stdout))
            said.append(sum(map(float, re.findall(r"about (\d+) s", ended.stderr))))
    return spent[0], spent[1], said[0], said[1] == 0.0


def respond() -> int:
    """Print the processor time of responses and slopes of six degrees of freedom."""
    model = shipped("six_degrees.toml")
    typical = {"airspeed_mps": 17.0, "alpha_rad": 0.1, "theta_rad": 0.1, "az_mps2": -GRAVITY_MPS2}
    level = [typical.get(name, 0.0) for name in model.outputs]
    rng = np.random.default_rng(1)
    outputs = level + 0.01 * rng.standard_normal((20, len(level)))
    inputs = np.tile([0.0, 0.0, 0.0, 3.0], (20, 1))
    problem = output_problem(model, [Maneuver(DT_S, inputs, outputs)])
    begin = time.process_time()
    found = problem.respond(problem.first_guess())
    print(time.process_time() - begin)
    return int(found is None)


def main() -> int:
    """Print the table; return how many limits were missed."""
    begin = time.perf_counter()
    model = shipped("longitudinal.toml", noise=NOISE, delays=[])
    data = record(model)
    fit("output-error-white", model, [data])
    compiled_s = time.perf_counter() - begin
    begin = time.process_time()
    ours = fit("output-error-white", model, [data])
    ours_s = time.process_time() - begin
    problem = output_problem(model, [data])
    with_prior = np.flatnonzero(problem.prior_precision)
    root = np.sqrt(problem.prior_precision[with_prior])
    deviation = np.array(list(NOISE.values()))

    first, bound = problem.first_guess(), np.sqrt(np.diag(ours.covariance_white))

    def residual(z: Array) -> Array:
        theta = first + bound * z  # the peer is given how large a parameter's step should be
        left = (by_hand(theta, data.inputs) - data.outputs) / deviation
        return np.concatenate([left.ravel(), root * (theta - problem.prior_mean)[with_prior]])

    def slopes(z: Array) -> Array:
        here = residual(z)
        return np.column_stack([(residual(z + h) - here) / STEP for h in STEP * np.eye(len(z))])

    begin = time.process_time()
    peer = optimize.least_squares(residual, np.zeros(len(first)), jac=slopes, method="lm")
    peer_s = time.process_time() - begin
    away = float(np.max(np.abs((first - ours.estimate) / bound + peer.x)))
    ratio = peer_s / ours_s
    print(f"a user's equations, longitudinal, {len(ours.names)} unknowns, {SAMPLES} samples")
    print(
        f"  ours                {1e3 * ours_s:8.1f} ms   (first call, compiled: {compiled_s:.1f} s)"
    )
    print(
        f"  numpy and solve_ivp {1e3 * peer_s:8.1f} ms   {ratio:.0f} times"
        f" (limit {LEAST_RATIO:.0f})"
    )
    print(f"  answers differ by   {away:8.4f} Cramer-Rao bounds at most (limit {MOST_BOUNDS})")
    first_s, next_s, said_s, silent = six_degrees_s()
    one_s = unit_s()
    print(
        f"six degrees of freedom: a first run compiles in {first_s:.1f} s, {first_s / one_s:.0f}"
        f" units (limit {MOST_COMPILED:.0f}), says {said_s:.0f} s (limit: a factor of"
        f" {MOST_OFF:.0f}); the next takes {next_s:.1f} s, {next_s / one_s:.1f} units (limit"
        f" {MOST_KEPT:.0f})"
        f"{'' if silent else ' AND SAYS SO AGAIN'}"
    )
    missed = (
        ratio < LEAST_RATIO, away > MOST_BOUNDS, first_s > MOST_COMPILED * one_s,
        next_s > MOST_KEPT * one_s,
        not silent, not 1.0 / MOST_OFF <= said_s / first_s <= MOST_OFF,
    )  # fmt: skip
    return sum(missed)


if __name__ == "__main__":
    sys.exit(respond() if RESPOND in sys.argv else main())

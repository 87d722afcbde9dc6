"""The original program: every rho of a list is tried, coordinate by coordinate."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from host.arrays import Array
from host.sysid.models import LinearModel, Maneuver
from host.sysid.numerics import discretise
from host.sysid.numerics.recursion import simulate
from host.thesis.error_figures import thesis_program_error_percent
from host.thesis.network_run import NetworkRun

SWEEPS = 50
LINE_SEARCH_LAMBDA = 1e-5  # of the original program
# r1, r2, r3 of the original program: -200:50.1:200, -.1:.0313:.1, -4:1.40123:4
RHO_LIST = np.concatenate(
    [
        np.arange(-200.0, 200.0, 50.1),
        np.arange(-0.1, 0.1, 0.0313),
        np.arange(-4.0, 4.0, 1.40123),
    ]
)


def line_search(
    model: LinearModel,
    maneuvers: Sequence[Maneuver],
    names: tuple[str, ...],
    W: Array,
    b: Array,
    start: Array,
    *,
    sweeps: int,
    gains: Array | None = None,
    rho_list: Array = RHO_LIST,
) -> NetworkRun:
    """Run the original program: per coordinate, try every rho for one step, keep the best.

    Parameters
    ----------
    model, maneuvers
        The simulation whose error decides: the program's own figure, the mean over the maneuvers.
    names, W, b
        Names and matrices of `network`.
    start : Array
        Start; the program was started from its own earlier answer.
    sweeps : int
        Passes over all coordinates.
    gains : Array, optional
        The hand-tuned lambda per parameter; 1e-5 for all without, as in the program.
    rho_list : Array
        Candidates, of both signs: the sign of the step is searched for too.
    """
    steps = np.full(len(names), LINE_SEARCH_LAMBDA) if gains is None else gains
    beta = np.array(start, dtype=np.float64)
    best = _program_error(model, maneuvers, names, beta)
    history, errors = [beta], [best]
    for _ in range(sweeps):
        before = best
        for i in range(len(beta)):
            v = W[i] @ beta + b[i]
            kept = beta[i]
            for rho in rho_list:
                trial = beta.copy()
                trial[i] = kept + steps[i] * (rho**2 - kept**2) / (2.0 * rho) * v
                error = _program_error(model, maneuvers, names, trial)
                if error < best:
                    best, beta = error, trial
        if best == before:
            break
        history.append(beta)
        errors.append(best)
    done = np.arange(len(history), dtype=np.float64)
    return NetworkRun(done, np.array(history), np.array(errors))


def free_run(
    model: LinearModel, maneuver: Maneuver, beta: Array, rate_bias: Array | None = None
) -> Array | None:
    """Return the states (samples, n) from the first measured ones on, as the program simulates.

    None if they diverge. The program has no biases; a model with them gives them, (n,).
    """
    n, m = len(model.states), len(model.inputs)
    A, B, _, _ = model.matrices(beta)
    AB = np.zeros((n, n + m + 1))
    AB[:, :n], AB[:, n : n + m] = A, B
    if rate_bias is not None:
        AB[:, -1] = rate_bias
    none = np.zeros(0, dtype=np.int64)
    step, _ = discretise(AB, n, m, False, maneuver.dt_s, none, none, none, np.zeros(0), 0)
    drive = np.hstack([maneuver.inputs, np.ones((maneuver.samples, 1))])
    first = maneuver.outputs[0, model.measured_states()].copy()
    finite, z = simulate(step, drive, first)
    return np.ascontiguousarray(z[:, :n]) if finite else None


def _program_error(
    model: LinearModel, maneuvers: Sequence[Maneuver], names: tuple[str, ...], beta: Array
) -> float:
    value, errors = dict(zip(names, beta.tolist(), strict=True)), []
    for number, maneuver in enumerate(maneuvers, start=1):
        bias = np.array([value.get(f"bias_rate.{s}@{number}", 0.0) for s in model.states])
        simulated = free_run(model, maneuver, beta, bias)
        if simulated is None:
            return float("inf")
        measured = maneuver.outputs[:, model.measured_states()]
        errors.append(thesis_program_error_percent(measured, simulated))
    return float(np.mean(errors))

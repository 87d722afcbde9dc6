"""The Hopfield network of the thesis as printed and as programmed, and a preconditioned form.

Three forms of gradient descent on the normal equations W beta + b = 0, W = -sum z z',
b = +sum xdot z' (the thesis's equation 3.11; its program has both signs negative, so that its fixed
point is minus least squares, and its search over rho of both signs repairs that):

- ``printed``: all neurons at once, v = W beta + b, beta += dt lambda (rho^2 - beta^2)/(2 rho) v;
- ``line-search``: the original program: one coordinate after another, every rho of a list tried for
  one step, the rho of the least simulation error kept;
- ``whitened``: the printed iteration after a Cholesky change of variables that gives every
  direction the same curvature; converges in some tens of iterations instead of billions.

None of them can beat equation error: their fixed point is its least-squares solution.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from host.arrays import Array
from host.compiled import compiled
from host.sysid.estimators.equation_error import fit_equation_error
from host.sysid.estimators.regression import normal_equations, regression_equations
from host.sysid.identification_error import IdentificationError
from host.sysid.models.diagnostics import thesis_program_error_percent
from host.sysid.models.fit_result import FitResult
from host.sysid.models.maneuver import Maneuver
from host.sysid.models.state_space_model import LinearModel
from host.sysid.numerics.discretisation import discretise
from host.sysid.numerics.recursion import simulate

LAMBDA = 0.001  # thesis, section 3.2.3
RHO = 200.0
STEP_S = 0.00025
ITERATIONS = 200_000

# r1, r2, r3 of the original program: -200:50.1:200, -.1:.0313:.1, -4:1.40123:4
RHO_LIST = np.concatenate(
    [
        np.arange(-200.0, 200.0, 50.1),
        np.arange(-0.1, 0.1, 0.0313),
        np.arange(-4.0, 4.0, 1.40123),
    ]
)


@compiled
def iterate(
    W: Array, b: Array, start: Array, gain: float, rho: float, iterations: int, limit: float
) -> tuple[Array, int]:
    """Run the printed iteration (thesis, equations 3.11 and 3.17); `gain` is dt times lambda.

    v = W beta + b, then beta += gain (rho^2 - beta^2) / (2 rho) v, all neurons at once.

    Returns the state and the number of iterations done; fewer than asked for when it diverged.
    """
    n = len(start)
    beta = start.copy()
    v = np.zeros(n)
    for k in range(iterations):
        for i in range(n):
            total = b[i]
            for j in range(n):
                total += W[i, j] * beta[j]
            v[i] = total
        for i in range(n):
            beta[i] += gain * (rho * rho - beta[i] * beta[i]) / (2.0 * rho) * v[i]
            if not (abs(beta[i]) < limit):
                return beta, k
    return beta, iterations


@compiled
def iterate_until(
    W: Array, b: Array, start: Array, gain: float, rho: float, goal: Array, share: float, most: int
) -> tuple[Array, int]:
    """Run the printed iteration until the norm of beta - goal is below `share` of goal's norm."""
    n = len(start)
    beta = start.copy()
    v = np.zeros(n)
    size = 0.0
    for i in range(n):
        size += goal[i] * goal[i]
    for k in range(most):
        for i in range(n):
            total = b[i]
            for j in range(n):
                total += W[i, j] * beta[j]
            v[i] = total
        miss = 0.0
        for i in range(n):
            beta[i] += gain * (rho * rho - beta[i] * beta[i]) / (2.0 * rho) * v[i]
            miss += (beta[i] - goal[i]) ** 2
        if miss < share * share * size:
            return beta, k + 1
        if not (miss < 1e300):
            return beta, -k - 1
    return beta, most


def network(
    model: LinearModel, maneuvers: Sequence[Maneuver], *, bandwidth: float | None = None
) -> tuple[tuple[str, ...], Array, Array]:
    """Return parameter names, W and b of the network for a model (thesis, equation 3.11).

    W = -sum z z' and b = +sum xdot z': their fixed point solves the normal equations.

    Parameters
    ----------
    model, maneuvers, bandwidth
        See `regression_equations`.
    """
    names, rows = regression_equations(model, maneuvers, bandwidth=bandwidth)
    normal, right = normal_equations(rows, len(names))
    return names, -normal, right


def largest_stable_gain(W: Array, rho: float = RHO) -> float:
    """Return the dt times lambda above which the iteration diverges.

    About a solution small against rho the step matrix is I + gain rho/2 W.
    """
    return 2.0 / (0.5 * rho * float(-np.linalg.eigvalsh(W)[0]))


def fit_hopfield(
    model: LinearModel,
    maneuvers: Sequence[Maneuver],
    *,
    variant: str = "printed",
    iterations: int | None = None,
    gain: float | None = None,
    rho: float = RHO,
    start: Array | None = None,
    bandwidth: float | None = None,
) -> FitResult:
    """Fit by a Hopfield network.

    Parameters
    ----------
    model, maneuvers
        Model and data; every state must be measured.
    variant : str
        ``printed``, ``line-search`` or ``whitened``.
    iterations : int, optional
        200 000 (printed), 50 sweeps (line search), 200 (whitened) without.
    gain : float, optional
        dt times lambda; 0.9 of the largest stable one without (printed). The thesis's own
        0.001 * 0.00025 diverges on its own example at 100 Hz.
    rho : float
        Limit of the sigmoid; parameters must stay below it.
    start : Array, optional
        Start; the model's start values without.
    bandwidth : float, optional
        Of the differentiation, Hz.

    Raises
    ------
    IdentificationError
        If the iteration diverges.
    """
    names, W, b = network(model, maneuvers, bandwidth=bandwidth)
    beta: Array = np.zeros(len(names))
    beta[: len(model.parameters)] = model.start
    if start is not None:
        beta = np.array(start, dtype=np.float64)
    if variant == "printed":
        steps = ITERATIONS if iterations is None else iterations
        step = 0.9 * largest_stable_gain(W, rho) if gain is None else gain
        beta, done = iterate(W, b, beta, step, rho, steps, 1e3 * rho)
        if done < steps:
            raise IdentificationError(
                f"the Hopfield iteration diverged after {done} steps: dt*lambda {step:.3g} is above"
                f" the stable {largest_stable_gain(W, rho):.3g}"
            )
    elif variant == "whitened":
        steps = 200 if iterations is None else iterations
        beta, done = _whitened(W, b, beta, steps)
    elif variant == "line-search":
        done = 50 if iterations is None else iterations
        beta = line_search(model, maneuvers[0], names, W, b, beta, sweeps=done)
    else:
        raise IdentificationError(
            f"Hopfield '{variant}' unknown; use printed, line-search or whitened"
        )
    reference = fit_equation_error(model, maneuvers, bandwidth=bandwidth)
    distance = float(np.linalg.norm(beta - reference.estimate) / np.linalg.norm(reference.estimate))
    warnings: tuple[str, ...] = ()
    if distance > 0.01:
        warnings = (
            f"stopped {100.0 * distance:.2g} % (norm) away from its own fixed point, the"
            " least-squares solution; its intervals mean nothing",
        )
    return FitResult(
        method=f"Hopfield ({variant})",
        model=model,
        names=names,
        estimate=beta,
        covariance=reference.covariance,
        covariance_white=reference.covariance_white,
        degrees_of_freedom=reference.degrees_of_freedom,
        residuals=reference.residuals,
        fitted=reference.fitted,
        residual_kind="rate",
        noise_covariance=reference.noise_covariance,
        iterations=done,
        converged=distance <= 0.01,
        warnings=warnings,
        details={"distance_to_fixed_point": distance},
    )


def _whitened(W: Array, b: Array, start: Array, iterations: int) -> tuple[Array, int]:
    """Run the printed iteration in coordinates L' beta with -W = L L', where W becomes -I."""
    scale = np.sqrt(-np.diag(W))
    if np.any(scale == 0.0):
        raise IdentificationError("a parameter has no regressor: its state or input never moved")
    try:
        lower = np.linalg.cholesky(-W / np.outer(scale, scale))
    except np.linalg.LinAlgError as error:
        raise IdentificationError("collinear regressors: the network has a flat valley") from error
    right = np.linalg.solve(lower, b / scale)
    rho = 10.0 * max(1.0, float(np.max(np.abs(right))))
    inside = np.ascontiguousarray(lower.T @ (scale * start))
    # gain * rho / 2 = 0.8: each step removes four fifths of the remaining way
    beta, done = iterate(-np.eye(len(b)), right, inside, 1.6 / rho, rho, iterations, 1e3 * rho)
    return np.linalg.solve(lower.T, beta) / scale, done


def line_search(
    model: LinearModel,
    maneuver: Maneuver,
    names: tuple[str, ...],
    W: Array,
    b: Array,
    start: Array,
    *,
    sweeps: int,
    gains: Array | None = None,
    rho_list: Array = RHO_LIST,
) -> Array:
    """Run the original program: per coordinate, try every rho for one step, keep the best.

    Parameters
    ----------
    model, maneuver
        The simulation whose error decides (the program's own figure).
    names, W, b
        Of `network`.
    start : Array
        Start; the program was started from its own earlier answer.
    sweeps : int
        Passes over all coordinates.
    gains : Array, optional
        The hand-tuned lambda per parameter; 1e-5 for all without, as in the program.
    rho_list : Array
        Candidates, of both signs: the sign of the step is searched for too.
    """
    steps = np.full(len(names), 1e-5) if gains is None else gains
    beta = np.array(start, dtype=np.float64)
    best = _program_error(model, maneuver, beta)
    for _ in range(sweeps):
        before = best
        for i in range(len(beta)):
            v = W[i] @ beta + b[i]
            kept = beta[i]
            for rho in rho_list:
                trial = beta.copy()
                trial[i] = kept + steps[i] * (rho**2 - kept**2) / (2.0 * rho) * v
                error = _program_error(model, maneuver, trial)
                if error < best:
                    best, beta = error, trial
        if best == before:
            break
    return beta


def free_run(model: LinearModel, maneuver: Maneuver, beta: Array) -> Array | None:
    """Return the states (samples, n) from the first measured ones on, as the program simulates.

    None if they diverge.
    """
    n, m = len(model.states), len(model.inputs)
    A, B, _, _ = model.matrices(beta)
    AB = np.zeros((n, n + m + 1))
    AB[:, :n], AB[:, n : n + m] = A, B
    none = np.zeros(0, dtype=np.int64)
    step, _ = discretise(AB, n, m, False, maneuver.dt_s, none, none, none, np.zeros(0), 0)
    drive = np.hstack([maneuver.inputs, np.ones((maneuver.samples, 1))])
    first = maneuver.outputs[0, model.measured_states()].copy()
    finite, z = simulate(step, drive, first)
    return np.ascontiguousarray(z[:, :n]) if finite else None


def _program_error(model: LinearModel, maneuver: Maneuver, beta: Array) -> float:
    simulated = free_run(model, maneuver, beta)
    if simulated is None:
        return float("inf")
    measured = maneuver.outputs[:, model.measured_states()]
    return thesis_program_error_percent(measured, simulated)

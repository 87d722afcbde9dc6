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
from host.errors import IdentificationError
from host.sysid.estimators import fit_equation_error, regression_equations
from host.sysid.estimators.regression import normal_equations
from host.sysid.models import FitResult, LinearModel, Maneuver
from host.thesis.network_run import NetworkRun
from host.thesis.original_program import RHO_LIST, SWEEPS, line_search

LAMBDA = 0.001  # thesis, section 3.2.3
RHO = 200.0
STEP_S = 0.00025
ITERATIONS = 200_000
RECORDED = 100  # points of the history of the printed iteration


@compiled
def iterate(
    W: Array, b: Array, start: Array, gain: float, rho: float, iterations: int, limit: float
) -> tuple[Array, int]:
    """Run the printed iteration (EQUATIONS.md, eq. 22); `gain` is dt times lambda.

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
    lambda_: float | None = None,
    rho: float | Array | None = None,
    start: Array | str | None = None,
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
        dt times lambda (printed); 0.9 of the largest stable one without. The thesis's own
        0.001 * 0.00025 diverges on its own example at 100 Hz.
    lambda_ : float, optional
        Printed: lambda of a step of 0.00025 s, in place of `gain`. Line search: of every parameter,
        1e-5 without, as in the program.
    rho : float or Array, optional
        Printed: limit of the sigmoid, 200 without; parameters must stay below it. Line search:
        candidates, those of the program without.
    start : Array or str, optional
        ``least-squares``, ``model`` (its start values), ``zero``, or values. The line search starts
        from least squares without, as the study of the thesis's flights does; others from the
        model's start values.
    bandwidth : float, optional
        Bandwidth of the differentiation, Hz.

    Returns
    -------
    FitResult
        Its details have `history` (points, parameters), and `history_step` (points,); of the line
        search `history_error_percent`, the figure that the program prints.

    Raises
    ------
    IdentificationError
        If the iteration diverges.
    """
    names, W, b = network(model, maneuvers, bandwidth=bandwidth)
    reference = fit_equation_error(model, maneuvers, bandwidth=bandwidth)
    if start is None:
        start = "least-squares" if variant == "line-search" else "model"
    beta = _start(model, names, start, reference)
    if variant == "printed":
        run = _printed(W, b, beta, gain, lambda_, rho, iterations or ITERATIONS)
    elif variant == "whitened":
        run = _whitened(W, b, beta, iterations or 200)
    elif variant == "line-search":
        run = line_search(
            model,
            maneuvers,
            names,
            W,
            b,
            beta,
            sweeps=iterations or SWEEPS,
            gains=None if lambda_ is None else np.full(len(names), lambda_),
            rho_list=RHO_LIST if rho is None else np.atleast_1d(np.asarray(rho, dtype=np.float64)),
        )
    else:
        raise IdentificationError(
            f"Hopfield '{variant}' unknown; use printed, line-search or whitened"
        )
    beta = run.estimate
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
        iterations=int(run.step[-1]),
        converged=distance <= 0.01,
        warnings=warnings,
        details={
            "distance_to_fixed_point": distance,
            "history": run.history,
            "history_step": run.step,
            **({"history_error_percent": run.error_percent} if len(run.error_percent) else {}),
        },
    )


def _start(
    model: LinearModel, names: tuple[str, ...], start: Array | str, reference: FitResult
) -> Array:
    """Return the first values of all parameters and biases."""
    if not isinstance(start, str):
        return np.array(start, dtype=np.float64)
    beta: Array = np.zeros(len(names))
    if start == "least-squares":
        beta = reference.estimate.copy()
    elif start == "model":
        beta[: len(model.parameters)] = model.start
    return beta


def _printed(
    W: Array,
    b: Array,
    start: Array,
    gain: float | None,
    lambda_: float | None,
    rho: float | Array | None,
    iterations: int,
) -> NetworkRun:
    """Run the printed iteration; the state is noted about a hundred times."""
    if rho is not None and np.size(rho) > 1:
        raise IdentificationError("the printed network has one rho, only the line search several")
    limit = RHO if rho is None else float(np.ravel(rho)[0])
    stable = largest_stable_gain(W, limit)
    step = 0.9 * stable if gain is None else gain
    if lambda_ is not None:
        step = lambda_ * STEP_S
    beta, done, at, history = start, 0, [0], [start]
    while done < iterations:
        part = min(max(1, iterations // RECORDED), iterations - done)
        beta, ran = iterate(W, b, beta, step, limit, part, 1e3 * abs(limit))
        done += ran
        if ran < part:
            raise IdentificationError(
                f"the Hopfield iteration diverged after {done} steps: dt*lambda {step:.3g} is above"
                f" the stable {stable:.3g}"
            )
        at.append(done)
        history.append(beta)
    return NetworkRun(np.array(at, dtype=np.float64), np.array(history))


def _whitened(W: Array, b: Array, start: Array, iterations: int) -> NetworkRun:
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
    history = [inside]
    for _ in range(iterations):
        beta, done = iterate(-np.eye(len(b)), right, history[-1], 1.6 / rho, rho, 1, 1e3 * rho)
        if done < 1:
            break
        history.append(beta)
    back = np.linalg.solve(lower.T, np.array(history).T).T / scale
    return NetworkRun(np.arange(len(history), dtype=np.float64), back)

"""Joint estimation of states and parameters of a user's equations by an extended Kalman filter."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from host.arrays import Array, BoolArray, IntArray
from host.sysid.estimators.kalman import (
    INITIAL_RELATIVE_SD,
    PASSES,
    PROCESS_SHARE,
    change_by_priors,
    filter_result,
    filtered,
    measured_spread,
    own_constants,
)
from host.sysid.models.fit_result import FitResult
from host.sysid.models.maneuver import Maneuver
from host.sysid.models.nonlinear_model import NonlinearModel
from host.sysid.models.state_space_model import Parameter
from host.sysid.numerics.equation_filter import EquationModel, filter_equations
from host.sysid.numerics.nonlinear_problem import NonlinearProblem
from host.sysid.numerics.white_noise import noise_deviation

# More where parameters still move: a servo of 60 rad/s guessed at 12 stood 25 to 44 % low after two
# passes, known to 10 to 16, and a stiffness of its equation 9 to 23 %.
MOST_PASSES = 30
SETTLED_SD = 0.1  # of an interval's deviation: a pass that moves parameters by less is the last
UNMEASURED_SD = 0.1  # of an initial state without an output: this and as large a share of it


def fit_extended_equations(
    model: NonlinearModel,
    maneuvers: Sequence[Maneuver],
    *,
    process: Array | None = None,
    noise: Array | None = None,
) -> FitResult:
    """Fit by an extended Kalman filter, its state augmented by all unknowns.

    Common parameters and delays go on from maneuver to maneuver, what belongs to a record starts
    anew in each. A late input is read anew at every sample, as late as is known by then. First
    deviations are those of the priors, which count once, else half of where a pass starts; passes
    go on until parameters stay. Bounds hold at every sample (Jategaonkar, Flight Vehicle System
    Identification, 2nd ed., ch. 7).

    Parameters
    ----------
    model, maneuvers
        Model and data.
    process : Array, optional
        Process noise of each state, per root second, (n,).
    noise : Array, optional
        Deviation of each output, (p,); by default from third differences.

    Raises
    ------
    IdentificationError
        If the filter diverges.
    """
    layout = _layout(model)
    n, common = len(model.states), layout.common
    problem = NonlinearProblem(model, maneuvers)
    guess = problem.first_guess()
    problem.check_start(guess)
    deviation = noise_deviation(maneuvers) if noise is None else np.asarray(noise)
    spread = np.array([measured_spread(model, maneuvers[0], s, 0.0) for s in model.states])
    intensity = (PROCESS_SHARE * spread if process is None else np.asarray(process)) ** 2
    shared = began = guess[:common]
    residuals: list[Array] = []
    white: list[Array] = []
    z, P = np.zeros(0), np.zeros((0, 0))
    known = np.zeros((common, common))
    for taken in range(MOST_PASSES):
        if taken >= PASSES and _settled(shared - began, known):
            break
        # Data must not be counted twice. What no prior tells is half of where this pass starts.
        wide = np.where(layout.guessed[:common], INITIAL_RELATIVE_SD * np.abs(shared), 0.0)
        began, known = shared, np.diag(np.maximum(layout.sd[:common], wide) ** 2)
        problem.refine_step(np.concatenate([shared, guess[common:]]))
        residuals, white = [], []
        for number in range(len(maneuvers)):
            z = np.concatenate([np.zeros(n), shared, layout.start[common:]])
            P = np.diag(np.concatenate([np.zeros(n), layout.sd]) ** 2)
            P[n : n + common, n : n + common] = known
            given = problem.given(number, guess)
            z[:n] = given.start
            for k, state in enumerate(model.states):
                own = state in model.outputs
                P[k, k] = (
                    (3.0 * deviation[model.outputs.index(state)]) ** 2
                    if own
                    else (UNMEASURED_SD * (1.0 + abs(given.start[k]))) ** 2
                )
                if state in dict(model.known_starts):
                    P[k, k] = 0.0
            e, unit = _passed(problem, number, layout, z, P, intensity, deviation**2)
            shared, known = z[n : n + common], P[n : n + common, n : n + common].copy()
            residuals.append(e)
            white.append(unit)
    estimate = z[n:] + change_by_priors(model, P[n:, n : n + common], began)
    estimate = np.clip(estimate, layout.lower, layout.upper)
    theta = guess.copy()
    theta[:common] = estimate[:common]
    return filter_result(
        "extended Kalman filter",
        (problem.model_at(theta), layout.names, estimate, P[n:, n:]),
        maneuvers,
        (residuals, white),
        {"noise_deviation": deviation, "process": np.sqrt(intensity)},
    )


def _settled(moved: Array, covariance: Array) -> bool:
    """Return whether a pass moved no parameter by more than a little of its deviation."""
    return bool(np.all(np.abs(moved) <= SETTLED_SD * np.sqrt(np.abs(np.diag(covariance)))))


@dataclass(frozen=True)
class _Layout:
    """Layout of the unknowns behind the states, and their prior.

    `common` of them go on from maneuver to maneuver.
    """

    names: tuple[str, ...]
    common: int
    start: Array
    sd: Array
    guessed: BoolArray  # by its start value alone
    lower: Array
    upper: Array
    column: IntArray
    bias: IntArray
    offset: IntArray
    delay: IntArray
    input_delay: IntArray


def _layout(model: NonlinearModel) -> _Layout:
    n, usual = len(model.states), _usual_deviations((*model.parameters, *model.own_parameters))
    count, delays = len(model.parameters), len(model.delays)
    biases = len(model.state_biases) + len(model.output_biases)
    names = (
        *model.parameter_names,
        *own_constants(model),
        *(p.name for p in model.own_parameters),
    )
    place = {name: n + k for k, name in enumerate(names)}
    late = {y: place[d.name] for d in model.delays for y in d.outputs}
    limits = np.array([d.limit_s for d in model.delays])
    own = model.own_parameters
    free = np.full(biases, np.inf)

    def at(names_: Sequence[str], prefix: str = "") -> IntArray:
        return np.array([place.get(f"{prefix}{x}", -1) for x in names_], dtype=np.int64)

    return _Layout(
        names=names,
        common=count + delays,
        start=np.array(
            [*model.start, *np.zeros(delays + biases), *(p.start for p in own)], dtype=np.float64
        ),
        sd=np.array(
            [*usual[:count], *(d.prior_sd_s for d in model.delays), *np.ones(biases),
             *usual[count:]]
        ),
        guessed=np.array(
            [*(not np.isfinite(p.prior_sd) for p in model.parameters),
             *np.zeros(delays, dtype=bool)]
        ),
        lower=np.array([*(p.lower for p in model.parameters), *-limits, *-free,
                        *(p.lower for p in own)]),
        upper=np.array([*(p.upper for p in model.parameters), *limits, *free,
                        *(p.upper for p in own)]),
        column=np.append(at(model.source.parameters), -1),
        bias=at(model.states, "bias_rate."),
        offset=at(model.outputs, "bias."),
        delay=np.array([late.get(y, -1) for y in model.outputs], dtype=np.int64),
        input_delay=np.array([late.get(u, -1) for u in model.inputs], dtype=np.int64),
    )  # fmt: skip


def _usual_deviations(parameters: Sequence[Parameter]) -> list[float]:
    """Return each parameter's deviation beforehand: of its prior, else a share of its start."""
    largest = max((abs(p.start) for p in parameters), default=0.0)
    return [
        p.prior_sd
        if np.isfinite(p.prior_sd)
        else INITIAL_RELATIVE_SD * abs(p.start) + 1e-3 * largest
        for p in parameters
    ]


def _passed(
    problem: NonlinearProblem,
    number: int,
    layout: _Layout,
    z: Array,
    P: Array,
    intensity: Array,
    variance: Array,
) -> tuple[Array, Array]:
    """Filter one maneuver; `z` and `P` end behind its last sample."""
    maneuver, model = problem.maneuvers[number], problem.nonlinear
    given = problem.given(number, problem.first_guess())
    n, late = len(model.states), [int(k) for k in layout.delay]
    no_limit = np.full(n, np.inf)
    bounds = (
        np.concatenate([-no_limit, layout.lower]),
        np.concatenate([no_limit, layout.upper]),
    )
    equations = EquationModel(
        intensity=intensity,
        inputs=given.inputs,
        held=given.held,
        late=given.shift,
        p=given.p,
        column=layout.column,
        c=given.c,
        t=given.t,
        bias=np.zeros(n),
        bias_column=layout.bias,
        offset=np.zeros(len(late)),
        offset_column=layout.offset,
        delay_s=np.zeros(len(late)),
        delay_column=layout.delay,
        leader=np.array([late.index(k) for k in late], dtype=np.int64),
        input_column=layout.input_delay,
        dt_s=maneuver.dt_s,
        substeps=problem.substeps,
        ramp=problem.ramp,
    )
    return filtered(
        model.source.code.loop(filter_equations), equations, z, P, variance, maneuver, bounds
    )

"""Joint estimation of states and parameters by Kalman filters: the extended one."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from host.arrays import Array, BoolArray
from host.errors import IdentificationError
from host.sysid.estimators.start_values import start_values_of
from host.sysid.models.fit_result import FitResult
from host.sysid.models.maneuver import Maneuver
from host.sysid.models.state_space_model import LinearModel
from host.sysid.numerics.kalman_filter import filter_with, filter_without_slopes, predicted
from host.sysid.numerics.output_error_problem import check_shapes
from host.sysid.numerics.sampled_model import Sampler
from host.sysid.numerics.white_noise import noise_deviation

PASSES = 2  # over the record: the second starts from the parameters of the first
INITIAL_RELATIVE_SD = 0.5  # first standard deviation of a parameter, relative to its size
PROCESS_SHARE = 1e-4  # default process noise per root second, of the rms of a state
NEGLIGIBLE_CORRELATION = 0.05  # twice the deviation of a correlation over 1600 samples
REPORTED_INFLATION = 2.0  # from here on there is a warning


@dataclass(slots=True)
class JointFilter:
    """Parts that the filters share: model, noise, layout of the augmented state.

    Attributes
    ----------
    model : LinearModel
    R : Array, shape (p, p)
        Covariance of the outputs' noise.
    process : Array, shape (n,)
        Process noise of each state, per root second.
    names : tuple of str
        Parameters and biases.
    n_states : int
    """

    model: LinearModel
    R: Array
    process: Array
    names: tuple[str, ...]
    n_states: int

    def split(self, joint: Array) -> tuple[Array, Array, Array]:
        """Return states, common parameters and [rate biases, output biases]."""
        n, q = self.n_states, len(self.model.parameters)
        return joint[..., :n], joint[..., n : n + q], joint[..., n + q :]


FilterPass = Callable[[JointFilter, Maneuver, Array, Array], tuple[Array, Array, Array, Array]]


def fit_extended(
    model: LinearModel,
    maneuvers: Sequence[Maneuver],
    *,
    process: Array | None = None,
    noise: Array | None = None,
    start: Array | None = None,
) -> FitResult:
    """Fit by an extended Kalman filter; see `fit_jointly` for the parameters.

    The state is augmented by the parameters as constants; the filter is linearised with the exact
    derivatives of the discretised model (Jategaonkar, Flight Vehicle System Identification, 2nd
    ed., ch. 7).
    """
    return fit_jointly(
        "extended Kalman filter", _extended_pass, model, maneuvers, process, noise, start
    )


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
        total += max(2.0 * float(np.sum(moments[:end])) - float(moments[0]), 0.0)
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


def own_constants(model: LinearModel) -> list[str]:
    """Return the names of the constants that each record has of its own."""
    rates = [f"bias_rate.{s}" for s in model.state_biases]
    return rates + [f"bias.{y}" for y in model.output_biases]


def fit_jointly(
    name: str,
    filter_pass: FilterPass,
    model: LinearModel,
    maneuvers: Sequence[Maneuver],
    process: Array | None,
    noise: Array | None,
    start: Array | None,
) -> FitResult:
    """Fit states and parameters together by passes of a filter over the maneuvers.

    Parameters
    ----------
    name : str
        Name of the filter.
    filter_pass : callable
        Filters one maneuver: given the filter, the maneuver, joint state and covariance it returns
        both behind the last sample, and the innovations, in units and whitened, (samples, p).
    model, maneuvers
        Model and data; maneuvers are filtered one after another.
    process : Array, optional
        Process noise of each state, per root second, shape (n,).
    noise : Array, optional
        Standard deviation of each output, shape (p,); by default from third differences.
    start : Array, optional
        Common parameters; by default the mean of a prior, else from equation error.

    Raises
    ------
    IdentificationError
        If the model has delays or levers, or the filter diverges.
    """
    if model.delays or model.accelerometer_offsets:
        raise IdentificationError(
            "Kalman filters have no delays or levers: estimate those by output error"
        )
    for maneuver in maneuvers:
        check_shapes(model, maneuver)
    n, q = len(model.states), len(model.parameters)
    deviation = noise_deviation(maneuvers) if noise is None else np.asarray(noise)
    spread = np.array([measured_spread(model, maneuvers[0], s, 1.0) for s in model.states])
    intensity = PROCESS_SHARE * spread if process is None else np.asarray(process)
    names = (*(p.name for p in model.parameters), *own_constants(model))
    filter_ = JointFilter(model, np.diag(deviation**2), intensity, names, n)
    first = start_values_of(model, maneuvers)[:q] if start is None else np.array(start)
    size = n + len(names)
    joint: Array = np.zeros(size)
    P: Array = np.zeros((size, size))
    known = np.array([p.prior_sd for p in model.parameters])
    prior = np.isfinite(known)
    usual = INITIAL_RELATIVE_SD * np.abs(first) + 1e-3 * np.max(np.abs(first))
    spread_first = np.where(prior, known, usual)
    if start is None:
        first = np.where(prior, model.start, first)
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
            _begin_record(filter_, maneuver, spread, joint, P)
            joint, P, e, whitened = filter_pass(filter_, maneuver, joint, P)
            if not np.isfinite(joint).all():
                raise IdentificationError(
                    f"{maneuver.name}: the Kalman filter diverged; give better start values"
                )
            residuals.append(e)
            white.append(whitened)
    return filter_result(
        name,
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
        Innovations of each maneuver: in the units of the outputs and whitened, (samples, p).
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


def measured_spread(model: LinearModel, maneuver: Maneuver, state: str, unmeasured: float) -> float:
    """Return the deviation of a state over a maneuver where an output is that state."""
    if state not in model.outputs:
        return unmeasured
    return float(np.std(maneuver.outputs[:, model.outputs.index(state)]))


def _begin_record(
    filter_: JointFilter, maneuver: Maneuver, spread: Array, joint: Array, P: Array
) -> None:
    """Write states and biases before a maneuver's first sample, and their covariance."""
    model, n, deviation = filter_.model, filter_.n_states, np.sqrt(np.diag(filter_.R))
    biases = range(n + len(model.parameters), len(joint))
    for k in (*range(n), *biases):
        joint[k] = 0.0
        P[k, :] = P[:, k] = 0.0
    for k, state in enumerate(model.states):
        known = spread[k]
        if state in model.outputs:
            output = model.outputs.index(state)
            joint[k], known = maneuver.outputs[0, output], deviation[output]
        P[k, k] = (3.0 * known) ** 2
    for number, k in enumerate(biases):
        P[k, k] = _bias_variance(model, maneuver, number)


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


def filtered(
    run: Callable[..., bool],
    kind: object,
    joint: Array,
    P: Array,
    variance: Array,
    maneuver: Maneuver,
    bounds: tuple[Array, Array] | None = None,
) -> tuple[Array, Array]:
    """Filter one maneuver; return innovations, in units and whitened, (samples, p).

    The arguments are those of `filter_without_slopes`; `joint` and `P` end behind the last sample.

    Raises
    ------
    IdentificationError
        If the filter diverges.
    """
    found = filter_without_slopes(
        run, kind, joint, P, variance, maneuver.outputs, maneuver.seen, bounds=bounds
    )
    if found is None:
        raise IdentificationError(
            f"{maneuver.name}: the Kalman filter diverged; give better start values"
        )
    e, independent, deviation = found
    return e, independent / deviation


def _extended_pass(
    filter_: JointFilter, maneuver: Maneuver, joint: Array, P: Array
) -> tuple[Array, Array, Array, Array]:
    sampler = Sampler(replace(filter_.model, initial_states=()))
    power = np.zeros(len(joint))
    power[: filter_.n_states] = filter_.process**2 * maneuver.dt_s
    kind = _JointModel(sampler, sampler.drive(maneuver), maneuver.dt_s, power)
    e, white = filtered(_filter_joint, kind, joint, P, np.diag(filter_.R).copy(), maneuver)
    return joint, P, e, white


class _JointModel(NamedTuple):
    """A linear model over one sample, its parameters states: what the filter takes."""

    sampler: Sampler
    drive: Array
    dt_s: float
    power: Array  # of the process noise of a sample


def _joint_outputs(
    kind: _JointModel, k: int, seen: BoolArray, joint: Array, by_x: Array, y: Array, by_y: Array,
    H: Array, by_H: Array,
) -> None:  # fmt: skip
    n = len(kind.sampler.first)
    read, by_read = kind.sampler.reading(np.append(joint[n:], 0.0))
    z = np.concatenate([joint[:n], kind.drive[k]])
    y[:] = read @ z
    H[:, :n], H[:, n:] = read[:, :n], np.einsum("jcq,c->jq", by_read, z)


def _joint_step(
    kind: _JointModel, k: int, joint: Array, by_x: Array, P: Array, P_slopes: Array
) -> bool:
    n = len(kind.sampler.first)
    one = kind.sampler.at(np.append(joint[n:], 0.0), kind.dt_s)
    z = np.concatenate([joint[:n], kind.drive[k]])
    F = np.eye(len(joint))
    F[:n, :n], F[:n, n:] = one.step[:, :n], np.einsum("icq,c->iq", one.by_step, z)
    joint[:n] = one.step @ z
    P[:] = predicted(P, F, kind.power)
    return bool(np.isfinite(joint).all())


_filter_joint = filter_with(_joint_outputs, _joint_step)

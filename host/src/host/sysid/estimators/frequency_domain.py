"""Equation error and output error in the frequency domain, on chirp-z transforms of one band."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from host.arrays import Array
from host.errors import IdentificationError
from host.sysid.estimators.regression import solve_normal_equations
from host.sysid.estimators.start_values import start_values_of
from host.sysid.models.fit_result import FitResult
from host.sysid.models.maneuver import Maneuver
from host.sysid.models.state_space_model import LinearModel
from host.sysid.numerics.chirp_z import Spectrum, transform
from host.sysid.numerics.differentiation import signal_bandwidth_hz
from host.sysid.numerics.discretisation import discretise
from host.sysid.numerics.gauss_newton import Objective, gauss_newton
from host.sysid.numerics.information_inverse import covariance_from_information
from host.sysid.numerics.output_error_problem import check_shapes

MAX_ITERATIONS = 40
ROUNDS = 3  # of weights by equation


def band(
    maneuver: Maneuver,
    signals: Array,
    limits_hz: tuple[float, float] | None,
    *,
    intervals: int | None = None,
) -> Array:
    """Return harmonics of the record inside a band (Hz); by default that of the signals.

    Raises
    ------
    IdentificationError
        If fewer than four harmonics are inside.
    """
    spacing = 1.0 / ((intervals or maneuver.samples) * maneuver.dt_s)
    if limits_hz is None:
        limits_hz = (0.5 * spacing, signal_bandwidth_hz(signals, maneuver.dt_s))
    first = max(1, int(np.ceil(limits_hz[0] / spacing - 1e-9)))
    last = min(int(np.floor(limits_hz[1] / spacing + 1e-9)), maneuver.samples // 2 - 1)
    if last - first < 3:
        raise IdentificationError(
            f"{maneuver.name}: the band {limits_hz[0]:.3g} to {limits_hz[1]:.3g} Hz holds"
            f" {max(last - first + 1, 0)} harmonics of {spacing:.3g} Hz, at least 4 are needed"
        )
    return spacing * np.arange(first, last + 1)


def fit_frequency_equation_error(
    model: LinearModel,
    maneuvers: Sequence[Maneuver],
    *,
    limits_hz: tuple[float, float] | None = None,
) -> FitResult:
    """Fit by equation error in the frequency domain; no signal is differentiated.

    At harmonics of the record the transform of a rate is j w X + x(T) - x(0), and that of a bias is
    zero; the differences x(T) - x(0) are unknowns (Klein & Morelli, Aircraft System Identification,
    ch. 7).

    Parameters
    ----------
    model, maneuvers
        Model and data; every state must be measured.
    limits_hz : tuple of float, optional
        Band, Hz; by default from the data.
    """
    keys, X_rows, y_rows = _regressions(model, maneuvers, limits_hz)
    count, per = len(model.parameters), len(set(keys))
    used = np.flatnonzero(np.any([X.any(axis=0) for X in X_rows], axis=0))
    X_rows = [block[:, used] for block in X_rows]
    theta, information = _weighed_by_equation(keys, X_rows, y_rows)
    covariance = covariance_from_information(information)
    residuals = [y - X @ theta for X, y in zip(X_rows, y_rows, strict=True)]
    stacked = tuple(
        np.column_stack(residuals[k * per : (k + 1) * per]) for k in range(len(maneuvers))
    )
    fitted = tuple(
        np.column_stack(y_rows[k * per : (k + 1) * per]) - stacked[k] for k in range(len(maneuvers))
    )
    freedom = float(sum(len(y) for y in y_rows) - len(used))
    return FitResult(
        method="frequency equation error",
        model=model,
        names=model.parameter_names[:count],
        estimate=theta[:count],
        covariance=covariance[:count, :count],
        covariance_white=covariance[:count, :count],
        degrees_of_freedom=np.full(count, max(freedom, 1.0)),
        residuals=stacked,
        fitted=fitted,
        residual_kind="rate",
        noise_covariance=np.atleast_2d(np.cov(np.vstack(stacked).T)),
        iterations=ROUNDS,
        converged=True,
        details={"states": float(len(model.states))},
    )


def _regressions(
    model: LinearModel,
    maneuvers: Sequence[Maneuver],
    limits_hz: tuple[float, float] | None,
) -> tuple[list[int], list[Array], list[Array]]:
    """Return state, regressors and rate of each equation of each maneuver, real part above."""
    measured = model.measured_states()
    count = len(model.parameters)
    entries = model.entries("AB")
    fixed = np.hstack([model.A, model.B])
    active = sorted(set(entries.row.tolist()))
    size = count + len(active) * len(maneuvers)  # and x(T) - x(0) per equation and maneuver
    X_rows: list[Array] = []
    y_rows: list[Array] = []
    keys: list[int] = []
    for number, maneuver in enumerate(maneuvers):
        check_shapes(model, maneuver)
        states = maneuver.outputs[:, measured]
        f = band(maneuver, states, limits_hz, intervals=maneuver.samples - 1)
        inputs = maneuver.inputs
        if model.hold == "zoh":
            inputs = 0.5 * (inputs + np.vstack([inputs[:1], inputs[:-1]]))
        signals = np.hstack([states, inputs])
        signals[[0, -1]] *= 0.5  # trapezoidal rule: the sum is then the integral over the record
        z = maneuver.dt_s * transform(signals, maneuver.dt_s, f)
        s = 2j * np.pi * f
        for position, row in enumerate(active):
            X = np.zeros((len(f), size), dtype=np.complex128)
            for k in np.flatnonzero(entries.row == row):
                X[:, entries.parameter[k]] += entries.gain[k] * z[:, entries.column[k]]
            X[:, count + number * len(active) + position] = 1.0
            y = s * z[:, row] - z @ fixed[row]
            X_rows.append(np.vstack([X.real, X.imag]))
            y_rows.append(np.concatenate([y.real, y.imag]))
            keys.append(row)
    return keys, X_rows, y_rows


def _weighed_by_equation(
    keys: Sequence[int], X_rows: Sequence[Array], y_rows: Sequence[Array]
) -> tuple[Array, Array]:
    """Return the solution of equations, each weighed by what it leaves, and its information.

    `keys` says which blocks are of one equation.
    """
    weights = np.ones(len(keys))
    theta: Array = np.zeros(X_rows[0].shape[1])
    for _ in range(ROUNDS):
        right = sum(w * X.T @ y for w, X, y in zip(weights, X_rows, y_rows, strict=True))
        theta = solve_normal_equations(_information(weights, X_rows), np.asarray(right))
        power = {key: [0.0, 0.0] for key in keys}
        for key, block, y in zip(keys, X_rows, y_rows, strict=True):
            miss = y - block @ theta
            free = int(np.count_nonzero(block.any(axis=0)))
            power[key][0] += float(miss @ miss)
            power[key][1] += max(len(y) - free, 1)
        weights = np.array([power[key][1] / max(power[key][0], 1e-300) for key in keys])
    return theta, _information(weights, X_rows)


def _information(weights: Array, X_rows: Sequence[Array]) -> Array:
    """Return the sum of X'X, weighed."""
    return np.asarray(sum(w * X.T @ X for w, X in zip(weights, X_rows, strict=True)))


@dataclass(slots=True)
class _Record:
    """One maneuver in the frequency domain."""

    z: Spectrum  # e^(j w dt), (frequencies,)
    drive: Spectrum  # inputs, one and increments, (frequencies, w)
    y: Spectrum  # (frequencies, p)
    samples: int
    dt_s: float


def _record(
    model: LinearModel, maneuver: Maneuver, limits_hz: tuple[float, float] | None
) -> _Record:
    """Return the transforms of a maneuver in a band."""
    check_shapes(model, maneuver)
    f = band(maneuver, maneuver.outputs, limits_hz)
    columns = [maneuver.inputs, np.ones((maneuver.samples, 1))]
    if model.hold == "foh":
        columns.append(np.diff(maneuver.inputs, axis=0, append=maneuver.inputs[-1:]))
    return _Record(
        z=np.exp(2j * np.pi * f * maneuver.dt_s),
        drive=transform(np.hstack(columns), maneuver.dt_s, f),
        y=transform(maneuver.outputs, maneuver.dt_s, f),
        samples=maneuver.samples,
        dt_s=maneuver.dt_s,
    )


def fit_frequency_output_error(
    model: LinearModel,
    maneuvers: Sequence[Maneuver],
    *,
    limits_hz: tuple[float, float] | None = None,
    start: Array | None = None,
) -> FitResult:
    """Fit by output error in the frequency domain.

    The sampled system is (z - Phi) X = Gamma U + z (x0 - xN z^-N), which is exact for held inputs,
    ends of the record included (Klein & Morelli, Aircraft System Identification, ch. 7).

    Parameters
    ----------
    model, maneuvers
        Model and data; no residual delays.
    limits_hz : tuple of float, optional
        Band, Hz; by default from the data.
    start : Array, optional
        Common parameters; by default from equation error.
    """
    if model.delays or model.accelerometer_offsets:
        raise IdentificationError(
            "frequency output error has no delays or levers: use output-error"
        )
    n, count = len(model.states), len(model.parameters)
    records = [_record(model, maneuver, limits_hz) for maneuver in maneuvers]
    objective = _Spectra(model, records)
    theta = np.concatenate(
        [
            start_values_of(model, maneuvers)[:count] if start is None else np.array(start),
            np.zeros(n * len(records)),
        ]
    )
    found = gauss_newton(objective, theta, max_iterations=MAX_ITERATIONS)
    if found is None:
        raise IdentificationError(f"model {model.name}: no finite response at the start")
    information, _ = objective.normal(found.theta, found.trial)
    covariance = covariance_from_information(information)[:count, :count]
    residual_spectra = found.trial.residuals
    residuals = tuple(np.vstack([r.real, r.imag]) for r in residual_spectra)
    lines = 2 * sum(map(len, residual_spectra)) - count - n
    return FitResult(
        method="frequency output error",
        model=model,
        names=model.parameter_names[:count],
        estimate=found.theta[:count],
        covariance=covariance,
        covariance_white=covariance,
        degrees_of_freedom=np.full(count, float(max(lines, 1))),
        residuals=residuals,
        fitted=residuals,
        residual_kind="spectrum",
        noise_covariance=np.diag(found.trial.variance),
        iterations=found.iterations,
        converged=found.converged,
        warnings=() if found.converged else ("no convergence",),
        details={"noise_variance": found.trial.variance},
    )


@dataclass(slots=True)
class _Trial:
    """Residuals (frequencies, p) and sensitivities (frequencies, p, P) of each maneuver."""

    residuals: list[Spectrum]
    sensitivities: list[Spectrum]
    variance: Array
    cost: float


class _Spectra(Objective[_Trial]):
    """Cost of the output spectra.

    The unknowns are the model's parameters and, per maneuver, x0 - xN: at harmonics of the record
    only their difference appears.
    """

    def __init__(self, model: LinearModel, records: list[_Record]) -> None:
        self._model, self._records = model, records
        self._entries, self._outputs = model.entries("AB"), model.entries("CD")

    def evaluate(self, theta: Array) -> _Trial | None:
        model, n, count = self._model, len(self._model.states), len(self._model.parameters)
        A, B, C, D = model.matrices(theta[:count])
        AB = np.hstack([A, B, np.zeros((n, 1))])
        ends = theta[count:].reshape(-1, n)
        found = [
            self._one(record, AB, C, D, end)
            for record, end in zip(self._records, ends, strict=True)
        ]
        residuals, slopes = [r for r, _ in found], [J for _, J in found]
        points = sum(len(r) for r in residuals)
        variance = np.sum([np.sum(np.abs(r) ** 2, axis=0) for r in residuals], axis=0) / points
        cost = float(points * np.sum(np.log(np.maximum(variance, 1e-300))))
        return _Trial(residuals, slopes, variance, cost) if np.isfinite(cost) else None

    def _one(
        self, record: _Record, AB: Array, C: Array, D: Array, end: Array
    ) -> tuple[Spectrum, Spectrum]:
        model, entries, outputs = self._model, self._entries, self._outputs
        n, m, count = len(model.states), len(model.inputs), len(model.parameters)
        step, step_slopes = discretise(
            AB, n, m, model.hold == "foh", record.dt_s, entries.row, entries.column,
            entries.parameter, entries.gain, count,
        )  # fmt: skip
        inverse = np.linalg.inv(record.z[:, None, None] * np.eye(n) - step[:, :n])
        forcing = record.drive @ step[:, n:].T + record.z[:, None] * end
        X = np.einsum("fij,fj->fi", inverse, forcing)
        wide = np.hstack([X, record.drive])
        dX = np.zeros((len(record.z), n, count + n), dtype=np.complex128)
        dX[:, :, :count] = inverse @ np.einsum("ijq,fj->fiq", step_slopes, wide)
        dX[:, :, count:] = inverse * record.z[:, None, None]
        y = X @ C.T + record.drive[:, :m] @ D.T
        J = np.einsum("ji,fiq->fjq", C, dX)
        for k in range(len(outputs.row)):
            J[:, outputs.row[k], outputs.parameter[k]] += (
                outputs.gain[k] * wide[:, outputs.column[k]]
            )
        size = np.sqrt(record.samples)
        return (record.y - y) / size, J / size

    def normal(self, theta: Array, trial: _Trial) -> tuple[Array, Array]:
        n, count = len(self._model.states), len(self._model.parameters)
        return _normal(trial.sensitivities, trial.residuals, trial.variance, count, n)


def _normal(
    J_all: list[Spectrum], r_all: list[Spectrum], variance: Array, count: int, n: int
) -> tuple[Array, Array]:
    """Return information and gradient; a complex line of variance v is two of v/2."""
    size = count + n * len(J_all)
    information = np.zeros((size, size))
    gradient = np.zeros(size)
    for number, (J, r) in enumerate(zip(J_all, r_all, strict=True)):
        columns = np.concatenate(
            [np.arange(count), np.arange(count + number * n, count + (number + 1) * n)]
        )
        weighted = J / np.sqrt(0.5 * variance)[None, :, None]
        flat = weighted.reshape(-1, J.shape[2])
        miss = (r / np.sqrt(0.5 * variance)).ravel()
        information[np.ix_(columns, columns)] += (flat.conj().T @ flat).real
        gradient[columns] += (flat.conj().T @ miss).real
    return information, gradient

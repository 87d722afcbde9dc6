"""The equations of a model as linear regressions, and their least-squares solution."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy import linalg

from host.arrays import Array, IntArray
from host.errors import IdentificationError
from host.sysid.models.maneuver import Maneuver
from host.sysid.models.state_space_model import EntryTable, LinearModel
from host.sysid.numerics.differentiation import (
    signal_bandwidth_hz,
    smooth,
    smooth_and_differentiate,
)
from host.sysid.numerics.output_error_problem import check_shapes

NO_EXCITATION = "a parameter has no regressor: its state or input never moved"


@dataclass(frozen=True, slots=True)
class RegressionEquation:
    """One equation of the model in one maneuver, z = X theta + residual.

    EQUATIONS.md, eq. 19.

    Attributes
    ----------
    equation : int
        Number of the equation, the same in every maneuver.
    label : str
        State or output it is of.
    maneuver : int
    dependent : Array, shape (samples,)
        The dependent variable z: rate of a state or output, known terms subtracted.
    columns : IntArray, shape (active,)
        Parameters whose regressor is not zero throughout.
    active_regressors : Array, shape (samples, active)
        Their columns of X.
    noisy_regressors : Array, shape (parameters,)
        1 where a regressor is a measured state; inputs and constants are exact.
    """

    equation: int
    label: str
    maneuver: int
    dependent: Array
    columns: IntArray
    active_regressors: Array
    noisy_regressors: Array

    @property
    def regressors(self) -> Array:
        """Regressors of every parameter, (samples, parameters)."""
        dense = np.zeros((len(self.dependent), len(self.noisy_regressors)))
        dense[:, self.columns] = self.active_regressors
        return dense

    def fitted(self, theta: Array) -> Array:
        """Return the modelled dependent variable at parameter values `theta`."""
        return np.asarray(self.active_regressors @ theta[self.columns], dtype=np.float64)

    def residual(self, theta: Array) -> Array:
        """Return the dependent variable minus `fitted`."""
        return self.dependent - self.fitted(theta)


def regression_equations(
    model: LinearModel,
    maneuvers: Sequence[Maneuver],
    *,
    bandwidth: float | None = None,
    use_rates: bool = True,
) -> tuple[tuple[str, ...], list[RegressionEquation]]:
    """Write the model as regressions.

    A state equation is x_i' - (known A x + B u)_i = sum_j theta_j g_j z_j + b_i, an output equation
    the same for y - (known C x + D u) (Klein & Morelli, Aircraft System Identification, ch. 5).
    Rates come from differentiation where they were not measured.

    Parameters
    ----------
    model : LinearModel
        Every state must be measured.
    maneuvers : sequence of Maneuver
        Data; measured rates are used as they are, others come from differentiation.
    bandwidth : float, optional
        Half-power frequency of smoothing and differentiation, Hz; by default from the data.
    use_rates : bool
        Use measured rates where a maneuver has them.

    Returns
    -------
    names : tuple of str
        Parameters: the common ones, then rate biases and output biases per maneuver.
    equations : list of RegressionEquation
        State equations, then outputs that are no state, if any entry is free.
    """
    measured = model.measured_states()
    n_common = len(model.parameters)
    extra = sorted(set(range(len(model.outputs))) - set(measured.tolist()))
    extra_biases = [y for y in model.output_biases if model.outputs.index(y) in extra]
    names = [p.name for p in model.parameters]
    for number in range(1, len(maneuvers) + 1):
        names += [f"bias_rate.{s}@{number}" for s in model.state_biases]
        names += [f"bias.{y}@{number}" for y in extra_biases]
    n_local = len(model.state_biases) + len(extra_biases)
    sides = (
        (model.entries("AB"), np.hstack([model.A, model.B]), range(len(model.states))),
        (model.entries("CD"), np.hstack([model.C, model.D]), extra),
    )
    equations: list[RegressionEquation] = []
    for number, maneuver in enumerate(maneuvers):
        check_shapes(model, maneuver)
        states, inputs, rates, outputs = _signals(model, maneuver, measured, bandwidth, use_rates)
        z = np.hstack([states, inputs])
        place = n_common + number * n_local
        own = (
            {model.states.index(s): place + k for k, s in enumerate(model.state_biases)},
            {
                model.outputs.index(y): place + len(model.state_biases) + k
                for k, y in enumerate(extra_biases)
            },
        )
        for (entries, fixed, rows), dependent, biases, first, labels in zip(
            sides, (rates, outputs), own, (0, len(model.states)), (model.states, model.outputs),
            strict=True,
        ):  # fmt: skip
            for i in rows:
                regressors, noisy = _regressors(model, entries, i, z, biases)
                if not regressors:
                    continue
                active = sorted(regressors)
                noise = np.zeros(len(names))
                noise[noisy] = 1.0
                equations.append(
                    RegressionEquation(
                        equation=first + i,
                        label=labels[i],
                        maneuver=number,
                        dependent=dependent[:, i] - z @ fixed[i],
                        columns=np.array(active, dtype=np.int64),
                        active_regressors=np.stack([regressors[p] for p in active]).T,
                        noisy_regressors=noise,
                    )
                )
    return tuple(names), equations


def _regressors(
    model: LinearModel, entries: EntryTable, row: int, z: Array, biases: Mapping[int, int]
) -> tuple[dict[int, Array], list[int]]:
    """Return what each parameter of a row multiplies, and which of these are measured states.

    `biases` are the parameters that are the biases of rows. What is zero everywhere is left out.
    """
    found: dict[int, Array] = {}
    noisy: dict[int, bool] = {}
    for k in np.flatnonzero(entries.row == row):
        column, parameter = entries.column[k], int(entries.parameter[k])
        noisy[parameter] = bool(column < len(model.states))
        regressor = entries.gain[k] * z[:, column]
        other = found.get(parameter)
        found[parameter] = regressor if other is None else other + regressor
    if row in biases:
        found[biases[row]] = np.ones(len(z))
    kept = {p: regressor for p, regressor in found.items() if regressor.any()}
    return kept, [p for p, of_state in noisy.items() if of_state]


def _signals(
    model: LinearModel,
    maneuver: Maneuver,
    measured: IntArray,
    bandwidth: float | None,
    use_rates: bool,
) -> tuple[Array, Array, Array, Array]:
    """Return states, inputs, rates and outputs, all with the same smoothing."""
    raw = maneuver.outputs[:, measured]
    if use_rates and maneuver.rates is not None:
        return raw, maneuver.inputs, maneuver.rates, maneuver.outputs
    edge = bandwidth if bandwidth is not None else signal_bandwidth_hz(raw, maneuver.dt_s)
    states, rates = smooth_and_differentiate(raw, maneuver.dt_s, edge)
    inputs = maneuver.inputs
    if model.hold == "zoh":
        # A held input jumps at its sample; at that instant it is the mean of both sides.
        inputs = 0.5 * (inputs + np.vstack([inputs[:1], inputs[:-1]]))
    outputs = maneuver.outputs
    if outputs.shape[1] > len(measured):
        outputs = smooth(outputs, maneuver.dt_s, edge)
    return states, smooth(inputs, maneuver.dt_s, edge), rates, outputs


def solve_least_squares(
    equations: Sequence[RegressionEquation], n_parameters: int, weights: Array | None = None
) -> Array:
    """Solve the stacked regressions, theta = (X'WX)^-1 X'Wz, columns scaled first.

    Parameters
    ----------
    equations : sequence of RegressionEquation
    n_parameters : int
        Length of the solution.
    weights : Array, optional
        One weight per equation.

    Raises
    ------
    IdentificationError
        If the regressors are collinear to working precision.
    """
    normal, right = normal_equations(equations, n_parameters, weights)
    return solve_normal_equations(normal, right)


def normal_equations(
    equations: Sequence[RegressionEquation], n_parameters: int, weights: Array | None = None
) -> tuple[Array, Array]:
    """Return X'WX and X'Wz, summed over all equations."""
    normal = np.zeros((n_parameters, n_parameters))
    right = np.zeros(n_parameters)
    for k, row in enumerate(equations):
        weight = 1.0 if weights is None else float(weights[k])
        normal[np.ix_(row.columns, row.columns)] += weight * (
            row.active_regressors.T @ row.active_regressors
        )
        right[row.columns] += weight * (row.active_regressors.T @ row.dependent)
    return normal, right


def solve_normal_equations(normal: Array, right: Array) -> Array:
    """Solve symmetric normal equations after scaling; refuse singular ones."""
    scale = np.sqrt(np.diag(normal))
    if np.any(scale == 0.0):
        raise IdentificationError(NO_EXCITATION)
    scaled = normal / np.outer(scale, scale)
    try:
        factor = linalg.cho_factor(scaled)
    except linalg.LinAlgError as error:
        raise IdentificationError(
            "collinear regressors: the data do not tell the free entries apart"
        ) from error
    return np.asarray(linalg.cho_solve(factor, right / scale) / scale, dtype=np.float64)

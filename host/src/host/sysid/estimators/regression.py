"""A model as regressions of measured rates and outputs on states and inputs; solving them.

Klein & Morelli, Aircraft System Identification, ch. 5. Rates come from differentiation where they
were not measured.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import linalg

from host.arrays import Array, IntArray
from host.sysid.identification_error import IdentificationError
from host.sysid.models.maneuver import Maneuver
from host.sysid.models.state_space_model import LinearModel
from host.sysid.numerics.differentiation import (
    signal_bandwidth_hz,
    smooth,
    smooth_and_differentiate,
)
from host.sysid.numerics.output_error_problem import check_shapes

NO_EXCITATION = "a parameter has no regressor: its state or input never moved"


@dataclass(frozen=True, slots=True)
class RegressionEquation:
    """One regression: `target` = `regressors` @ theta + residual, in one maneuver.

    `equation` numbers the equation across maneuvers, `columns` are the parameters whose regressor
    ever moves and `block` those regressors, (samples, columns); `noisy`, one per parameter, marks
    regressors made of measured states (inputs and constants are exact).
    """

    equation: int
    label: str
    maneuver: int
    target: Array
    columns: IntArray
    block: Array
    noisy: Array

    @property
    def regressors(self) -> Array:
        """Regressors of every parameter, (samples, parameters)."""
        dense = np.zeros((len(self.target), len(self.noisy)))
        dense[:, self.columns] = self.block
        return dense

    def fitted(self, theta: Array) -> Array:
        """Return what the regression says at parameter values `theta`."""
        return np.asarray(self.block @ theta[self.columns], dtype=np.float64)

    def residual(self, theta: Array) -> Array:
        """Return the target minus `fitted`."""
        return self.target - self.fitted(theta)


def regression_equations(
    model: LinearModel,
    maneuvers: Sequence[Maneuver],
    *,
    bandwidth: float | None = None,
    use_rates: bool = True,
) -> tuple[tuple[str, ...], list[RegressionEquation]]:
    """Write the model as regressions.

    Parameters
    ----------
    model : LinearModel
        Every state must be measured.
    maneuvers : sequence of Maneuver
        Data; measured rates are used as they are, others come from differentiation.
    bandwidth : float, optional
        Half-power frequency of smoothing and differentiation, Hz; found from the data without.
    use_rates : bool
        Use measured rates where a maneuver has them.

    Returns
    -------
    names : tuple of str
        Parameters: the common ones, then rate biases and output biases per maneuver.
    rows : list of Row
        State equations, then outputs that are no state, where anything is free.
    """
    measured = model.measured_states()
    n_common = len(model.parameters)
    extra = [j for j in range(len(model.outputs)) if j not in set(measured.tolist())]
    extra_biases = [y for y in model.output_biases if model.outputs.index(y) in extra]
    names = [p.name for p in model.parameters]
    for number in range(1, len(maneuvers) + 1):
        names += [f"bias_rate.{s}@{number}" for s in model.state_biases]
        names += [f"bias.{y}@{number}" for y in extra_biases]
    n_local = len(model.state_biases) + len(extra_biases)
    state_entries, output_entries = model.entries("AB"), model.entries("CD")
    rows: list[RegressionEquation] = []
    for number, maneuver in enumerate(maneuvers):
        check_shapes(model, maneuver)
        states, inputs, rates, outputs = _signals(model, maneuver, measured, bandwidth, use_rates)
        z = np.hstack([states, inputs])
        place = n_common + number * n_local
        for entries, fixed, left, indices, biases, offset in (
            (state_entries, np.hstack([model.A, model.B]), rates, range(len(model.states)),
             [model.states.index(s) for s in model.state_biases], place),
            (output_entries, np.hstack([model.C, model.D]), outputs, extra,
             [model.outputs.index(y) for y in extra_biases], place + len(model.state_biases)),
        ):  # fmt: skip
            for i in indices:
                noisy = np.zeros(len(names))
                regressors: dict[int, Array] = {}
                for k in np.flatnonzero(entries.row == i):
                    column, parameter = entries.column[k], int(entries.parameter[k])
                    regressor = entries.gain[k] * z[:, column]
                    noisy[parameter] = float(column < len(model.states))
                    other = regressors.get(parameter)
                    regressors[parameter] = regressor if other is None else other + regressor
                if i in biases:
                    regressors[offset + biases.index(i)] = np.ones(len(z))
                moving = sorted(p for p, regressor in regressors.items() if regressor.any())
                if not moving:
                    continue
                is_state = left is rates
                rows.append(
                    RegressionEquation(
                        equation=i if is_state else len(model.states) + i,
                        label=model.states[i] if is_state else model.outputs[i],
                        maneuver=number,
                        target=left[:, i] - z @ fixed[i],
                        columns=np.array(moving, dtype=np.int64),
                        block=np.stack([regressors[p] for p in moving]).T,
                        noisy=noisy,
                    )
                )
    return tuple(names), rows


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
        # A held input jumps at its sample; seen at that instant it is the mean of both sides.
        inputs = 0.5 * (inputs + np.vstack([inputs[:1], inputs[:-1]]))
    outputs = maneuver.outputs
    if outputs.shape[1] > len(measured):
        outputs = smooth(outputs, maneuver.dt_s, edge)
    return states, smooth(inputs, maneuver.dt_s, edge), rates, outputs


def solve_least_squares(
    rows: Sequence[RegressionEquation], n_parameters: int, weights: Array | None = None
) -> Array:
    """Solve the stacked regressions by normal equations, columns scaled first.

    Parameters
    ----------
    rows : sequence of Row
        Regressions.
    n_parameters : int
        Length of the solution.
    weights : Array, optional
        One weight per row of `rows`.

    Raises
    ------
    IdentificationError
        If the regressors are collinear to working precision.
    """
    normal, right = normal_equations(rows, n_parameters, weights)
    return solve_normal_equations(normal, right)


def normal_equations(
    rows: Sequence[RegressionEquation], n_parameters: int, weights: Array | None = None
) -> tuple[Array, Array]:
    """Return X'WX and X'Wy over all rows."""
    normal = np.zeros((n_parameters, n_parameters))
    right = np.zeros(n_parameters)
    for k, row in enumerate(rows):
        weight = 1.0 if weights is None else float(weights[k])
        normal[np.ix_(row.columns, row.columns)] += weight * (row.block.T @ row.block)
        right[row.columns] += weight * (row.block.T @ row.target)
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

"""Prediction over short windows from measured states, and what persistence says instead.

A model is restarted from the measured states at many instants and predicts for a while. Kinematic
persistence is what needs no model: body rates and velocity through the air stay as they were
measured, attitude is integrated from the rates, specific forces stay. A model that is no better
than that predicts nothing.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from host.aircraft.attitude import euler_rates
from host.arrays import Array, IntArray
from host.sysid.models.maneuver import Maneuver
from host.sysid.models.nonlinear_model import NonlinearModel
from host.sysid.models.state_space_model import LinearModel, has_equations
from host.sysid.numerics.discretisation import discretise
from host.sysid.numerics.nonlinear_problem import NonlinearProblem
from host.sysid.numerics.simulator import simulate_with_slopes
from host.sysid.validation.free_simulation import Biases

WINDOWS_S = (0.1, 0.5, 1.0, 2.0)
PARTS = 4  # a window begins every quarter of its length


@dataclass(frozen=True, slots=True)
class WindowErrors:
    """Errors over windows of one length, all windows and samples pooled.

    Attributes
    ----------
    length_s : float
        One sample period of the one-step prediction.
    windows : int
    model, persistence : Array, shape (p,)
        Rms error of every output, in its unit.
    """

    length_s: float
    windows: int
    model: Array
    persistence: Array

    @property
    def relative(self) -> Array:
        """Error of the model over that of persistence, (p,); NaN where persistence has none."""
        safe = np.where(self.persistence > 0.0, self.persistence, np.nan)
        return np.asarray(self.model / safe, dtype=np.float64)


def window_errors(
    model: LinearModel,
    maneuvers: Sequence[Maneuver],
    columns: Sequence[Mapping[str, Array]],
    biases: Sequence[Biases],
    states: Sequence[Array],
    length_s: float | None,
) -> WindowErrors | None:
    """Return the errors over windows; None if no maneuver is as long.

    Parameters
    ----------
    model : LinearModel
        Without free parameters and delays.
    maneuvers : sequence of Maneuver
    columns : sequence of mapping of (samples,) Array
        Columns of each maneuver: rates and attitude for the persistence; what is missing counts as
        zero.
    biases : sequence of Biases
    states : sequence of Array, shape (samples, n)
        States of the free simulation, for those that are no output: the bank angle of a lateral
        model.
    length_s : float or None
        None is one sample: the one-step prediction.
    """
    squares = np.zeros((2, len(model.outputs)))
    samples, windows, longest_s = 0, 0, 0.0
    for maneuver, flown, bias, free in zip(maneuvers, columns, biases, states, strict=True):
        steps = 1 if length_s is None else round(length_s / maneuver.dt_s)
        if steps < 1 or steps >= maneuver.samples:
            continue
        starts = np.arange(0, maneuver.samples - steps, max(1, steps // PARTS))
        predicted = _restarted(model, maneuver, bias, free, starts, steps)
        held = _persistence(model, maneuver, flown, starts, steps)
        at = starts[:, None] + np.arange(1, steps + 1)
        for row, guess in zip(squares, (predicted, held), strict=True):
            row += np.sum((guess - maneuver.outputs[at]) ** 2, axis=(0, 1))
        samples += len(starts) * steps
        windows += len(starts)
        longest_s = max(longest_s, steps * maneuver.dt_s)
    if windows == 0:
        return None
    rms = np.sqrt(squares / samples)
    return WindowErrors(longest_s if length_s is None else length_s, windows, rms[0], rms[1])


def _restarted(
    model: LinearModel,
    maneuver: Maneuver,
    bias: Biases,
    free: Array,
    starts: IntArray,
    steps: int,
) -> Array:
    """Return the outputs after each step from measured states, (starts, steps, p)."""
    if has_equations(model):
        return _restarted_equations(model, maneuver, bias, free, starts, steps)
    n, m = len(model.states), len(model.inputs)
    foh = model.hold == "foh"
    none = np.zeros(0, dtype=np.int64)
    AB = np.column_stack([model.A, model.B, bias.rate])
    step, _ = discretise(AB, n, m, foh, maneuver.dt_s, none, none, none, np.zeros(0), 0)
    u = maneuver.inputs
    drive = [u, np.ones((maneuver.samples, 1))]
    drive += [np.diff(u, axis=0, append=u[-1:])] if foh else []
    driven = np.hstack(drive)
    x = free[starts].copy()
    for k, state in enumerate(model.states):
        if state in model.outputs:
            row = model.outputs.index(state)
            x[:, k] = maneuver.outputs[starts, row] - bias.output[row]
    result = np.empty((len(starts), steps, len(model.outputs)))
    for k in range(steps):
        x = np.hstack([x, driven[starts + k]]) @ step.T
        result[:, k] = x @ model.C.T + u[starts + k + 1] @ model.D.T + bias.output
    return result


def _restarted_equations(
    model: NonlinearModel,
    maneuver: Maneuver,
    bias: Biases,
    free: Array,
    starts: IntArray,
    steps: int,
) -> Array:
    """Return the same of equations.

    A state that is no output is that of `[starts]` from what was measured, else of the free
    simulation. What an output of its name adds to a state is taken off the measured one.
    """
    e, code = model.source, model.source.code
    p = model.parameter_vector(np.zeros(0), bias.own)
    problem = NonlinearProblem(replace(model, delays=()), [maneuver])
    guess = problem.first_guess()
    problem.choose_step(guess)
    motion = problem.motion(0, guess, slopes=False)
    result = np.full((len(starts), steps, len(model.outputs)), np.nan)
    for number, k in enumerate(starts.tolist()):
        x, added = free[k].copy(), np.zeros(len(model.outputs))
        code.functions["readings"](
            x, maneuver.inputs[k], p, e.constant_values, e.table_values, added
        )
        measured = dict(zip(model.outputs, maneuver.outputs[k].tolist(), strict=True))
        named = dict(zip(model.inputs, maneuver.inputs[k].tolist(), strict=True)) | measured
        guessed = e.first_states(named)
        for row, state in enumerate(model.states):
            if state in model.outputs:
                place = model.outputs.index(state)
                x[row] += measured[state] - added[place] - bias.output[place]
            elif state in guessed:
                x[row] = guessed[state]
        u = np.ascontiguousarray(maneuver.inputs[k : k + steps + 1])
        given = motion.given._replace(start=x, inputs=u, held=u, p=p, bias=bias.rate)
        found = simulate_with_slopes(replace(motion, given=given, offset=bias.output))
        if found is not None:
            result[number] = found[0][:, 1:].T
    return result


def _persistence(
    model: LinearModel,
    maneuver: Maneuver,
    flown: Mapping[str, Array],
    starts: IntArray,
    steps: int,
) -> Array:
    """Return the outputs held, attitude integrated, (starts, steps, p)."""
    result = np.repeat(maneuver.outputs[starts][:, None, :], steps, axis=1)
    zero = np.zeros(maneuver.samples)
    names = ("p_radps", "q_radps", "r_radps", "phi_rad", "theta_rad")
    p, q, r, phi, theta = (np.array(flown.get(name, zero)[starts]) for name in names)
    for k in range(steps):
        rates = euler_rates(phi, theta, p, q, r)
        phi, theta = phi + rates[0] * maneuver.dt_s, theta + rates[1] * maneuver.dt_s
        for name, angle in (("phi_rad", phi), ("theta_rad", theta)):
            if name in model.outputs:
                result[:, k, model.outputs.index(name)] = angle
    return result

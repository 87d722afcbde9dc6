"""What usual errors of a model look like in its outputs, to first order.

A term that is missing in a state equation drives the model's own dynamics; a servo's lag drives
them by the rate of the input; a wrong scale or delay of a sensor is in its output alone. One column
for each: where a residual is correlated with one, the model has that error or one like it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import linalg

from host.arrays import Array
from host.sysid.numerics.output_error_problem import OutputProblem
from host.sysid.numerics.simulator import Response


@dataclass(frozen=True, slots=True)
class Signatures:
    """Columns of errors of a model over one maneuver.

    Attributes
    ----------
    names : tuple of str
        What each error would be, in words.
    columns : Array, shape (p, samples, errors)
    """

    names: tuple[str, ...]
    columns: Array


def model_error_signatures(
    problem: OutputProblem, number: int, response: Response, theta: Array
) -> Signatures:
    """Return the signatures of one maneuver.

    Parameters
    ----------
    problem : OutputProblem
    number : int
        Number of the maneuver, from 0.
    response : Response
        Response of the model at `theta`.
    theta : Array, shape (P,)
        Common parameters first.
    """
    model, maneuver = problem.model_at(theta), problem.maneuvers[number]
    A, B, C, D = model.matrices(theta[: len(model.parameters)])
    y = response.y.T - response.y.T[0]
    u = maneuver.inputs - maneuver.inputs[0]
    moving = {s: y[:, model.outputs.index(s)] for s in model.states if s in model.outputs}
    free_rows = sorted({t.row for t in model.terms if t.matrix in "AB"})
    # What a parameter of the model does is no error of it: q in the equation of q is M_q but
    # for rounding, and that rounding passes for a bias of M_q by 50 %.
    own = {
        (t.row, (model.states if t.matrix == "A" else model.inputs)[t.column])
        for t in model.terms
        if t.matrix in "AB"
    }
    names, drives, direct = [], [], []
    none = np.zeros((len(y), len(model.outputs)))

    def add(name: str, drive: Array, output: Array = none) -> None:
        names.append(name)
        drives.append(drive)
        direct.append(output)

    for row in free_rows:
        unit, state = np.eye(len(A))[row], model.states[row]
        for label, values in (*moving.items(), *zip(model.controls(), u.T, strict=False)):
            if (row, label) not in own:
                add(f"{label} in the equation of {state}", values[:, None] * unit)
        for label, values in moving.items():
            if (row, label) in own:
                bent = values * np.abs(values)
                add(f"{label} beyond linear in the equation of {state}", bent[:, None] * unit)
    for k, label in enumerate(model.controls()):
        rate = np.gradient(u[:, k], maneuver.dt_s)
        add(f"a lag of {label}", np.outer(rate, B[:, k]), np.outer(rate, D[:, k]))
    for j, label in enumerate(model.outputs):
        unit = np.eye(len(model.outputs))[j]
        add(f"the scale of {label}", np.zeros((len(y), len(A))), np.outer(y[:, j], unit))
        rate = np.gradient(y[:, j], maneuver.dt_s)
        add(f"a delay of {label}", np.zeros((len(y), len(A))), np.outer(rate, unit))
    driven = _driven(A, np.stack(drives, axis=2), maneuver.dt_s)  # (samples, n, errors)
    columns = np.einsum("jn,tne->jte", C, driven) + np.stack(direct, axis=2).transpose(1, 0, 2)
    size = np.sqrt(np.mean(columns**2, axis=(0, 1)))
    return Signatures(tuple(names), columns / np.where(size > 0.0, size, 1.0))


def _driven(A: Array, drives: Array, dt_s: float) -> Array:
    """Return the states of x' = A x + f from rest; f, (samples, n, errors), is linear between."""
    n = len(A)
    wide = np.zeros((3 * n, 3 * n))
    wide[:n, :n], wide[:n, n : 2 * n], wide[n : 2 * n, 2 * n :] = A, np.eye(n), np.eye(n)
    step = linalg.expm(wide * dt_s)
    Phi, held, ramp = step[:n, :n], step[:n, n : 2 * n], step[:n, 2 * n :] / dt_s
    pushed = np.einsum("ab,tbe->tae", held - ramp, drives[:-1]) + np.einsum(
        "ab,tbe->tae", ramp, drives[1:]
    )
    x = np.zeros_like(drives)
    for k, push in enumerate(pushed):
        x[k + 1] = Phi @ x[k] + push
    return x

"""What an input may have done between its samples, and whether that is what a fit leaves.

A record says where an input was at its samples. Between them it was held or moved along a line,
bent as a cubic through the samples does, or jumped at an instant of its own. All of it changes the
input's mean from one sample to the next, and acts as an impulse there.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import PchipInterpolator
from scipy.optimize import lsq_linear

from host.arrays import Array, BoolArray
from host.sysid.models.maneuver import Maneuver
from host.sysid.models.state_space_model import LinearModel
from host.sysid.numerics.model_problems import output_problem
from host.sysid.numerics.output_error_problem import OutputProblem
from host.sysid.numerics.simulator import Response

OTHER_HOLD = {"foh": "zoh", "zoh": "foh"}
MOST_JUMPS = 20  # of all records: those that may move the mean of an input most
WHOLE = 1.1  # times what is possible: the answer is linear about a hold that is not the right one
# Share of the power of a residual: less after what inputs may have done is no noise of a sensor.
EXPLAINED_BUT = 0.05
# Share of a residual's deviation: the other hold moves outputs by less where inputs explain little
# of it.
SMALL = 0.2
RIDGE = 1e-12  # of scaled columns
STRAIGHT = 1e-6  # of an input's range: what jumps by less does not


@dataclass(frozen=True, slots=True)
class Jump:
    """An interval in which an input may have jumped, from this sample of a maneuver to the next.

    `most` is by how much its mean over the interval may be off that of the line.
    """

    maneuver: int
    sample: int
    column: int
    most: float


def with_means_of_smooth_motion(values: Array) -> Array:
    """Return samples between which lines have the mean of a smooth motion.

    Commands that come every 20 ms bend a servo in every other sample of 10 ms: no kink stands out.
    A line cuts the bends off, w^2 dt^2 / 12 of a motion of w rad/s: at 20 rad/s 0.3 %, and so much
    too large were Cl_p and Cl_da. A cubic between samples does not, and is late nowhere.

    Parameters
    ----------
    values : Array, shape (n,)
        On an even grid. Steps come back as they are: the cubic does not overshoot (Fritsch &
        Carlson, SIAM J. Numer. Anal. 17, 1980).
    """
    if len(values) < 3:
        return values
    at = np.arange(len(values), dtype=np.float64)
    mean = np.diff(PchipInterpolator(at, values).antiderivative()(at))
    return shared_by_samples(values, mean - 0.5 * (values[1:] + values[:-1]))


def shared_by_samples(values: Array, missing: Array) -> Array:
    """Return samples moved by what the mean of each interval lacks, half of it at either end."""
    result = values.copy()
    result[:-1] += 0.5 * missing
    result[1:] += 0.5 * missing
    return result


def with_bent_controls(model: LinearModel, maneuvers: Sequence[Maneuver]) -> list[Maneuver]:
    """Return maneuvers whose lines have the means of a smooth motion of the controls."""
    bent = [name in model.controls() for name in model.inputs]
    return [
        replace(
            m,
            inputs=np.column_stack(
                [
                    with_means_of_smooth_motion(u) if b else u
                    for u, b in zip(m.inputs.T, bent, strict=True)
                ]
            ),
        )
        for m in maneuvers
    ]


def likely_jumps(model: LinearModel, maneuvers: Sequence[Maneuver]) -> list[Jump]:
    """Return the intervals in which controls may have jumped furthest, over their range.

    From sample to sample a control moves one way; where it comes and goes alike it moves evenly.
    """
    found: list[tuple[float, Jump]] = []
    for column, name in enumerate(model.inputs):
        if name not in model.controls():
            continue
        spread = max(float(np.ptp(m.inputs[:, column])) for m in maneuvers)
        for number, maneuver in enumerate(maneuvers):
            change = np.diff(maneuver.inputs[:, column])
            bend = np.abs(np.diff(change, prepend=0.0, append=0.0))
            most = 0.5 * np.minimum(np.abs(change), np.maximum(bend[:-1], bend[1:]))
            for k in np.argsort(-most)[:MOST_JUMPS]:
                if most[k] > STRAIGHT * spread:
                    jump = Jump(number, int(k), column, float(most[k]))
                    found.append((jump.most / spread, jump))
    found.sort(key=lambda pair: -pair[0])
    return [jump for _, jump in found[:MOST_JUMPS]]


def with_jump(maneuvers: Sequence[Maneuver], jump: Jump, hold: str) -> list[Maneuver]:
    """Return maneuvers in which the mean of an input is higher by what a jump makes at most."""
    result = list(maneuvers)
    inputs = result[jump.maneuver].inputs.copy()
    if hold == "zoh":
        inputs[jump.sample, jump.column] += jump.most
    else:
        inputs[jump.sample : jump.sample + 2, jump.column] += 0.5 * jump.most
    result[jump.maneuver] = replace(result[jump.maneuver], inputs=inputs)
    return result


def left_between_samples(
    problem: OutputProblem, theta: Array, responses: Sequence[Response]
) -> BoolArray:
    """Return of which outputs a fit leaves what inputs may have done between samples, (p,).

    That is no noise. Taken for noise with a memory it whitens the motion away: M_alpha of records
    without noise is up to 970 times its value, where inputs were held and the model draws lines.

    Parameters
    ----------
    problem : OutputProblem
    theta : Array, shape (P,)
        Optimum of white output error.
    responses : sequence of Response
        There.
    """
    residuals = [problem.residual(k, r.y) for k, r in enumerate(responses)]
    power = np.sum([np.sum(e**2, axis=1) for e in residuals], axis=0)
    directions, least = _directions(problem, theta, residuals, power)
    if not directions:
        return np.zeros(len(power), dtype=bool)
    weight = 1.0 / np.sqrt(np.maximum(power, 1e-300))[:, None]
    unknowns = len(theta)
    blocks = []  # of each maneuver, (p, samples, unknowns and directions)
    for number, response in enumerate(responses):
        block = np.zeros((*response.y.shape, unknowns + len(directions)))
        block[:, :, problem.columns(number)] = response.sensitivities
        for k, direction in enumerate(directions, start=unknowns):
            block[:, :, k] = direction[number]
        blocks.append(block * weight[:, :, None])
    found = _bounded(
        np.concatenate([b.reshape(-1, b.shape[2]) for b in blocks]),
        np.concatenate([(weight * e).ravel() for e in residuals]),
        np.append(np.full(unknowns, -np.inf), least),
        np.append(np.full(unknowns, np.inf), np.full(len(least), WHOLE)),
    )
    left = [
        np.sum((weight * e - b @ found) ** 2, axis=1)
        for e, b in zip(residuals, blocks, strict=True)
    ]
    return np.asarray(np.sum(left, axis=0) < EXPLAINED_BUT)


def _directions(
    problem: OutputProblem, theta: Array, residuals: Sequence[Array], power: Array
) -> tuple[list[list[Array]], Array]:
    """Return what the other hold, bends and jumps change of the outputs, (p, samples) each.

    Also the least share of each that is possible. None where the other hold does little.
    """
    model, maneuvers = problem.model, problem.maneuvers

    def change(other: LinearModel, data: Sequence[Maneuver]) -> list[Array]:
        elsewhere = output_problem(other, data)
        found = elsewhere.outputs(theta)
        if found is None:
            return [np.zeros_like(e) for e in residuals]
        return [
            e - elsewhere.residual(k, y)
            for k, (e, y) in enumerate(zip(residuals, found, strict=True))
        ]

    held = change(replace(model, hold=OTHER_HOLD[model.hold]), maneuvers)
    moved = np.sum([np.sum(d**2, axis=1) for d in held], axis=0)
    if np.all(moved < SMALL**2 * power):
        return [], np.zeros(0)
    bent = change(model, with_bent_controls(model, maneuvers))
    # Held inputs can be moved in one interval alone.
    steps = replace(model, hold="zoh")
    still = change(steps, maneuvers)
    directions = [held, bent]
    for jump in likely_jumps(model, maneuvers):
        jumped = change(steps, with_jump(maneuvers, jump, "zoh"))
        directions.append([d - s for d, s in zip(jumped, still, strict=True)])
    return directions, np.append(np.zeros(2), np.full(len(directions) - 2, -WHOLE))


def _bounded(rows: Array, right: Array, lower: Array, upper: Array) -> Array:
    """Return least squares within bounds, by normal equations: rows are many."""
    normal = rows.T @ rows
    size = np.sqrt(np.maximum(np.diag(normal), 1e-300))
    root = np.linalg.cholesky(normal / np.outer(size, size) + RIDGE * np.eye(len(size)))
    reduced = np.linalg.solve(root, rows.T @ right / size)
    return np.asarray(lsq_linear(root.T, reduced, (lower * size, upper * size)).x / size)

"""What the last step of the joint fit says of single terms and single maneuvers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from host.compiled import Array, BoolArray, IntArray
from host.sysid.coefficients.rows import KINEMATIC
from host.sysid.coefficients.windows import Block, Key, degree, row_weight, used
from host.sysid.compatibility.signals import Spectrum
from host.sysid.errors import IdentificationError

LOST = 1e12  # by which a variance grows where a regressor never moves, or is the same as others
FLAT = 1e-9  # a constant has no transform at whole periods but rounding
LEAST_ELSEWHERE = 0.1  # of what is known of each term: a maneuver that alone tells it must stay


@dataclass(frozen=True, slots=True)
class LastStep:
    """The linear problem of the last step: slopes `A`, left factors `Z`, residuals `y`, weighted.

    `normal` step = `right`, prior included; `owner` is the equation and window of each stretch of
    rows, two for every frequency compared, weighted by `noise`; `spectra` are left sides
    and regressors; the first `terms` columns are coefficients, the last `errors` those of the
    instrument, between them lines of each stretch, then slow gusts.
    """

    A: Array
    Z: Array
    y: Array
    normal: Array
    right: Array
    inverse: Array
    owner: tuple[Key, ...]
    noise: Mapping[str, tuple[Array, Array]]
    spectra: Mapping[Key, Spectrum]
    terms: int
    errors: int

    def rows(self, blocks: Sequence[Block]) -> dict[Key, slice]:
        """Return where the rows of every equation in every window are."""
        found, at = {}, 0
        for name, window in self.owner:
            rows = 2 * int(used(blocks[window], name).sum())
            found[name, window] = slice(at, at + rows)
            at += rows
        return found

    def lines(self, window: int) -> BoolArray:
        """Return which columns are constants and slopes of one window."""
        found, at = np.zeros(self.A.shape[1], dtype=bool), self.terms
        for name, k in self.owner:
            found[at : at + degree(name)] = k == window
            at += degree(name)
        return found


@dataclass(frozen=True, slots=True)
class Prediction:
    """How well maneuvers are predicted: NRMSE of each coefficient between 0.1 and 4.5 Hz.

    Measured angles, rates and surfaces go in, gusts with them; each maneuver keeps a constant and
    slope of its own. `fitted` by the joint answer; `unseen` by answers to all other maneuvers, for
    those of `windows`: leave-one-out in the last step of the search, spectra of noise and gust-free
    simulation as in the joint answer.
    """

    windows: tuple[int, ...]
    fitted: dict[str, float]
    unseen: dict[str, float]


def prediction(last: LastStep, blocks: Sequence[Block]) -> Prediction | None:
    """Return how well single maneuvers are predicted by all others; None where none can be."""
    rows = last.rows(blocks)
    step = last.inverse @ last.right
    windows: list[int] = []
    sums: dict[str, Array] = {}
    for window in range(len(blocks)):
        mine = [part for (_, k), part in rows.items() if k == window]
        here = np.concatenate([np.arange(part.start, part.stop) for part in mine])
        other = _without(last, here, last.lines(window))
        if other is None:
            continue
        windows.append(window)
        for (name, k), part in rows.items():
            if k == window and name not in KINEMATIC:
                kept = used(blocks[k], name)
                weight = row_weight(blocks[k].hertz[kept], last.noise.get(name))
                trends, measured = blocks[k].trends[kept, :2], last.spectra[name, k][kept, 0]
                parts = _misses(last, part, weight, trends, measured, (step, other))
                sums[name] = sums.get(name, np.zeros(3)) + parts
    if not windows:
        return None
    fitted, unseen = (
        {name: float(np.sqrt(s[k] / s[2])) for name, s in sums.items()} for k in (0, 1)
    )
    return Prediction(tuple(windows), fitted, unseen)


def _without(last: LastStep, here: IntArray, gone: BoolArray) -> Array | None:
    """Return the step without some rows and columns; None if a term is hardly told without."""
    A, Z = last.A[here], last.Z[here]
    known = np.einsum("ij,ij->j", last.Z, last.Z)[: last.terms]
    left = known - np.einsum("ij,ij->j", Z, Z)[: last.terms]
    if np.any(left < LEAST_ELSEWHERE * known):
        return None
    normal = last.normal - Z.T @ A
    normal[gone], normal[:, gone] = 0.0, 0.0
    normal[gone, gone] = 1.0
    right = last.right - Z.T @ last.y[here]
    right[gone] = 0.0
    scale = 1.0 / np.sqrt(np.maximum(np.abs(np.diag(normal)), 1e-30))
    found: Array = scale * np.linalg.solve(normal * np.outer(scale, scale), scale * right)
    return found


def _misses(
    last: LastStep,
    part: slice,
    weight: Array,
    trends: Spectrum,
    measured: Spectrum,
    steps: tuple[Array, Array],
) -> Array:
    """Return squares of what two steps leave of an equation in a window, and of its left side."""
    columns = np.r_[: last.terms, -last.errors : 0]
    A = last.A[part][:, columns]
    line = np.concatenate([trends.real, trends.imag])
    found = []
    for values in (*(last.y[part] - A @ step[columns] for step in steps), None):
        if values is None:
            values = np.concatenate([measured.real, measured.imag])
        else:
            values = values / np.tile(weight, 2)
        gone = line @ np.linalg.lstsq(line, values, rcond=FLAT)[0]
        found.append(float(np.sum((values - gone) ** 2)))
    return np.array(found)


def pulls(last: LastStep, blocks: Sequence[Block], told: Array) -> tuple[Array, Array, Array]:
    """Return how far each maneuver pulls an answer, its share of its variance, the variance.

    Parameters
    ----------
    last : LastStep
    blocks : sequence of Block
    told : Array, shape (P, columns)
        How the answer moves with what was estimated.

    Returns
    -------
    pull, share : Array, shape (maneuvers, P)
    variance : Array, shape (P,)
        From noise and gusts alone: what the maneuvers have in common (mass, places) is not in it.
    """
    left = last.y - last.A @ (last.inverse @ last.right)
    moved = told @ last.inverse
    rows = last.rows(blocks)
    pull, share = (np.empty((len(blocks), len(told))) for _ in range(2))
    for window in range(len(blocks)):
        mine = [part for (_, k), part in rows.items() if k == window]
        here = np.concatenate([np.arange(part.start, part.stop) for part in mine])
        through = last.Z[here] @ moved.T
        pull[window] = left[here] @ through
        share[window] = np.einsum("ij,ij->j", through, through)
    return pull, share, np.sum(share, axis=0)


def told_inverse(normal: Array, position: Mapping[str, int]) -> Array:
    """Return the inverse of a matrix with ones on its diagonal; name the terms if it has none."""
    try:
        found = np.linalg.inv(normal)
    except np.linalg.LinAlgError:
        found = np.linalg.pinv(normal, rcond=1e-13) + np.diag(np.diag(normal) < 0.5) * 2.0 * LOST
    lost = [n for n, k in position.items() if not abs(found[k, k]) < LOST]
    if lost:
        raise IdentificationError(
            f"the flight cannot tell {', '.join(lost)}: what they go with never moves, or is the"
            " same as other terms; leave them out"
        )
    return found

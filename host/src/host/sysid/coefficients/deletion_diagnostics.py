"""What the last step of the joint fit says of single terms and single maneuvers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from host.arrays import Array
from host.sysid.coefficients.aero_equations import KINEMATIC
from host.sysid.coefficients.equation_blocks import Stretch, Unknowns, summed
from host.sysid.coefficients.normal_equations import STILL, Step
from host.sysid.coefficients.window_spectra import FLAT, Block, Key, row_weight, used
from host.sysid.compatibility.inverse_sensor_model import Spectrum

LEAST_ELSEWHERE = 0.1  # of what is known of each term: a maneuver that alone tells it must stay


@dataclass(frozen=True, slots=True)
class LastStep:
    """The linear problem of the last step: its stretches of rows, and what they were solved to.

    `noise` are the spectra they are weighted by; `spectra` left sides and regressors.
    """

    parts: Sequence[Stretch]
    solved: Step
    unknowns: Unknowns
    noise: Mapping[str, tuple[Array, Array]]
    spectra: Mapping[Key, Spectrum]


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
    windows: list[int] = []
    sums: dict[str, Array] = {}
    known = _sizes(last, last.parts)
    for window, block in enumerate(blocks):
        mine = [part for part in last.parts if part.window == window]
        # A maneuver that alone tells a term cannot be left out.
        if np.any(known - _sizes(last, mine) < LEAST_ELSEWHERE * known):
            continue
        windows.append(window)
        steps = last.solved.step, _without(last, mine)
        for part in mine:
            if part.name not in KINEMATIC:
                squares = _misses(last, part, block, steps)
                sums[part.name] = sums.get(part.name, np.zeros(3)) + squares
    if not windows:
        return None
    fitted, unseen = (
        {name: float(np.sqrt(s[k] / s[2])) for name, s in sums.items()} for k in (0, 1)
    )
    return Prediction(tuple(windows), fitted, unseen)


def _sizes(last: LastStep, parts: Sequence[Stretch]) -> Array:
    """Return sums of squares of the left factors of every coefficient."""
    found = np.zeros(last.unknowns.count)
    for part in parts:
        found[part.columns] += np.einsum("ij,ij->j", part.Z, part.Z)
    return found[: last.unknowns.terms]


def _without(last: LastStep, mine: Sequence[Stretch]) -> Array:
    """Return the step without some stretches."""
    less = summed(mine, last.unknowns.count)
    normal, right = last.solved.normal - less.normal, last.solved.right - less.right
    scale = 1.0 / np.sqrt(np.maximum(np.abs(np.diag(normal)), STILL))
    found: Array = scale * np.linalg.solve(normal * np.outer(scale, scale), scale * right)
    return found


def _misses(last: LastStep, part: Stretch, block: Block, steps: tuple[Array, Array]) -> Array:
    """Return squares of what two steps leave of an equation in a window, and of its left side."""
    kept = used(block, part.name)
    weight = np.tile(row_weight(block.hertz[kept], last.noise.get(part.name)), 2)
    trends, measured = block.trends[kept, :2], last.spectra[part.name, part.window][kept, 0]
    line = np.concatenate([trends.real, trends.imag])
    gusts = last.unknowns.terms + np.arange(last.unknowns.gusts)
    told = ~np.isin(part.columns, gusts)  # a slow gust is the maneuver's own
    A, columns = part.A[:, told], part.columns[told]
    found = []
    for values in (
        *((part.y - A @ step[columns]) / weight for step in steps),
        np.concatenate([measured.real, measured.imag]),
    ):
        gone = line @ np.linalg.lstsq(line, values, rcond=FLAT)[0]
        found.append(float(np.sum((values - gone) ** 2)))
    return np.array(found)


def pulls(last: LastStep, blocks: Sequence[Block], told: Array) -> tuple[Array, Array, Array]:
    """Return how far each maneuver pulls an answer, its share of its variance, the variance.

    Parameters
    ----------
    last : LastStep
    blocks : sequence of Block
    told : Array, shape (P, unknowns)
        How the answer moves with what was estimated.

    Returns
    -------
    pull, share : Array, shape (maneuvers, P)
    variance : Array, shape (P,)
        From noise and gusts alone: what the maneuvers have in common (mass, places) is not in it.
    """
    moved = told @ last.solved.inverse
    pull, share = (np.zeros((len(blocks), len(told))) for _ in range(2))
    for part in last.parts:
        through = part.level(part.Z) @ moved[:, part.columns].T
        pull[part.window] += part.left(last.solved.step) @ through
        share[part.window] += np.einsum("ij,ij->j", through, through)
    return pull, share, np.sum(share, axis=0)

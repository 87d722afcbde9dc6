"""The simulation of a model over the samples of a maneuver, and the slopes of its outputs.

A linear model is the case of constant matrices: each sample is the last one times the same matrix,
exactly, and samples run side by side (`recursion`). Equations take steps between samples
(`equation_recursion`).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from host.arrays import Array, IntArray
from host.sysid.numerics.recursion import propagate, simulate
from host.sysid.numerics.sampled_model import SampledModel

if TYPE_CHECKING:
    from host.compiled import Kernel
    from host.sysid.numerics.equation_recursion import SampledEquations


@dataclass(frozen=True, slots=True)
class Response:
    """Simulated outputs of one maneuver and their sensitivities.

    Attributes
    ----------
    y : Array, shape (p, samples)
        Outputs in the units of the model.
    sensitivities : Array, shape (p, samples, columns of this maneuver)
        Derivatives of `y` by the unknowns that this maneuver depends on.
    """

    y: Array
    sensitivities: Array


@dataclass(frozen=True, slots=True)
class MatrixMotion:
    """A linear model over one sample, and what drives it over a maneuver, (samples, w)."""

    model: SampledModel
    drive: Array


@dataclass(frozen=True, slots=True)
class EquationMotion:
    """Equations over the samples of a maneuver.

    Attributes
    ----------
    kernel : Kernel
        `run_equations` with the functions of the model.
    given : SampledEquations
    offset, offset_column : Array, IntArray, shape (p,)
        Added to the outputs, and which unknown each is; -1 where it is none.
    """

    kernel: Kernel[..., Any]
    given: SampledEquations
    offset: Array
    offset_column: IntArray


def simulate_with_slopes(
    motion: MatrixMotion | EquationMotion, slopes: Array | None = None
) -> tuple[Array, Array] | None:
    """Simulate outputs and states, and the slopes of the outputs by the unknowns if asked.

    Parameters
    ----------
    motion : MatrixMotion or EquationMotion
    slopes : Array, shape (p, samples, L), optional
        Overwritten.

    Returns
    -------
    tuple of Array, shape (p, samples), (samples, n)
        None if a state diverges.
    """
    if isinstance(motion, MatrixMotion):
        return _by_matrices(motion, slopes)
    return _by_steps(motion, slopes)


def _by_matrices(motion: MatrixMotion, slopes: Array | None) -> tuple[Array, Array] | None:
    """Do that by dx/dtheta[k+1] = Phi dx/dtheta[k] + d[Phi Gamma]/dtheta z[k] (EQUATIONS.md,
    eq. 25).
    """
    s = motion.model
    finite, z = simulate(s.step, motion.drive, s.start)
    if not finite:
        return None
    if slopes is not None:
        propagate(s.step, s.by_step, z, s.C, s.by_start, slopes)
        for own, by_row in zip(slopes, s.by_read, strict=True):
            free = np.flatnonzero(by_row.any(axis=0))
            own[:, free] += z @ by_row[:, free]
    return s.read @ z.T, z[:, : len(s.start)]


def _by_steps(motion: EquationMotion, slopes: Array | None) -> tuple[Array, Array] | None:
    """Do that by steps between samples.

    As Python the equations raise where the machine's numbers would be infinite or NaN.
    """
    given, p = motion.given, len(motion.offset)
    if slopes is None:
        given = given._replace(by_start=np.zeros((len(given.start), 0)))
    samples = len(given.inputs)
    x, y = np.empty((samples, len(given.start))), np.empty((samples, p))
    out = np.empty((p, samples, 0)) if slopes is None else slopes
    try:
        finite = motion.kernel(*given, x, y, out)
    except (ArithmeticError, ValueError):
        return None
    if not (finite and np.isfinite(y).all() and np.isfinite(out).all()):
        return None
    for j in np.flatnonzero(motion.offset_column >= 0) if slopes is not None else ():
        out[j, :, motion.offset_column[j]] += 1.0
    return np.ascontiguousarray(y.T) + motion.offset[:, None], x

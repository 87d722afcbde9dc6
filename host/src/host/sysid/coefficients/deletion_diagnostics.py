"""Single maneuvers against the joint fit: prediction by all others, and influence.

Both follow from the linear problem of the last Gauss-Newton step with some blocks deleted (Belsley,
Kuh & Welsch, Regression Diagnostics, 1980).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from host.arrays import Array
from host.sysid.coefficients.aero_equations import KINEMATIC
from host.sysid.coefficients.equation_blocks import EquationBlock, Unknowns, accumulate
from host.sysid.coefficients.normal_equations import ROUNDING, GaussNewtonStep
from host.sysid.coefficients.window_spectra import (
    AERO_TREND,
    ROUNDING_SHARE,
    EquationKey,
    WindowTransform,
    equation_weight,
)
from host.sysid.reconstruction.inverse_sensor_model import Spectrum

# Share of the information on each term that the other maneuvers must have.
LEAST_REMAINING_SHARE = 0.1


@dataclass(frozen=True, slots=True)
class FinalStep:
    """The linear problem of the last step of the search.

    Attributes
    ----------
    blocks : sequence of EquationBlock
    solution : GaussNewtonStep
    unknowns : Unknowns
    noise : mapping
        Frequency (Hz) and spectrum that the blocks are weighted by, by equation.
    spectra : mapping
        Response and regressors by equation and window, (F, 1 + terms).
    """

    blocks: Sequence[EquationBlock]
    solution: GaussNewtonStep
    unknowns: Unknowns
    noise: Mapping[str, tuple[Array, Array]]
    spectra: Mapping[EquationKey, Spectrum]


@dataclass(frozen=True, slots=True)
class CrossValidation:
    """Leave-one-out prediction of the maneuvers: NRMSE of each coefficient from 0.1 to 4.5 Hz.

    The prediction is one-step: measured angles, rates and surfaces enter it, gusts with them. Each
    maneuver keeps a constant and a slope in time of its own.

    Attributes
    ----------
    windows : tuple of int
        Maneuvers that could be left out.
    fitted : dict
        NRMSE of these maneuvers by the joint fit.
    left_out : dict
        NRMSE of each of them by the fit to all others, in the last step of the search; residual
        spectra and instrumental variables are those of the joint fit.
    """

    windows: tuple[int, ...]
    fitted: dict[str, float]
    left_out: dict[str, float]


def cross_validation(
    final: FinalStep, windows: Sequence[WindowTransform]
) -> CrossValidation | None:
    """Return how single maneuvers are predicted by all others; None if none can be left out."""
    left_out: list[int] = []
    sums: dict[str, Array] = {}
    information = _coefficient_information(final, final.blocks)
    for number, window in enumerate(windows):
        own = [block for block in final.blocks if block.window == number]
        # A maneuver that alone determines a term cannot be left out.
        remaining = information - _coefficient_information(final, own)
        if np.any(remaining < LEAST_REMAINING_SHARE * information):
            continue
        left_out.append(number)
        steps = final.solution.step, _step_without(final, own)
        for block in own:
            if block.equation not in KINEMATIC:
                squares = _sums_of_squares(final, block, window, steps)
                sums[block.equation] = sums.get(block.equation, np.zeros(3)) + squares
    if not left_out:
        return None
    fitted, predicted = (
        {name: float(np.sqrt(s[k] / s[2])) for name, s in sums.items()} for k in (0, 1)
    )
    return CrossValidation(tuple(left_out), fitted, predicted)


def _coefficient_information(final: FinalStep, blocks: Sequence[EquationBlock]) -> Array:
    """Return the sum of squares of the instrumental variables of every coefficient."""
    found = np.zeros(final.unknowns.count)
    for block in blocks:
        found[block.unknown_indices] += np.einsum("ij,ij->j", block.Z, block.Z)
    return found[: final.unknowns.coefficients]


def _step_without(final: FinalStep, deleted: Sequence[EquationBlock]) -> Array:
    """Return the step, (n,), with some blocks deleted from the normal equations."""
    less = accumulate(deleted, final.unknowns.count)
    matrix = final.solution.normal_matrix - less.matrix
    right_side = final.solution.right_side - less.right_side
    scale = 1.0 / np.sqrt(np.maximum(np.abs(np.diag(matrix)), ROUNDING))
    found: Array = scale * np.linalg.solve(matrix * np.outer(scale, scale), scale * right_side)
    return found


def _sums_of_squares(
    final: FinalStep, block: EquationBlock, window: WindowTransform, steps: tuple[Array, Array]
) -> Array:
    """Return sums of squares, (3,): residual after each of two steps, and response."""
    noise = final.noise.get(block.equation)
    weight = np.tile(equation_weight(window.frequency_hz, noise), 2)
    trends = window.trends[:, :AERO_TREND]
    response = final.spectra[block.equation, block.window][:, 0]
    trend = np.concatenate([trends.real, trends.imag])
    found = []
    for values in (
        *((block.y - block.A @ step[block.unknown_indices]) / weight for step in steps),
        np.concatenate([response.real, response.imag]),
    ):
        fitted_trend = trend @ np.linalg.lstsq(trend, values, rcond=ROUNDING_SHARE)[0]
        found.append(float(np.sum((values - fitted_trend) ** 2)))
    return np.array(found)


def maneuver_influence(
    final: FinalStep, windows: Sequence[WindowTransform], output_jacobian: Array
) -> tuple[Array, Array, Array]:
    """Return the influence of each maneuver on reported quantities.

    Parameters
    ----------
    final : FinalStep
    windows : sequence of WindowTransform
    output_jacobian : Array, shape (P, n)
        Derivative of the reported quantities by the unknowns.

    Returns
    -------
    influence : Array, shape (maneuvers, P)
        Part of each maneuver in the last step.
    information_share : Array, shape (maneuvers, P)
        Its part of the variance.
    variance : Array, shape (P,)
        From noise and gusts alone: errors common to all maneuvers (mass, places) are not in it.
    """
    gain = output_jacobian @ final.solution.inverse
    influence, share = (np.zeros((len(windows), len(output_jacobian))) for _ in range(2))
    for block in final.blocks:
        through = block.without_trend(block.Z) @ gain[:, block.unknown_indices].T
        influence[block.window] += block.residual_after(final.solution.step) @ through
        share[block.window] += np.einsum("ij,ij->j", through, through)
    return influence, share, np.sum(share, axis=0)

"""What sampling leaves open: an input between its samples.

A record says what an input was at its samples. Between them it was held, or moved on; the estimate
moves by the difference. How far the data go from one hold to the other they tell themselves: that
share is one more parameter beside the estimate. A smooth input bends beside its line, and one that
jumps does so at an instant of its own. Where that moves the estimate by more than a tenth of an
interval it is part of it. On records without noise it is most of it.

Surfaces that move between samples as servos do are those of `surface_motion`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy import special

from host.arrays import Array
from host.constants import NORMAL_95
from host.sysid.aerodynamics.coefficient_table import ShiftedEstimate
from host.sysid.errors.one_step import OneStep, Step, one_step_of
from host.sysid.models.fit_result import FitResult
from host.sysid.models.maneuver import Maneuver
from host.sysid.models.state_space_model import LinearModel
from host.sysid.models.templates import Trim
from host.sysid.numerics.between_samples import (
    OTHER_HOLD,
    likely_jumps,
    with_bent_controls,
    with_jump,
)

HOLD = "inputs between samples"
NEGLIGIBLE = 0.1  # of a half-width
ONE_STEP = 1.1  # times what one step of Gauss and Newton says: the next ones may add a tenth
NORMAL_99 = 2.576
ROUNDING = 1e-12  # of a variance
EVENLY_SD = 1.0 / np.sqrt(3.0)  # of a jump at any instant between two samples


def hold_shift(
    result: FitResult, maneuvers: Sequence[Maneuver], trim: Trim
) -> tuple[ShiftedEstimate, ...]:
    """Return the estimate moved by what lies between samples, one deviation of a normal error each.

    Nothing where that is less than a tenth of every half-width, or the method does not simulate.

    Parameters
    ----------
    result : FitResult
        Its half-widths count noise.
    maneuvers : sequence of Maneuver
        That were fitted.
    trim : Trim
    """
    if result.residual_kind not in ("output", "innovation") or any(
        y.shape != m.outputs.shape for y, m in zip(result.fitted, maneuvers, strict=True)
    ):
        return ()
    # Half a sample is no delay of a sensor: its bound does not hold here.
    delays = [d.name for d in result.model.delays]
    found = one_step_of(result, maneuvers, trim, delays)
    if found is None:
        return ()
    other = replace(result.model, hold=OTHER_HOLD[result.model.hold])
    whole = found.change(other, trim, maneuvers).sum(axis=0)
    step = ONE_STEP / NORMAL_95 * whole * _share(result, found, trim, maneuvers)
    steps = step[None, :]
    if np.any(np.abs(whole) > NEGLIGIBLE * result.half_width()):
        steps = np.vstack([steps, _bends_and_jumps(result, found, trim, maneuvers)])
    together = NORMAL_95 * np.sqrt(np.sum(steps**2, axis=0))
    if not np.any(together > NEGLIGIBLE * result.half_width()):
        return ()
    return tuple(ShiftedEstimate(HOLD, result.estimate + step, 1.0, 1.0) for step in steps)


def _bends_and_jumps(
    result: FitResult, found: OneStep, trim: Trim, maneuvers: Sequence[Maneuver]
) -> Array:
    """Return what inputs that bend or jump between samples move the estimate by, (k, P).

    One deviation each, beside the other hold and as far as the data leave it open. Jumps count by
    the odds that there were any.
    """
    model, wider = result.model, found.widened_in(result)
    smooth: list[tuple[LinearModel, Sequence[Maneuver]]] = [
        (replace(model, hold=OTHER_HOLD[model.hold]), maneuvers),
        (model, with_bent_controls(model, maneuvers)),
    ]
    jumps = likely_jumps(model, maneuvers)
    jumping = [*smooth, *((model, with_jump(maneuvers, j, model.hold)) for j in jumps)]
    prior_sd = np.array([1.0, 1.0, *(EVENLY_SD for _ in jumps)])
    bent = found.joint(model, trim, maneuvers, smooth, list(prior_sd[:2] / wider))
    jumped = found.joint(model, trim, maneuvers, jumping, list(prior_sd / wider))
    odds = _log_odds(jumped, prior_sd, wider) - _log_odds(bent, prior_sd[:2], wider)
    return np.vstack(
        [
            _likely_and_open(bent, slice(1, 2), wider),
            np.sqrt(special.expit(odds)) * _likely_and_open(jumped, slice(2, None), wider),
        ]
    )


def _likely_and_open(step: Step, chosen: slice, wider: float) -> Array:
    """Return what chosen parameters move the estimate by: their values, and what is open of them.

    One deviation each, (1 + k, P); `wider` is for noise that is not white.
    """
    value, vector = np.linalg.eigh(step.covariance[chosen, chosen])
    left_open = wider * np.sqrt(np.maximum(value, 0.0))[:, None] * vector.T
    likely = ONE_STEP / NORMAL_95 * step.added[chosen]
    return np.asarray(np.vstack([likely, left_open]) @ step.by_added[chosen])


def _log_odds(step: Step, prior_sd: Array, wider: float) -> float:
    """Return the log odds of further parameters to none of them.

    The ratio of marginal likelihoods (Kass & Raftery, J. Am. Stat. Assoc. 90, 1995).
    """
    value, vector = np.linalg.eigh(wider**2 * step.covariance / np.outer(prior_sd, prior_sd))
    value = np.clip(value, ROUNDING, 1.0)
    along = vector.T @ (step.added / prior_sd)
    return float(0.5 * np.sum(along**2 / value + np.log(value)))


def _share(result: FitResult, found: OneStep, trim: Trim, maneuvers: Sequence[Maneuver]) -> float:
    """Return how far from this hold to the other the input may have been: at most all the way.

    As far as the data say where they contradict this hold at 1 %; else by the odds of the other
    one. The deviation of the share counts noise as white; where an interval of the result is wider
    than that its own is widened alike.
    """
    other = replace(result.model, hold=OTHER_HOLD[result.model.hold])
    step = found.joint(result.model, trim, maneuvers, [(other, maneuvers)], [1.0])
    wider = found.widened_in(result)
    share, sd = float(step.added[0]), float(np.sqrt(max(step.covariance[0, 0], 0.0)) * wider)
    if abs(share) > NORMAL_99 * sd:
        return float(min(np.hypot(share, NORMAL_95 * sd), 1.0))
    odds = special.expit((share - 0.5) / max(sd, 1e-9) ** 2)
    return float(min(NORMAL_95 * np.sqrt(odds), 1.0))

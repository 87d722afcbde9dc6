"""Motion of surfaces between samples: as servos move, along lines, or held.

Where an instrument's file says how they were measured they move, kinks included (`input_kinks`). In
a table of others the data may say: how far from lines to that motion is one more parameter of white
output error, with its delays. Where they do not, and in gusts they do not, surfaces move as servos
do. A line cuts the bends of a servo off: at 50 Hz L_p is 0.8 % small by it and L_da 0.9 % large,
known to 0.7; at 100 Hz M_alpha is 0.4 % large, known to 1.4. For surfaces that are held (a
simulator without a servo) a line is half a sample early, and every sensor seems late: at 50 Hz the
IMU by all of its bound.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from host.constants import NORMAL_95
from host.errors import IdentificationError
from host.sysid.aerodynamics.coefficient_table import ShiftedEstimate
from host.sysid.errors.one_step import CERTAIN_SD, HALF_WAY, one_step_of
from host.sysid.errors.sampling_error import HOLD
from host.sysid.estimators.method_fit import fit
from host.sysid.flight.filter_step import others_recorded
from host.sysid.flight.flown_maneuver import FlownManeuver
from host.sysid.models.fit_result import FitResult
from host.sysid.models.maneuver import Maneuver
from host.sysid.models.state_space_model import LinearModel
from host.sysid.models.templates import Trim
from host.sysid.numerics.between_samples import OTHER_HOLD

# Share of what kinks do to the estimate, one deviation: a servo of second order and 60 rad/s has
# none, and passes for one of first order that does half as much.
KINK_SHARE = 0.5
LINES, SERVOS, HELD = "on lines", "as servos do", "held"
HELD_SURFACES = "surfaces were held from sample to sample, as the outputs show"
TINY = 1e-12
LATE_SD = 0.5  # samples: that much a delay that was estimated on lines has taken up at most


def surfaces_known(maneuvers: Sequence[FlownManeuver]) -> bool:
    """Return whether a file says how surfaces were measured, whether its sensors agree or not."""
    found = [m.flight.compatibility or m.flight.calibration_alone for m in maneuvers]
    return all(c is not None and c.instrument is not None for c in found)


def with_moving_surfaces(maneuvers: Sequence[FlownManeuver]) -> list[FlownManeuver]:
    """Return maneuvers whose surfaces move between samples; means of several are smooth already."""
    return [replace(m, surfaces_move=m.block == 1) for m in maneuvers]


def between_samples(
    used: Sequence[FlownManeuver], model: LinearModel, trim: Trim, *, behind: bool
) -> str:
    """Return how surfaces moved between samples: of a table of others as its outputs show it.

    As servos do where they show nothing: straight lines and steps of a surface stay as they are.

    Parameters
    ----------
    used : sequence of FlownManeuver
        That are fitted, their surfaces on lines.
    model : LinearModel
        With the delays that are estimated.
    trim : Trim
    behind : bool
        They were commanded, and stand behind a servo that was estimated.

    Returns
    -------
    str
        One of `LINES`, `SERVOS`, `HELD`.
    """
    if surfaces_known(used):
        return SERVOS
    if behind or not others_recorded(used):
        return LINES
    data = [m.cut(model) for m in used]
    try:
        result = fit("output-error-white", model, data, multiple_starts=False)
    except IdentificationError:
        return SERVOS
    found = one_step_of(result, data, trim, [d.name for d in model.delays])
    if found is None:
        return SERVOS
    bent = (model, [m.cut(model) for m in with_moving_surfaces(used)])
    held = (replace(model, hold=OTHER_HOLD[model.hold]), data)
    # Held surfaces jump, which also bends: what explains more is the motion.
    moved, jumped = (found.share_of(one, result, trim, data, 1.0) for one in (bent, held))
    if _whole_way(*jumped) > _whole_way(*moved):
        return HELD
    share, sd = moved
    return LINES if share + CERTAIN_SD * sd < HALF_WAY else SERVOS


def _whole_way(share: float, sd: float) -> float:
    """Return the deviations from lines to a motion if that is what the data show, else none."""
    return share / max(sd, TINY) if share > max(HALF_WAY, CERTAIN_SD * sd) else 0.0


def motion_shift(
    result: FitResult, maneuvers: Sequence[Maneuver], flown: Sequence[FlownManeuver], trim: Trim
) -> tuple[ShiftedEstimate, ...]:
    """Return the estimate moved by what the motion between samples leaves open, one deviation each.

    It is a share of what kinks do where surfaces move. Where they are on lines it is how far the
    data let them move, with a delay.

    Parameters
    ----------
    result : FitResult
    maneuvers : sequence of Maneuver
        That were fitted, delays taken out.
    flown : sequence of FlownManeuver
        The same, with surfaces that move or not.
    trim : Trim
    """
    found = one_step_of(result, maneuvers, trim)
    if found is None:
        return ()
    model = result.model
    moving = any(m.surfaces_move for m in flown)
    other = _on_lines(flown) if moving else with_moving_surfaces(flown)
    data = _with_inputs(maneuvers, other, model)
    if moving:
        steps = KINK_SHARE * found.change(model, trim, data)[None].sum(axis=1)
    else:
        wider = found.widened_in(result)
        directions = [(model, data), (model, _late(model, maneuvers))]
        step = found.joint(model, trim, maneuvers, directions, [1.0 / wider, LATE_SD / wider])
        variance = step.covariance[0, 0]
        by_share = step.covariance[0] / variance @ step.by_added  # the delay follows
        size = (step.added[0] / NORMAL_95, wider * np.sqrt(variance))
        steps = np.outer(size, by_share)
    return tuple(ShiftedEstimate(HOLD, result.estimate + step, 1.0, 1.0) for step in steps)


def _on_lines(flown: Sequence[FlownManeuver]) -> list[FlownManeuver]:
    return [replace(m, surfaces_move=False) for m in flown]


def _with_inputs(
    maneuvers: Sequence[Maneuver], flown: Sequence[FlownManeuver], model: LinearModel
) -> list[Maneuver]:
    """Return maneuvers with the inputs of others."""
    return [replace(m, inputs=f.cut(model).inputs) for m, f in zip(maneuvers, flown, strict=True)]


def _late(model: LinearModel, maneuvers: Sequence[Maneuver]) -> list[Maneuver]:
    """Return maneuvers whose controls are late by a sample, to first order."""
    late = np.array([name in model.controls() for name in model.inputs])
    return [
        replace(m, inputs=m.inputs - np.where(late, np.gradient(m.inputs, axis=0), 0.0))
        for m in maneuvers
    ]

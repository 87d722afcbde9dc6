"""Residual delays of each group of sensors, standard where a model names none; outputs without."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace

import numpy as np

from host.arrays import Array
from host.constants import CERTAIN_SD
from host.sysid.models.maneuver import Maneuver
from host.sysid.models.state_space_model import DelayGroup, LinearModel

# Prior deviation of the delay that remains of each sensor once the nominal one is removed, s.
STANDARD_DELAYS = (
    DelayGroup(
        "delay_vanes_s", ("alpha_rad", "beta_rad"), prior_sd_s=0.010, limit_s=CERTAIN_SD * 0.010
    ),
    DelayGroup(
        "delay_imu_s",
        ("p_radps", "q_radps", "r_radps", "ax_mps2", "ay_mps2", "az_mps2"),
        prior_sd_s=0.002,
        limit_s=0.01,
    ),
    DelayGroup(
        "delay_attitude_s", ("phi_rad", "theta_rad"), prior_sd_s=0.010, limit_s=CERTAIN_SD * 0.010
    ),
    DelayGroup("delay_pitot_s", ("airspeed_mps",), prior_sd_s=0.015, limit_s=0.05),
)
# Vanes of others have a delay that nobody removed: 10 to 40 ms behind the gyro of the same row.
OTHERS_DELAYS = (
    replace(STANDARD_DELAYS[0], prior_sd_s=0.020, limit_s=CERTAIN_SD * 0.020),
    *STANDARD_DELAYS[1:],
)


def delays_of(
    outputs: Iterable[str], groups: Iterable[DelayGroup] = STANDARD_DELAYS
) -> tuple[DelayGroup, ...]:
    """Return the delay groups with only these outputs; groups without any are left out."""
    present = set(outputs)
    return tuple(
        DelayGroup(d.name, concerned, d.prior_sd_s, d.limit_s)
        for d in groups
        if (concerned := tuple(y for y in d.outputs if y in present))
    )


def without_standard_delays(model: LinearModel) -> LinearModel:
    """Return a model without the standard delays, with those of its own."""
    standard = delays_of(model.outputs)
    return replace(model, delays=tuple(d for d in model.delays if d not in standard))


def advance_outputs(
    maneuver: Maneuver, model: LinearModel, delays_s: Mapping[str, float]
) -> Maneuver:
    """Return the maneuver with each output advanced by its delay."""
    shifts = {o: delays_s[d.name] for d in model.delays if d.name in delays_s for o in d.outputs}
    return moved_outputs(maneuver, np.array([shifts.get(name, 0.0) for name in model.outputs]))


def moved_outputs(maneuver: Maneuver, shifts_s: Array) -> Maneuver:
    """Return the maneuver with each output earlier by a time, (p,) s.

    At which samples it was measured moves along, to the nearest one.
    """
    t, rows = maneuver.time_s, np.arange(maneuver.samples)
    columns = [np.interp(t + s, t, y) for s, y in zip(shifts_s, maneuver.outputs.T, strict=True)]
    if maneuver.sampled is None:
        return replace(maneuver, outputs=np.column_stack(columns))
    sampled = np.ones_like(maneuver.sampled)
    for j, steps in enumerate(np.round(shifts_s / maneuver.dt_s).astype(np.int64)):
        if not maneuver.sampled[:, j].all():
            before = rows + steps
            known = (before >= 0) & (before < len(rows))
            sampled[:, j] = known & maneuver.sampled[np.where(known, before, 0), j]
    return replace(maneuver, outputs=np.column_stack(columns), sampled=sampled)

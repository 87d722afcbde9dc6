"""What departures from a trim need and nobody measured.

A table of one axis lacks the columns of the other. Left out, everything that airspeed does passes
for noise: by a trainer's 3-2-1-1s in calm air M_q is known to 43 % and nothing of its forces is
trusted; with wings level in place of what is missing M_q is known to 2 %. An angle without a vane
is what its accelerometer says at the model that was fitted.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from host.arrays import Array
from host.constants import GRAVITY_MPS2
from host.sysid.models.state_space_model import LinearModel
from host.sysid.models.templates import Trim

ACCELEROMETER_OF = {"alpha_rad": "az_mps2", "beta_rad": "ay_mps2"}
SYMMETRIC = ("beta_rad", "p_radps", "q_radps", "r_radps", "phi_rad", "ay_mps2")


def with_unmeasured(
    columns: Mapping[str, Array], model: LinearModel, estimate: Array, trim: Trim
) -> dict[str, Array]:
    """Return the columns of a maneuver, those that departures need and that are missing added.

    Parameters
    ----------
    columns : mapping
    model : LinearModel
        That was fitted.
    estimate : Array
        Estimate of its parameters, these first.
    trim : Trim
        Trim of steady flight in place of what nobody measured; wings bank by the rolling measured.
    """
    found = {**_angles_by_force(columns, model, estimate), **columns}
    still = np.zeros(len(columns["t_s"]))
    path_rad = trim.theta_rad - trim.alpha_rad
    along, normal = GRAVITY_MPS2 * np.sin(path_rad), -GRAVITY_MPS2 * np.cos(path_rad)
    sine, cosine = np.sin(trim.alpha_rad), np.cos(trim.alpha_rad)
    alpha = found.get("alpha_rad", still + trim.alpha_rad)
    steady = dict.fromkeys(SYMMETRIC, still) | {
        "airspeed_mps": still + trim.airspeed_mps,
        "alpha_rad": alpha,
        "theta_rad": alpha + path_rad,
        "ax_mps2": still + along * cosine - normal * sine,
        "az_mps2": still + along * sine + normal * cosine,
    }
    if "p_radps" in columns:
        rolled = 0.5 * (columns["p_radps"][1:] + columns["p_radps"][:-1])
        steady["phi_rad"] = np.append(0.0, np.cumsum(rolled * np.diff(columns["t_s"])))
    return steady | found


def _angles_by_force(
    columns: Mapping[str, Array], model: LinearModel, estimate: Array
) -> dict[str, Array]:
    """Return the angles that are states and were not measured, of which an output is a force."""
    _, _, C, D = model.matrices(estimate)
    needed = {*model.states, *model.inputs}
    angles = {}
    for angle, force in ACCELEROMETER_OF.items():
        others = needed - {angle}
        if angle in columns or angle not in model.states or force not in model.outputs:
            continue
        if not others <= columns.keys():
            continue
        row, at = model.outputs.index(force), model.states.index(angle)
        rest = np.array(columns[force])
        for gains, names in ((C[row], model.states), (D[row], model.inputs)):
            rest -= sum(
                gain * columns[name]
                for gain, name in zip(gains, names, strict=True)
                if name in others
            )
        rest -= np.mean(rest)
        if C[row, at] != 0.0:
            angles[angle] = rest / C[row, at]
    return angles

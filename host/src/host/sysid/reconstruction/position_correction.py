"""Transfer of vanes and accelerometers to the CG."""

from __future__ import annotations

import numpy as np

from host.aircraft.mass_properties import AirframeData
from host.arrays import Array


def transfer_to_cg(columns: dict[str, Array], airframe: AirframeData) -> dict[str, Array]:
    """Return columns with vanes and accelerometers moved to the CG.

    The air at a vane at r moves by omega x r relative to that at the CG, and upwash increases its
    angle (EQUATIONS.md, eq. 13). An accelerometer at r measures omega' x r + omega x (omega x r)
    more than at the CG (eq. 14). The mean of the vanes is corrected for the mean of their
    positions: roll cancels between two tips.

    Parameters
    ----------
    columns : dict of Array, shape (n,)
        SI; missing rates count as zero.
    airframe : AirframeData
        Positions of the sensors from the CG, m, and upwash.
    """
    result = dict(columns)
    zero = np.zeros(len(columns["t_s"]))  # a record of one axis has not all rates
    rates = [columns.get(f"{a}_radps", zero) for a in "pqr"]
    p, q, r = rates
    if airframe.vanes_m and "airspeed_mps" in columns:  # an angle of so many m/s of the vane
        x, y, z = np.mean(airframe.vanes_m, axis=0)
        speed = np.maximum(columns["airspeed_mps"], 1.0)
        if "alpha_rad" in columns:
            result["alpha_rad"] = (
                columns["alpha_rad"] / (1.0 + airframe.upwash) + (q * x - p * y) / speed
            )
        if "beta_rad" in columns:
            result["beta_rad"] = columns["beta_rad"] - (r * x - p * z) / speed
    if any(airframe.imu_m):
        x, y, z = airframe.imu_m
        dt_s = float(np.median(np.diff(columns["t_s"])))
        dp, dq, dr = (np.gradient(rate, dt_s) for rate in rates)
        lever_arm_acceleration = {
            "ax_mps2": dq * z - dr * y + q * (p * y - q * x) - r * (r * x - p * z),
            "ay_mps2": dr * x - dp * z + r * (q * z - r * y) - p * (p * y - q * x),
            "az_mps2": dp * y - dq * x + p * (r * x - p * z) - q * (q * z - r * y),
        }
        result |= {
            name: columns[name] - offset
            for name, offset in lever_arm_acceleration.items()
            if name in columns
        }
    return result

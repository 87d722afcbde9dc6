"""Where no vane measured the angle of attack, it turns with a tilted IMU."""

from __future__ import annotations

import numpy as np
import pytest
from host.constants import NORMAL_95
from host.sysid import Maneuver, fit
from host.sysid.errors import systematic_error_shifts
from host.sysid.models import Trim, template
from host.sysid.models.reduced_model import without_outputs
from host.sysid.numerics import OutputProblem
from host.sysid.reconstruction import Compatibility, SensorErrorEstimate

TRIM = Trim(17.0, 0.08, 0.08)
TILT = 0.02
TRUE = {
    "Y_beta": -0.4, "Y_p": 0.02, "Y_r": 0.01, "Y_da": 0.02, "Y_dr": 0.2,
    "L_beta": -25.0, "L_p": -20.0, "L_r": 5.0, "L_da": 300.0, "L_dr": 1.0,
    "N_beta": 33.0, "N_p": -0.6, "N_r": -1.4, "N_da": 1.5, "N_dr": -30.0,
}  # fmt: skip


def test_a_tilt_without_a_vane_is_roll_in_yaw() -> None:
    """All that an autopilot senses turns with its IMU, and so do the derivatives: N_p by L_p."""
    model = template("lateral", TRIM)
    model = without_outputs(model, ("beta_rad",))
    t, u = 0.01 * np.arange(800), np.zeros((800, 2))
    u[50:90, 0], u[90:130, 0], u[300:340, 1], u[340:380, 1] = 0.05, -0.05, 0.1, -0.1
    problem = OutputProblem(model, [Maneuver(0.01, u, np.zeros((800, len(model.outputs))))])
    theta = problem.first_guess()
    theta[: len(model.parameters)] = [TRUE[p.name] for p in model.parameters]
    [y] = problem.outputs(theta) or []
    noise = 0.01 * y.std(axis=1) * np.random.default_rng(4).standard_normal(y.T.shape)
    maneuver = Maneuver(0.01, u, y.T + noise)
    rows = {"t_s": t, "theta_rad": np.full(800, 0.08), "airspeed_mps": np.full(800, 17.0)}
    rows |= dict.fromkeys(("q_radps", "ax_mps2"), np.zeros(800)) | {"az_mps2": np.full(800, -9.8)}
    rows |= dict(zip(model.outputs, maneuver.outputs.T, strict=True))
    result = fit("output-error-white", model, [maneuver], multiple_starts=False)
    known = Compatibility((_open("imu_tilt_y_rad"), _open("pitot_scale")), {}, (), gps=True)
    shifts = systematic_error_shifts(result, [maneuver], [rows], [known], TRIM)
    [moved] = [one for one in shifts if one.error == "imu_tilt_y_rad"]
    change = moved.estimate - result.estimate
    for name, turned in _turned_by_tilt().items():
        allowed = 0.05 * abs(turned) + 1e-3 * abs(TRUE[name])
        assert change[result.index(name)] == pytest.approx(turned, abs=allowed), name


def _open(name: str) -> SensorErrorEstimate:
    half = NORMAL_95 * TILT
    return SensorErrorEstimate(name, 0.0, half, half, data_informed=False, reason="")


def _turned_by_tilt() -> dict[str, float]:
    """Return the change of each moment derivative where axes are turned back about y.

    p = p_imu + tilt r_imu, r = r_imu - tilt p_imu.
    """
    labels = ("beta", "p", "r", "da", "dr")
    rows = np.array([[TRUE[f"{row}_{label}"] for label in labels] for row in "LN"])
    turn = TILT * np.array([[0.0, 1.0], [-1.0, 0.0]])
    change = turn @ rows
    change[:, 1:3] -= rows[:, 1:3] @ turn
    return {
        f"{row}_{label}": float(change[i, k])
        for i, row in enumerate("LN")
        for k, label in enumerate(labels)
    }

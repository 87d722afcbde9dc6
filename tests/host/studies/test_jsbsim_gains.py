"""The hold in JSBSim: signs, servo and law of the study, by a flight of its own."""

from __future__ import annotations

import numpy as np
import pytest
from host.control.uncertain_axis import UncertainAxis
from host.sysid.models import Trim
from studies.jsbsim_gains import CASES, STEPS_RAD, closed_loop, problem_of, record

AT = Trim(54.0, 0.01, 0.01)
# Answer of a c172p by shares of command, as a record of it said.
ROLL = UncertainAxis("roll", "roll", AT, ("L_p", "L_da"), np.array([-6.2, 8.9]), np.zeros((2, 2)))
PITCH = UncertainAxis(
    "pitch", "short-period", AT, ("Z_alpha", "M_alpha", "M_q", "M_de"),
    np.array([-3.0, -36.0, -5.6, -11.4]), np.zeros((4, 4)),
)  # fmt: skip
TUNED = {
    "roll": (problem_of(ROLL), {"P": 4.0, "I": 1.3, "D": 0.6}),
    "pitch": (problem_of(PITCH), {"P": 2.5, "I": 0.8, "D": 0.1}),
}


@pytest.mark.parametrize("axis", ["roll", "pitch"])
def test_a_hold_goes_where_it_is_asked_and_the_other_axis_stays(axis: str) -> None:
    flown = closed_loop(CASES[0], TUNED, 9.0, step=axis)
    share = (flown.angle_rad[axis] - flown.angle_rad[axis][0]) / STEPS_RAD[axis]
    assert share[-1] == pytest.approx(1.0, abs=0.15)
    assert np.max(share) < 1.3
    other = {"roll": "pitch", "pitch": "roll"}[axis]
    assert np.max(np.abs(flown.angle_rad[other] - flown.angle_rad[other][0])) < 0.03


def test_a_record_moves_one_surface_at_a_time_and_comes_home() -> None:
    columns = record(CASES[0], 3)
    assert np.allclose(np.diff(columns["t_s"]), 0.02)
    assert np.max(np.abs(columns["phi_rad"])) < 0.6
    assert np.abs(np.mean(columns["airspeed_mps"][-100:]) - AT.airspeed_mps) < 8.0

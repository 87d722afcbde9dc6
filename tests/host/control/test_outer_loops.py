"""Loops around tuned gains, against loops that are worked by hand."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from host.control.actuator import Actuator
from host.control.autopilots.known import AUTOPILOTS
from host.control.margins import Spectra, margins
from host.control.outer_loops import (
    OuterLoop,
    arduplane_loops,
    check,
    encircles_nothing,
    height_loop,
    path_loop,
    px4_height_loop,
    px4_loops,
)
from host.control.scenarios import Problem
from host.control.uncertain_axis import UncertainAxis
from host.sysid.models import Trim

W = np.geomspace(1e-3, 20.0, 800)
S: Spectra = 1j * W
AT_ONCE: Spectra = np.ones((1, len(W)), dtype=complex)
DERIVATIVES = {
    "Y_beta": -0.5, "L_beta": -30.0, "L_p": -15.0, "L_r": 3.0, "L_da": 200.0,
    "N_beta": 30.0, "N_p": -0.5, "N_r": -1.0, "N_da": -4.0,
}  # fmt: skip


def test_a_path_followed_at_once_has_the_phase_of_its_damping() -> None:
    # (w^2 + 2 z w s) / s^2: |L| = 1 at w sqrt(2 z^2 + sqrt(4 z^4 + 1)), phase atan of 2 z times it.
    for damping in (0.5, 0.75, 1.0):
        loop = path_loop(17.0, damping, 0.0)(15.0, W, {"angle": AT_ONCE})
        at = math.sqrt(2.0 * damping**2 + math.sqrt(4.0 * damping**4 + 1.0))
        found = margins(loop, W)
        assert found.crossover_radps[0] == pytest.approx(2.0 * math.pi / 17.0 * at, rel=1e-3)
        by_hand = math.degrees(math.atan(2.0 * damping * at))
        assert found.phase_deg[0] == pytest.approx(by_hand, abs=0.05)


def test_height_at_constant_speed_is_that_of_pitch_alone() -> None:
    # The path follows pitch: (1 + d) / (T s) + d + I / s + I / (T s^2).
    still = {"theta_rad": AT_ONCE, "alpha_rad": 0.0 * AT_ONCE,
             "airspeed_mps": 0.0 * AT_ONCE}  # fmt: skip
    found = height_loop(5.0, 0.3, 0.2)(15.0, W, still)
    by_hand = 1.3 / (5.0 * S) + 0.3 + 0.2 / S + 0.2 / (5.0 * S**2)
    assert np.max(np.abs(found[0] / by_hand - 1.0)) < 1e-12


TECS = {"FW_T_ALT_TC": 4.0, "FW_T_TAS_TC": 6.0, "FW_T_PTCH_DAMP": 0.2, "FW_T_I_GAIN_PIT": 0.1,
        "FW_T_SEB_R_FF": 0.9, "FW_T_SPDWEIGHT": 1.0}  # fmt: skip
FILTER = {"FW_T_SPD_STD": 0.2, "FW_T_SPD_DEV_STD": 0.2, "FW_T_SPD_PRC_STD": 0.2}


def test_px4s_height_at_constant_speed_is_that_of_pitch_alone() -> None:
    # The path follows pitch: (1 + 1 / (T s)) (d + I / s) + ff / (T s).
    still = {"theta_rad": AT_ONCE, "alpha_rad": 0.0 * AT_ONCE,
             "airspeed_mps": 0.0 * AT_ONCE}  # fmt: skip
    found = px4_height_loop(TECS, FILTER)(15.0, W, still)
    by_hand = (1.0 + 1.0 / (4.0 * S)) * (0.2 + 0.1 / S) + 0.9 / (4.0 * S)
    assert np.max(np.abs(found[0] / by_hand - 1.0)) < 1e-12
    # A weight of 2 leaves height alone.
    speed_only = px4_height_loop({**TECS, "FW_T_SPDWEIGHT": 2.0}, FILTER)(15.0, W, still)
    assert np.max(np.abs(speed_only)) == 0.0


def test_px4s_speed_comes_through_its_filter_step_by_step() -> None:
    # Only the speed moves: a sine, through the filter's own update at 1 kHz and the law behind it.
    w, dt, speed = 0.8, 1e-3, 15.0
    sine = {"theta_rad": 0.0 * AT_ONCE[:, :1], "alpha_rad": 0.0 * AT_ONCE[:, :1],
            "airspeed_mps": AT_ONCE[:, :1]}  # fmt: skip
    found = px4_height_loop({**TECS, "FW_T_I_GAIN_PIT": 0.0}, FILTER)(speed, np.array([w]), sine)
    # Gains of three deviations of 0.2 by hand: 5 sqrt(3) / 10, 1/2, 1/2, 5 sqrt(3) / 10.
    gain = np.array([[0.5 * math.sqrt(3.0), 0.5], [0.5, 0.5 * math.sqrt(3.0)]])
    t = dt * np.arange(round(20.0 * 2.0 * math.pi / w / dt))
    state, told = np.zeros(2), np.empty((len(t), 2))
    for k, now in enumerate(t):
        told[k] = state
        off = np.array([math.sin(w * now), w * math.cos(w * now)]) - state - [dt * state[1], 0.0]
        state = state + [dt * state[1], 0.0] + dt * gain @ off
    asked = -speed * told[:, 0] / 6.0
    pitch = ((asked - speed * told[:, 1]) * 0.2 + 0.9 * asked) / (speed * 9.80665)
    last = slice(-round(2.0 * math.pi / w / dt), None)
    by_hand = 2j * np.mean(pitch[last] * np.exp(-1j * w * t[last]))
    assert found[0, 0] == pytest.approx(by_hand, rel=0.01)


@pytest.mark.parametrize(
    ("loop", "stable"),
    [
        (5.9 / (S * (S + 1) * (S + 2)), True),  # Routh: below 6
        (6.1 / (S * (S + 1) * (S + 2)), False),
        (0.6 * (S + 1) ** 2 / S**3, True),  # Routh: above 1/2
        (0.4 * (S + 1) ** 2 / S**3, False),
        (1.0 / S**2 * (0.1 * S + 1.0), True),
        (-1.0 / (S + 2.0) ** 2, True),  # below 4
        (-5.0 / (S + 2.0) ** 2, False),
        (0.9 * np.pi / 2.0 * np.exp(-S) / S, True),  # a delay of 1 s allows pi / 2
        (1.1 * np.pi / 2.0 * np.exp(-S) / S, False),
    ],
)
def test_stability_is_told_from_the_loop_alone(loop: Spectra, stable: bool) -> None:
    assert bool(encircles_nothing(loop[None], W)[0]) is stable


def rolling(share: float = 0.05) -> tuple[Problem, dict[str, float]]:
    mean = np.array(list(DERIVATIVES.values()))
    axis = UncertainAxis("roll", "lateral", Trim(15.0, 0.05, 0.05), tuple(DERIVATIVES), mean,
                         np.diag((share * mean / 1.96) ** 2))  # fmt: skip
    structure = AUTOPILOTS["ardupilot"].structure("roll", {}, 15.0)
    drive = Actuator("aileron", 0.4, 0.03, 8.0, 0.1, 4.0, 0.01, 0.005)
    gains = structure.completed({"P": 0.08, "D": 0.0, "TC": 0.5}, 0.12)
    return Problem(axis, drive, structure, (12.0, 15.0), 1.3), gains


def test_a_path_that_is_much_slower_than_the_roll_holds_and_a_fast_one_does_not() -> None:
    problem, gains = rolling()
    (path, _) = arduplane_loops({})
    usual = check(path, problem, gains, 1)
    assert usual.stable
    assert usual.gain_db > 12.0
    # A slow roll loop in the way: a delay that closed loop and update make, by hand.
    nominal = replace(problem, axis=replace(problem.axis, covariance=0.0 * problem.axis.covariance))
    one = check(path, nominal, gains, 1)
    ideal = margins(path.loop(15.0, W, {"angle": AT_ONCE}), W)
    late_s = 0.5 + 0.05 + 0.02  # TCONST, half an update, servo
    lost_deg = math.degrees(late_s * ideal.crossover_radps[0])
    assert one.phase_deg == pytest.approx(ideal.phase_deg[0] - lost_deg, abs=8.0)
    fast = OuterLoop("path", "roll", {"NAVL1_PERIOD": 2.5}, path_loop(2.5, 0.75, 0.02))
    told = check(fast, problem, gains, 1)
    assert not told.stable
    assert "slow it down: NAVL1_PERIOD 2.5" in told.line


def test_a_log_has_its_own_and_npfg_keeps_its_least_period() -> None:
    (path, height) = arduplane_loops({"NAVL1_PERIOD": 12.0, "TECS_TIME_CONST": 3.0})
    assert (path.parameters["NAVL1_PERIOD"], path.parameters["NAVL1_DAMPING"]) == (12.0, 0.75)
    assert height.parameters["TECS_TIME_CONST"] == 3.0
    at_once = {"angle": AT_ONCE}
    # pi x 0.5 / 0.7 = 2.24 s is the least.
    short, _ = px4_loops({"NPFG_PERIOD": 1.0})
    least = path_loop(math.pi * 0.5 / 0.7, 0.7, 0.0)
    assert np.array_equal(short.loop(15.0, W, at_once), least(15.0, W, at_once))

"""Plants, laws and margins against closed forms and python-control."""

from __future__ import annotations

import math
import re

import control
import numpy as np
import pytest
from host.arrays import Array
from host.control import ControlError, release_in
from host.control.autopilots import ardupilot, inav, mega, px4
from host.control.autopilots.known import AUTOPILOTS
from host.control.autopilots.structure import state_space
from host.control.margins import FAR_DB, margins
from host.control.plant import continuous, sampled
from host.control.releases import called, release_note
from host.control.scenarios import law_response


def test_margins_of_a_loop_that_is_worked_by_hand() -> None:
    # L = k / (s (s + 1) (s + 2)): phase -180 degrees at sqrt(2), where |L| = k / 6.
    w = np.geomspace(0.01, 100.0, 4000)
    s = 1j * w
    found = margins(np.array([k / (s * (s + 1) * (s + 2)) for k in (1.5, 3.0)]), w)
    assert found.gain_db == pytest.approx([20 * math.log10(4.0), 20 * math.log10(2.0)], abs=0.01)
    at = found.crossover_radps
    own = 90.0 - np.rad2deg(np.arctan(at) + np.arctan(at / 2.0))
    assert found.phase_deg == pytest.approx(own, abs=0.01)
    assert at * np.hypot(at, 1.0) * np.hypot(at, 2.0) == pytest.approx([1.5, 3.0], rel=1e-3)


def test_a_gain_that_must_not_fall_counts_as_a_gain_margin() -> None:
    # L = 2 (s + 1)^2 / s^3: phase -180 degrees at 1 rad/s, where |L| = 4; less than 1 is unstable.
    w = np.geomspace(1e-2, 100.0, 4000)
    s = 1j * w
    found = margins((2.0 * (s + 1) ** 2 / s**3)[None], w)
    assert found.gain_db[0] == pytest.approx(20 * math.log10(4.0), abs=0.01)


def test_a_loop_that_never_comes_near_has_no_margin_to_print() -> None:
    w = np.geomspace(0.01, 100.0, 400)
    assert margins(0.1 / (1j * w + 1.0)[None], w).gain_db[0] == FAR_DB


@pytest.mark.parametrize("delay_s", [0.0, 0.004, 0.02, 0.033])
def test_a_sampled_plant_is_that_of_its_own_hold_and_delay(delay_s: float) -> None:
    a, b = np.array([[-20.0]]), np.array([[300.0]])
    system = continuous("roll", (a, b, ("p_radps",)), 0.4, 8.0, 20.0, 1.0)
    plant = sampled(system, delay_s, 0.02)
    # Fine steps of an eighth of a millisecond, whose delay is whole: an integration of its own.
    fine = control.c2d(control.ss(*system, np.zeros((2, 1))), 1.25e-4)
    rng = np.random.default_rng(5)
    out = rng.standard_normal(40)
    held = np.repeat(out, 160)
    late = round(delay_s / 1.25e-4)
    driven = np.concatenate([np.zeros(late), held])[: len(held)]
    seen = control.forced_response(fine, inputs=driven).outputs[:, ::160]
    state, own = np.zeros(len(plant.a)), []
    for u in out:
        own.append(plant.c @ state)
        state = plant.a @ state + plant.b[:, 0] * u
    np.testing.assert_allclose(np.array(own).T, seen, atol=1e-8)


def test_arduplane_holds_a_rate_by_feed_forward_alone() -> None:
    fixed = {**ardupilot.structure("roll", {}, 15.0).fixed, "FLTT_hz": 0.0}
    loop = ardupilot.ArduPlaneLoop({"P": 0.0, "I": 0.0, "D": 0.0, "FF": 0.2, "TC": 0.5}, 0.8, fixed)
    _, out = loop.step(np.zeros(4), np.array(0.1), np.array(0.0))
    # 0.2 rad/s asked: FF T / s with T = s^2 w gives 0.2 x 0.8 x 0.2 of pi / 4.
    assert float(out) == pytest.approx(0.2 * 0.8 * 0.2 / (math.pi / 4.0))


GAINS = {
    "ardupilot": {"P": 0.15, "I": 0.2, "D": 0.004, "FF": 0.3, "TC": 0.45},
    "px4": {"P": 0.15, "I": 0.2, "D": 0.01, "FF": 0.3, "TC": 0.45},
    "inav": {"P": 9.0, "I": 7.0, "D": 3.0, "FF": 50.0},
    "mega": {"P": 0.64, "I": 0.2, "D": 0.07},
}


@pytest.mark.parametrize("autopilot", AUTOPILOTS)
def test_the_law_that_is_analysed_is_the_one_that_flies(autopilot: str) -> None:
    logged = {"PTCH_RATE_FLTE": 5.0}
    loop = AUTOPILOTS[autopilot].structure("pitch", logged, 15.0).loop(GAINS[autopilot], 18.0)
    a, b, c, d = state_space(loop)
    rng = np.random.default_rng(2)
    state: Array = np.zeros(loop.states)
    own: Array = np.zeros(loop.states)
    for _ in range(200):
        angle, rate = rng.standard_normal(2)
        state, flown = loop.step(state, np.array(-angle), np.array(rate))
        linear = float((c @ own + d @ [angle, rate])[0])
        own = a @ own + b @ [angle, rate]
        assert linear == pytest.approx(float(flown), rel=1e-9, abs=1e-12)


@pytest.mark.parametrize(
    ("autopilot", "logged", "limit"),
    [
        ("ardupilot", {"RLL_RATE_IMAX": 0.2}, 0.2 / (math.pi / 4.0)),
        ("ardupilot", {}, 0.666 / (math.pi / 4.0)),
        ("px4", {"FW_RR_IMAX": 0.15}, 0.15),
        ("inav", {"pid_iterm_limit_percent": 20.0}, 0.2),
    ],
)
def test_an_integral_stays_within_the_limit_of_the_log(
    autopilot: str, logged: dict[str, float], limit: float
) -> None:
    loop = AUTOPILOTS[autopilot].structure("roll", logged, 15.0).loop(GAINS[autopilot], 15.0)
    state: Array = np.zeros(loop.states)
    for _ in range(round(60.0 / loop.period_s)):  # a minute of a bank that does not come
        state, held = loop.step(state, np.array(0.5), np.array(0.0))
    no_integral = AUTOPILOTS[autopilot].structure("roll", logged, 15.0)
    other = no_integral.loop({**GAINS[autopilot], "I": 0.0}, 15.0)
    rest: Array = np.zeros(other.states)
    for _ in range(round(10.0 / other.period_s)):
        rest, without = other.step(rest, np.array(0.5), np.array(0.0))
    assert float(held) - float(without) == pytest.approx(limit, rel=1e-6)


def test_px4_multiplies_gains_by_the_square_of_its_speed_scale_and_feed_forward_by_it() -> None:
    law = px4.structure("roll", {"FW_AIRSPD_TRIM": 15.0}, 15.0)
    gains = {"P": 0.2, "I": 0.0, "D": 0.0, "FF": 0.5, "TC": 0.4}
    _, out = law.loop(gains, 30.0).step(np.zeros(3), np.array(0.2), np.array(0.1))
    # 0.5 rad/s asked, 0.1 flown, scale 1/2: 0.25 x 0.2 x 0.4 + 0.5 x 0.5 x 0.5.
    assert float(out) == pytest.approx(0.25 * 0.2 * 0.4 + 0.5 * 0.5 * 0.5)


def test_px4_integrates_behind_its_output() -> None:
    law = px4.structure("roll", {}, 15.0).loop({**GAINS["px4"], "P": 0, "D": 0, "FF": 0}, 15.0)
    state, first = law.step(np.zeros(3), np.array(0.45), np.array(0.0))
    _, second = law.step(state, np.array(0.45), np.array(0.0))
    assert float(first) == 0.0
    assert float(second) == pytest.approx(0.2 * 1.0 / 400.0)


def test_two_ailerons_of_half_a_torque_each_are_full_travel() -> None:
    usual = {"CA_SV_CS0_TRQ_R": -0.5, "CA_SV_CS1_TRQ_R": 0.5, "CA_SV_CS2_TRQ_P": 1.0}
    assert px4.share_per_torque("roll", usual) == pytest.approx(1.0)
    assert px4.share_per_torque("pitch", usual) == pytest.approx(1.0)
    # Twice the effectiveness is half the travel.
    assert px4.share_per_torque("roll", {k: 2.0 * v for k, v in usual.items()}) == 0.5


def test_inav_holds_a_rate_by_its_documented_divisors() -> None:
    law = inav.structure("roll", {"fw_i_level": 0.0}, 15.0)
    loop = law.loop({"P": 31.0, "I": 0.0, "D": 0.0, "FF": 62.0}, 15.0)
    state: Array = np.zeros(loop.states)
    for _ in range(1000):  # a second: the biquad before the servo has settled
        state, out = loop.step(state, np.array(0.1), np.array(0.05))
    demand, rate = np.rad2deg(0.1) * 20 / 6.56, np.rad2deg(0.05)
    assert float(out) == pytest.approx(((demand - rate) + 2.0 * demand) / 500.0, rel=1e-6)


def test_the_hold_answers_late_in_angles_of_the_surface() -> None:
    loop = mega.structure("roll", {}, 15.0).loop({"P": 0.5, "I": 0.2, "D": 0.1}, 15.0)
    state, first = loop.step(np.zeros(4), np.array(0.3), np.array(0.0))
    state, second = loop.step(state, np.array(9.0), np.array(0.4))
    _, third = loop.step(state, np.array(9.0), np.array(9.0))
    assert (float(first), float(second)) == (0.0, 0.0)
    assert float(third) == pytest.approx(0.5 * 0.3 + 0.2 * 0.3 * 0.005 - 0.1 * 0.4)


def test_the_hold_of_a_roll_axis_has_the_loop_that_is_written_by_hand() -> None:
    # (P + I/s + D s) L_da / (s (s - L_p)) behind servo, hold, 10 ms and a sample 5 ms old; the
    # rate behind its filter, the angle 5 ms late in its place.
    law = mega.structure("roll", {}, 15.0)
    gains = {"P": 0.4, "I": 0.13, "D": 0.06}
    w = np.geomspace(0.3, 60.0, 100)
    dynamics = (np.array([[-10.0]]), np.array([[150.0]]), ("p_radps",))
    system = continuous("roll", dynamics, mega.FULL_RAD, 8.0, 42.0, 1.0)
    seen = sampled(system, 0.01, 0.005).response(w)
    by_angle, by_rate = law_response(law.loop(gains, 15.0), w)
    own = -(by_angle * seen[:, 0] + by_rate * seen[:, 1])
    s, corner, lag = 1j * w, 2 * np.pi * 42.0, 2 * np.pi * 8.0
    filtered = corner**2 / (s**2 + math.sqrt(2.0) * corner * s + corner**2)
    late = np.exp(-s * (0.01 + 0.005 + 0.5 * 0.005)) * lag / (s + lag)
    angle, rate = (0.4 + 0.13 / s) * np.exp(-0.005 * s), 0.06 * s * filtered
    by_hand = (angle + rate) * 150.0 / (s * (s + 10.0)) * late
    np.testing.assert_allclose(own, by_hand, rtol=0.02)
    # Its margins, by python-control from the formula.
    found = margins(own[None], w)
    phase = np.rad2deg(np.unwrap(np.angle(by_hand)))
    gain, turned, *_ = control.margin((np.abs(by_hand), phase, w))
    assert found.gain_db[0] == pytest.approx(20.0 * math.log10(gain), abs=0.1)
    assert found.phase_deg[0] == pytest.approx(turned, abs=0.5)


def test_inavs_gains_follow_the_airspeed_where_its_attenuation_is_on() -> None:
    logged = {"apa_pow": 120.0, "fw_reference_airspeed": 1500.0}
    law = inav.structure("roll", logged, 30.0)
    # 15 of 30 m/s: 0.5^1.2 of P, D and FF, 0.5^0.2 of I.
    assert inav.attenuation(30.0, law.fixed) == pytest.approx((0.4353, 0.8706), abs=1e-4)
    gains = {"P": 31.0, "I": 0.0, "D": 0.0, "FF": 0.0}
    angle, _ = law_response(law.loop(gains, 30.0), np.array([0.01]))
    still, _ = law_response(inav.structure("roll", {}, 30.0).loop(gains, 30.0), np.array([0.01]))
    assert abs(angle[0] / still[0]) == pytest.approx(0.5**1.2)
    twice = law.completed({"P": 5.0, "D": 0.0}, 0.01)["FF"]
    assert twice == pytest.approx(0.01 * 500.0 / math.degrees(1.0) * 31.0 / 0.4353, abs=0.5)


def test_inav_7_limits_its_integral_in_output() -> None:
    assert inav.structure("roll", {"fw_iterm_throw_limit": 100.0}, 15.0).fixed[
        "integral_percent"
    ] == pytest.approx(20.0)


def test_names_of_older_releases_are_read_too() -> None:
    old = {"ARSPD_FBW_MIN": 12.0, "SCHED_LOOP_RATE": 300.0}
    found = ardupilot.structure("roll", old, 15.0)
    assert found.fixed["airspeed_min_mps"] == 12.0
    assert "AIRSPEED_MIN" not in found.assumed
    assert "AIRSPEED_MAX" in found.assumed
    both = ardupilot.structure("roll", {**old, "AIRSPEED_MIN": 13.0}, 15.0)
    assert both.fixed["airspeed_min_mps"] == 13.0


@pytest.mark.parametrize(
    ("firmware", "release"),
    [
        ("ArduPlane V4.5.7 (0a1b2c3d)", "4.5"),
        ("PX4 release/1.14 PX4_FMU_V6X", "1.14"),
        ("PX4 v1.15 SIMULATED", "1.15"),
        ("PX4 main PX4_FMU_V5", ""),
        ("PX4 fix-1.2-roll PX4_FMU_V5", ""),
    ],
)
def test_a_log_names_its_release(firmware: str, release: str) -> None:
    assert release_in(firmware) == release


def test_parameters_have_the_names_of_their_release() -> None:
    assert called("ardupilot", "AIRSPEED_MIN", "4.4.2") == "ARSPD_FBW_MIN"
    assert called("ardupilot", "AIRSPEED_MIN", "4.5") == "AIRSPEED_MIN"
    assert called("ardupilot", "AIRSPEED_MIN", "") == "AIRSPEED_MIN"
    assert called("inav", "pid_iterm_limit_percent", "7") == "fw_iterm_throw_limit"


@pytest.mark.parametrize(
    ("autopilot", "release", "said"),
    [
        ("ardupilot", "4.0", "ardupilot 4.0: before 4.1 another law flies"),
        ("px4", "1.9", "px4 1.9: before 1.14"),
        ("inav", "newest", "release 'newest', expected a number such as 4.5"),
        ("mega", "1.0", "mega has none"),
    ],
)
def test_a_release_that_was_not_read_is_refused(autopilot: str, release: str, said: str) -> None:
    with pytest.raises(ControlError, match=re.escape(said)):
        release_note(autopilot, release)


def test_a_newer_release_is_tuned_and_told() -> None:
    assert release_note("px4", "1.16.1") == ""
    assert "newer than 1.16" in release_note("px4", "1.17")


def test_a_law_that_is_another_is_refused() -> None:
    with pytest.raises(ControlError, match=r"RLL2SRV_P and no RLL_RATE_P: ArduPlane before 4\.1"):
        ardupilot.structure("roll", {"RLL2SRV_P": 1.0}, 15.0)


def test_the_speed_scaler_ends_where_arduplane_ends_it() -> None:
    fixed = ardupilot.structure("roll", {}, 15.0).fixed
    assert ardupilot.speed_scaler(1.0, fixed) == pytest.approx(2.381, abs=1e-3)
    assert ardupilot.speed_scaler(80.0, fixed) == pytest.approx(0.341, abs=1e-3)
    assert ardupilot.speed_scaler(15.0, fixed) == 1.0

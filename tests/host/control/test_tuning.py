"""Gains from an uncertain axis whose truth is known, and the files that carry them."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import control
import numpy as np
import pytest
from host.arrays import Array
from host.control import ControlError, read_parameters, tuning
from host.control.actuator import Actuator, actuator_of
from host.control.autopilots import ardupilot_yaw, mega
from host.control.autopilots.known import AUTOPILOTS
from host.control.autopilots.mega import Mega
from host.control.autopilots.structure import Setting
from host.control.axis_tuning import AxisTuning, YawTuning
from host.control.bandwidth_costs import bandwidth_costs, known
from host.control.disturbances import gyro_noise_radps
from host.control.lateral_pair import PairProblem
from host.control.loop_design import Design, design, feed_forward, search
from host.control.outer_loops import OuterCheck
from host.control.parameter_file import Change, taken_back
from host.control.scenarios import Problem, draw, scenarios_of
from host.control.tuning import Tuning, unchecked
from host.control.tuning_notes import tuning_notes
from host.control.uncertain_axis import UncertainAxis
from host.control.verification import Required, control_margins, verify
from host.control.worst_aircraft import worst_on_contour
from host.control.yaw_design import PairMargins, YawDesign
from host.sysid.models import Trim

DRIVE = Actuator("aileron", 0.4, 0.03, 8.0, 0.1, 4.0, 0.01, 0.005)


def rolling(share: float) -> UncertainAxis:
    """Return a roll axis, 1/s and 1/s2, known to a share of each derivative."""
    mean = np.array([-10.0, 150.0])
    return UncertainAxis(
        "roll",
        "roll",
        Trim(15.0, 0.1, 0.1),
        ("L_p", "L_da"),
        mean,
        np.diag((share * mean / 1.96) ** 2),
    )


def problem(share: float, *speeds: float, autopilot: str = "ardupilot") -> Problem:
    structure = AUTOPILOTS[autopilot].structure("roll", {}, 15.0)
    return Problem(rolling(share), DRIVE, structure, speeds or (15.0,), 1.3)


def test_margins_of_every_loop_are_those_of_python_control() -> None:
    seen = draw(problem(0.3, 12.0, 20.0), seed=8, count=20)
    gains = seen.problem.structure.completed({"P": 0.2, "D": 0.004, "TC": 0.4}, 0.17)
    w = seen.frequency_radps
    for loops, own in zip(seen.loops(gains), seen.judged(gains), strict=True):
        others = np.array([control_margins(control, one, w) for one in loops]).T
        assert own.gain_db == pytest.approx(others[0], abs=0.05)
        assert own.phase_deg == pytest.approx(others[1], abs=0.5)
        assert np.ptp(own.gain_db) > 1.0


def test_feed_forward_is_roll_damping_over_aileron() -> None:
    assert feed_forward(problem(0.1)) == pytest.approx(10.0 / 150.0 / 0.4)


def test_derivatives_scale_with_the_airspeed() -> None:
    a, b, states = rolling(0.0).matrices(np.array([-10.0, 150.0]), 30.0)
    k = states.index("p_radps")
    assert a[k, k] == pytest.approx(-20.0)
    assert b[k, 0] == pytest.approx(600.0)


def test_draws_have_the_covariance_that_was_given() -> None:
    axis = rolling(0.2)
    drawn = axis.drawn(np.random.default_rng(3), 20_000)
    assert np.cov(drawn.T) == pytest.approx(axis.covariance, abs=0.03 * axis.covariance.max())


@pytest.mark.costs(20, "a design verified on 135 aircraft, and a second search")
def test_less_knowledge_gives_softer_gains_and_what_is_found_holds() -> None:
    known, vague = problem(0.02), problem(0.5)
    found = design(known)
    assert found.gains is not None
    assert found.verification.worst_gain_db >= 6.0
    assert found.verification.worst_phase_deg >= 45.0
    # On aircraft of a third drawing, at their own poles.
    unseen = draw(known, seed=77, count=30)
    assert unseen.stable(found.gains).all()
    softer = search(vague, draw(vague, seed=5, count=30), Required())
    assert softer is not None
    mean = [np.median(unseen.judged(g)[0].crossover_radps) for g in (found.gains, softer)]
    assert mean[0] > mean[1]


@pytest.mark.costs(20, "three searches over twelve aircraft")
def test_the_same_aircraft_flies_as_well_by_every_law() -> None:
    # One aircraft, three laws in three units and at three rates: what limits the crossover are
    # servo and delay, which are the same; slower filters cost some of it.
    middle = []
    for name in ("ardupilot", "px4", "inav"):
        asked = problem(0.1, autopilot=name)
        seen = draw(asked, seed=1, count=12)
        gains = search(asked, seen, Required())
        assert gains is not None
        middle.append(float(np.median(seen.judged(gains)[0].crossover_radps)))
    assert max(middle) < 2.0 * min(middle)


def test_the_hold_raises_the_crossover_of_the_attitude() -> None:
    asked = problem(0.1, autopilot="mega")
    seen = draw(asked, seed=1, count=12)
    found = search(asked, seen, Required())
    assert found is not None
    # A neighbour that is stiffer in angle is as fast at most, or lacks a margin.
    reached = float(np.min(seen.judged(found)[1].crossover_radps))
    for role in ("P", "D"):
        step = asked.structure.settings[role].step
        for sign in (-4, 4):
            other = asked.structure.completed({**found, role: found[role] + sign * step}, 0.0)
            inner, outer = seen.judged(other)
            lacks = Required().missing(inner) + Required().missing(outer) > 0.0
            slow = float(np.max(seen.moving(other)[0])) > 1.02  # half of 4 rad/s, 95 %
            assert lacks or slow or float(np.min(outer.crossover_radps)) < reached


def test_gains_of_the_hold_carry_aircraft_date_margins_and_sense() -> None:
    asked = problem(0.1, autopilot="mega")
    gains = asked.structure.completed({"P": 0.4, "D": 0.05}, 0.0)
    proven = verify(asked, gains, seed=1, required=Required())
    tuned = AxisTuning(asked, Design(gains, proven, 1), {})
    found = Tuning(AUTOPILOTS["mega"], 'my "trainer"', (tuned,), (), "2026-11-28")
    read = tomllib.loads(found.to_param())
    assert (read["aircraft"], read["covariance_date"]) == ('my "trainer"', "2026-11-28")
    assert (read["roll_angle_gain"], read["roll_rate_gain"]) == (0.4, 0.05)
    assert read["roll_integral_gain"] == pytest.approx(0.4 / 3.0, abs=0.005)
    assert read["aileron_sense"] == 1.0
    assert f"{proven.worst_gain_db:.1f} dB" in read["roll_holds"]
    assert "First flight" not in found.to_text()


@pytest.mark.costs(10, "two searches over twelve aircraft")
def test_a_log_with_a_low_slew_limit_has_softer_gains() -> None:
    asked = problem(0.1)
    seen = draw(asked, seed=1, count=12)
    free = search(asked, seen, Required())
    assert free is not None
    unlimited = float(np.max(seen.moving(free)[1]))
    # SMAX counts 45 times P and D in radians; gusts reach it 95 % of the time.
    limit_degps = 0.8 * 1.96 * unlimited * (np.pi / 4.0) * 45.0
    law = AUTOPILOTS["ardupilot"].structure("roll", {"RLL_RATE_SMAX": limit_degps}, 15.0)
    slow = replace(seen, problem=replace(asked, structure=law))
    held = search(asked, slow, Required())
    assert held is not None
    assert float(np.max(seen.moving(held)[1])) <= 0.8 * unlimited


def test_the_outputs_slew_is_the_surfaces_rate_over_its_travel() -> None:
    # What gusts move is far below servo and filter.
    seen = draw(problem(0.0), seed=3, count=1)
    gains = seen.problem.structure.completed({"P": 0.12, "D": 0.0, "TC": 0.5}, 0.17)
    surface, output = seen.moving(gains)
    assert float(surface[0] / output[0]) == pytest.approx(DRIVE.travel_rad, rel=0.2)


def test_an_aircraft_that_answers_the_other_way_is_unstable() -> None:
    # The surfaces are connected as the estimate says: a draw of the other sign is fed back wrongly.
    known = problem(0.0)
    other = replace(known, axis=replace(known.axis, mean=np.array([-10.0, 150.0]),
                    covariance=np.diag([0.0, 200.0**2])))  # fmt: skip
    found = draw(other, seed=1, count=60)
    drawn = other.axis.drawn(np.random.default_rng([1, 48]), 60)[:, 1]
    gains = {"P": 0.2, "I": 0.1, "D": 0.0, "FF": 0.1, "TC": 0.5}
    assert (drawn < 0.0).sum() > 5
    assert not found.stable(gains)[drawn < 0.0].any()


def test_an_axis_whose_sign_is_open_has_no_gains() -> None:
    assert design(problem(3.0)).gains is None


def test_noise_is_told_from_motion() -> None:
    t = np.arange(0.0, 20.0, 0.01)
    noise = 0.01 * np.random.default_rng(1).standard_normal(len(t))
    assert gyro_noise_radps([np.sin(6.0 * t) + noise]) == pytest.approx(0.01, rel=0.05)


@pytest.mark.parametrize("autopilot", AUTOPILOTS)
def test_parameters_go_out_and_come_back(tmp_path: Path, autopilot: str) -> None:
    changes = [Change("RLL_RATE_P", 0.12, 0.08, "s"), Change("RLL_RATE_D", 0.004, None, "s")]
    write = AUTOPILOTS[autopilot].text
    new, old = tmp_path / "new.param", tmp_path / "old.param"
    new.write_text(write(changes, {"aircraft": "Trainer"}), encoding="utf-8")
    old.write_text(write(taken_back(changes, {"RLL_RATE_D": 0.0}), {"back": "x"}), encoding="utf-8")
    assert read_parameters(new) == {"RLL_RATE_P": 0.12, "RLL_RATE_D": 0.004}
    assert read_parameters(old) == {"RLL_RATE_P": 0.08, "RLL_RATE_D": 0.0}


def test_mission_planner_loads_every_line_that_is_no_comment() -> None:
    # ParamFile.cs and mavparm.py: lines of other than two items are skipped without a word.
    changes = [Change("RLL_RATE_P", 0.12, 0.08, "s"), Change("KFF_RDDRMIX", 1.0, None, "")]
    text = AUTOPILOTS["ardupilot"].text(changes, {"aircraft": "my trainer, blue"})
    kept = [re.split(r"[ ,\t]+", one) for one in text.splitlines() if not one.startswith("#")]
    assert kept == [["RLL_RATE_P", "0.12"], ["KFF_RDDRMIX", "1"]]


def test_files_of_ground_stations_have_their_own_lines() -> None:
    one = [Change("FW_RR_P", 0.07, 0.05, "")]
    heading = {"aircraft": "a"}
    lines = AUTOPILOTS["ardupilot"].text(one, heading).splitlines()
    assert lines == ["# aircraft: a", "# FW_RR_P before: 0.05", "FW_RR_P,0.07"]
    assert AUTOPILOTS["px4"].text(one, heading).splitlines()[-1] == "1\t1\tFW_RR_P\t0.07\t9"
    cli = AUTOPILOTS["inav"].text([Change("fw_p_roll", 9, 5, "")], heading)
    assert cli.splitlines() == [
        "# aircraft: a",
        "# fw_p_roll before: 5",
        "set fw_p_roll = 9",
        "save",
    ]


def test_an_aircraft_that_the_least_gains_leave_unstable_has_gains_too() -> None:
    # s^2 - s + 150 (P + D s): by hand only D above 1/150 holds it, and the least D is none.
    axis = replace(rolling(0.1), mean=np.array([1.0, 150.0]))
    known = replace(problem(0.1, autopilot="mega"), axis=axis)
    found = design(known, seed=1)
    assert found.gains is not None
    assert found.gains["D"] > 1.0 / 150.0
    assert found.verification.holds


def test_defaults_are_told_by_the_names_of_the_release() -> None:
    found = [AxisTuning(problem(0.1), design(problem(0.1), seed=1), {})]
    chosen = AUTOPILOTS["ardupilot"]
    older, newer = (" ".join(tuning_notes(found, chosen, {}, (), r)) for r in ("4.4", "4.5"))
    assert "ARSPD_FBW_MIN, ARSPD_FBW_MAX" in older
    assert "AIRSPEED_MIN, AIRSPEED_MAX" in newer
    # A model of roll alone has no path; where there are no gains there is nothing around them.
    said = "path (L1) is not checked: the model 'roll' lacks its motion"
    assert list(unchecked(chosen, found)) == [said]
    none = [replace(found[0], design=replace(found[0].design, gains=None))]
    assert not list(unchecked(chosen, none))


def test_what_is_around_inavs_gains_is_said_to_be_unchecked() -> None:
    said = " ".join(tuning_notes([], AUTOPILOTS["inav"], {}, ()))
    assert "not checked: nobody read inav's navigation" in said
    assert "navigation" not in " ".join(tuning_notes([], AUTOPILOTS["px4"], {}, ()))


def test_a_file_without_parameters_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "empty.param"
    path.write_text("# nothing\nnan,nan\n", encoding="utf-8")
    with pytest.raises(ControlError, match="no parameter"):
        read_parameters(path)


def test_degrees_without_travel_are_refused(tmp_path: Path) -> None:
    from host.aircraft.file import FOLDER

    text = (FOLDER / "ultrastick25e.toml").read_text(encoding="utf-8")
    kept = text.replace("aileron_limit_rad = 0.4363323", "aileron_limit_rad = 0.0")
    path = tmp_path / "mine.toml"
    path.write_text(kept, encoding="utf-8")
    with pytest.raises(Exception, match="aileron_limit_rad"):
        actuator_of(str(path), "roll")


def test_a_step_of_the_demand_is_that_of_the_law_flown_sample_by_sample() -> None:
    known = problem(0.0)
    drawn = draw(known, seed=4, count=1)
    gains = known.structure.completed({"P": 0.12, "D": 0.004, "TC": 0.5}, 0.17)
    t, angle = drawn.steps(gains, 2.0)
    plant, law = drawn.of_speed[0][0].plant, known.structure.loop(gains, 15.0)
    x, own = np.zeros(len(plant.a)), []
    state: Array = np.zeros(law.states)
    for _ in t:
        seen, rate = plant.c @ x
        own.append(seen)
        state, out = law.step(state, np.array(1.0 - seen), np.array(rate))
        x = plant.a @ x + plant.b[:, 0] * float(out)
    assert angle[0] == pytest.approx(np.array(own), abs=1e-9)


def test_what_is_drawn_is_there_for_axes_with_gains_alone() -> None:
    asked = problem(0.1)
    gains = asked.structure.completed({"P": 0.12, "D": 0.0, "TC": 0.5}, 0.17)
    proven = verify(asked, gains, seed=1, required=Required())
    tuned = AxisTuning(asked, Design(gains, proven, 1), {})
    refused = AxisTuning(asked, Design(None, proven, 1), {})
    found = Tuning(AUTOPILOTS["px4"], "<b>mine</b>", (tuned,), ())
    assert list(found.plot()) == ["roll"]
    assert Tuning(AUTOPILOTS["px4"], "mine", (refused,), ()).plot() == {}
    assert "&lt;b&gt;mine" in found._repr_html_()
    assert "RLL_RATE_P 0.12" in repr(found)


def test_a_derivative_that_is_known_costs_nothing_and_the_others_follow() -> None:
    covariance = np.array([[4.0, 3.0], [3.0, 9.0]])
    # The variance of the second of a normal pair, given the first, is 9 - 9 / 4.
    assert known(covariance, 0) == pytest.approx(np.array([[0.0, 0.0], [0.0, 6.75]]))


def test_the_control_power_of_a_roll_axis_costs_what_its_interval_says() -> None:
    asked = problem(0.0)
    axis = replace(asked.axis, covariance=np.diag([0.0, (0.2 * 150.0) ** 2]))
    gains = asked.structure.completed({"P": 0.12, "D": 0.0, "TC": 0.5}, 0.17)
    ((name, share),) = bandwidth_costs(replace(asked, axis=axis), gains)
    assert name == "L_da"
    # The loop's gain is L_da: of sixty draws the largest lies 2.3 standard deviations up.
    assert 0.3 < share < 0.6


def test_the_worst_aircraft_of_the_contour_is_found_where_it_is_known() -> None:
    # One derivative is open: the contour is its own 95 % interval, and more L_da is more gain.
    asked = problem(0.0)
    axis = replace(asked.axis, covariance=np.diag([0.0, (0.1 * 150.0) ** 2]))
    gains = asked.structure.completed({"P": 0.25, "D": 0.0, "TC": 0.5}, 0.17)
    worst = worst_on_contour(replace(asked, axis=axis), gains)
    assert worst is not None
    assert worst.moved[0][0] == "L_da"
    assert worst.moved[0][1] == pytest.approx(0.196, abs=1e-3)
    assert "at L_da +20 %" in worst.line
    known = replace(asked, axis=replace(axis, mean=np.array([-10.0, 150.0 * 1.196]),
                                        covariance=np.zeros((2, 2))))  # fmt: skip
    exact = replace(known, actuator=replace(DRIVE, travel_share=0.0, bandwidth_share=0.0,
                                            delay_sd_s=0.0))  # fmt: skip
    inner, _ = draw(exact, seed=1, count=1).judged(gains)
    assert worst.gain_db == pytest.approx(float(inner.gain_db[0]), abs=0.01)
    assert worst_on_contour(known, gains) is None


def test_a_negative_derivative_that_grows_is_off_upwards() -> None:
    asked = problem(0.0)
    axis = replace(asked.axis, covariance=np.diag([(0.1 * 10.0) ** 2, 0.0]))
    gains = asked.structure.completed({"P": 0.25, "D": 0.0, "TC": 0.5}, 0.17)
    worst = worst_on_contour(replace(asked, axis=axis), gains)
    assert worst is not None
    size = -10.0 * (1.0 + dict(worst.moved)["L_p"])
    drives = np.array([[DRIVE.travel_rad, DRIVE.bandwidth_hz, DRIVE.delay_s]])
    inner, _ = scenarios_of(asked, np.array([[size, 150.0]]), drives).judged(gains)
    assert worst.gain_db == pytest.approx(float(inner.gain_db[0]), abs=1e-6)


def test_no_aircraft_drawn_on_the_contour_is_worse() -> None:
    asked = problem(0.15)
    gains = asked.structure.completed({"P": 0.12, "D": 0.002, "TC": 0.5}, 0.17)
    worst = worst_on_contour(asked, gains)
    assert worst is not None
    turns = np.linspace(0.0, 2.0 * np.pi, 90)
    sphere = np.column_stack([np.cos(turns), np.sin(turns)]) * np.sqrt(5.991)  # of two, 95 %
    drawn = asked.axis.mean + sphere * np.sqrt(np.diag(asked.axis.covariance))
    drives = np.repeat([[DRIVE.travel_rad, DRIVE.bandwidth_hz, DRIVE.delay_s]], 90, axis=0)
    inner, outer = scenarios_of(asked, drawn, drives).judged(gains)
    least = min(float(np.min(one.gain_db)) / 6.0 for one in (inner, outer))
    least = min(least, *(float(np.min(one.phase_deg)) / 45.0 for one in (inner, outer)))
    assert min(worst.gain_db / 6.0, worst.phase_deg / 45.0) == pytest.approx(least, rel=0.01)


def test_elevons_have_half_the_travel_and_twice_the_gains() -> None:
    plain = AUTOPILOTS["ardupilot"].structure("roll", {}, 15.0)
    elevons = AUTOPILOTS["ardupilot"].structure(
        "roll", {"SERVO1_FUNCTION": 77.0, "SERVO2_FUNCTION": 78.0}, 15.0
    )
    gains = {"P": 0.1, "I": 0.1, "D": 0.0, "FF": 0.2, "TC": 0.5}
    state = np.zeros(4)
    whole = plain.loop(gains, 15.0).step(state, np.array(0.2), np.array(0.0))[1]
    half = elevons.loop(gains, 15.0).step(state, np.array(0.2), np.array(0.0))[1]
    assert float(half) == pytest.approx(0.5 * float(whole))
    chosen = {"P": 0.1, "D": 0.0, "TC": 0.5}
    ratio = elevons.completed(chosen, 0.1)["FF"] / plain.completed(chosen, 0.1)["FF"]
    assert ratio == pytest.approx(2.0, rel=0.02)
    tail = AUTOPILOTS["ardupilot"].structure("roll", {"SERVO2_FUNCTION": 79.0}, 15.0)
    assert float(tail.loop(gains, 15.0).step(state, np.array(0.2), np.array(0.0))[1]) == float(
        whole
    )


def test_a_rudders_gains_go_out_with_the_others() -> None:
    structure = ardupilot_yaw.structure({}, 15.0)
    mixed = PairProblem(problem(0.0), {}, DRIVE, structure)
    margins = PairMargins((7.0, 80.0), (8.0, 50.0), 0.7, True, 0.05, 0.1, 0.06, 0.08)
    before = {"KFF_RDDRMIX": 0.5}
    yaw = YawTuning(mixed, YawDesign({"DAMP": 0.75, "MIX": 0.5}, margins, 1), before)
    found = Tuning(AUTOPILOTS["ardupilot"], "mine", (), (), yaw=yaw)
    assert found.gains == {"YAW2SRV_DAMP": 0.75, "KFF_RDDRMIX": 0.5}
    assert [one.name for one in found.changes] == ["YAW2SRV_DAMP"]
    assert "# YAW2SRV_DAMP before: 0.75\nYAW2SRV_DAMP,0\n" in found.to_restore()
    assert "at the rudder:         at least 8.0 dB, 50 deg" in found.to_text()
    assert found.margins["yaw"]["both_disk"] == 0.7
    assert "Load half of each P, I, D and YAW2SRV_DAMP;" in found.to_text()
    rest = YawTuning(mixed, YawDesign(None, margins, 1), before)
    assert Tuning(AUTOPILOTS["ardupilot"], "mine", (), (), yaw=rest).changes == ()


def test_what_is_around_is_told_and_not_changed() -> None:
    outer = OuterCheck("path (L1)", 18.7, 51.0, True, {"NAVL1_PERIOD": 17.0})
    found = Tuning(AUTOPILOTS["ardupilot"], "mine", (), (), outer=(outer,))
    assert "path (L1): at least 18.7 dB, 51 deg: NAVL1_PERIOD 17" in found.to_text()
    assert found.document()["outer_loops"]["path (L1)"]["stable"] is True
    assert found.changes == ()


def test_roll_gains_at_their_limit_make_room_for_a_damper(monkeypatch: pytest.MonkeyPatch) -> None:
    axis = replace(rolling(0.1), template="lateral", names=("L_p", "N_dr"))
    asked = replace(problem(0.1), axis=axis)
    proven = verify(problem(0.0), {"P": 0.1, "I": 0.1, "D": 0.0, "FF": 0.1, "TC": 0.5}, seed=1,
                    required=Required())  # fmt: skip
    margins = PairMargins((5.9, 80.0), (8.0, 50.0), 0.7, True, 0.05, 0.1, 0.06, 0.08)
    fastest, softer = Design({"P": 0.14}, proven, 1), Design({"P": 0.13}, proven, 1)

    def designed(_: Problem, *, seed: int, asked: Required) -> Design:
        assert asked == Required(6.0 * 1.08, 45.0 * 1.08)
        return softer

    def damper(pair: PairProblem, *, seed: int) -> YawDesign:
        return YawDesign({"DAMP": 0.5} if pair.roll_gains["P"] < 0.135 else None, margins, 1)

    monkeypatch.setattr(tuning, "design", designed)
    monkeypatch.setattr(tuning, "design_yaw", damper)
    (roll,), yaw = tuning.with_rudder(
        AUTOPILOTS["ardupilot"], "ultrastick25e", [AxisTuning(asked, fastest, {})], 0
    )
    assert roll.design is softer
    assert yaw is not None
    assert yaw.design.gains == {"DAMP": 0.5}


def test_only_the_margin_that_lacked_is_asked_for_more_of() -> None:
    assert Required().tightened((4.0, 60.0), 0.08) == Required(8.0, 45.0)
    assert Required().tightened((7.0, 44.0), 0.08) == Required(6.0, 45.0 + 0.08 * 45.0)
    assert Required(6.5, 50.0).tightened((5.9, 30.0), 0.08) == Required(6.5 + 0.08 * 6.0, 65.0)


@dataclass(frozen=True)
class WideHold(Mega):
    """The hold with ranges a hundred times as wide."""

    @property
    def settings(self) -> Mapping[str, Setting]:
        own = super().settings.items()
        return {role: replace(one, highest=100.0 * one.highest) for role, one in own}


@pytest.mark.costs(10, "two searches over twelve aircraft")
def test_a_range_that_is_a_hundred_times_as_wide_finds_the_same() -> None:
    asked = problem(0.1, autopilot="mega")
    wide = replace(asked, structure=WideHold("roll", mega.structure("roll", {}, 15.0).fixed))
    seen = draw(asked, seed=1, count=12)
    reached = []
    for one in (seen, replace(seen, problem=wide)):
        gains = search(one.problem, one, Required())
        assert gains is not None
        reached.append(float(np.min(seen.judged(gains)[1].crossover_radps)))
    assert reached[1] > 0.95 * reached[0]

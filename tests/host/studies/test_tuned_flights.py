"""A flown loop has the margins that are computed for it, and a bad one is seen to be."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from host.aircraft.linear_aircraft import load
from host.aircraft.trim import solve
from host.control.actuator import Actuator
from host.control.autopilots import ardupilot_yaw
from host.control.autopilots.known import AUTOPILOTS
from host.control.lateral_pair import PairProblem
from host.control.scenarios import Problem, draw
from host.control.uncertain_axis import UncertainAxis
from host.sysid.models import Trim
from studies.tuned_flights.closed_loop_flight import AXES, ClosedLoop, Demand, fly
from studies.tuned_flights.linear_flight import fly_linear
from studies.tuned_flights.measured_margins import computed, measured
from studies.tuned_flights.step_figures import moving_at_the_end, step_figures


def ultrastick(p: float, pulse_s: float = 0.013) -> ClosedLoop:
    frame = load("ultrastick25e").airframe()
    laws = {axis: AUTOPILOTS["ardupilot"].structure(axis, {}, 17.0) for axis in AXES}
    gains = {"P": p, "I": 0.1, "D": 0.0, "FF": 0.12, "TC": 0.5}
    return ClosedLoop(frame, solve(frame, 17.0), laws, dict.fromkeys(AXES, gains), pulse_s)


@pytest.mark.parametrize("axis", AXES)
def test_margins_of_injected_sines_are_those_that_are_computed(axis: str) -> None:
    loop = ultrastick(0.12)
    flown, known = measured([loop], axis), computed(loop, axis)
    assert flown.gain_db == pytest.approx(known.gain_db, abs=0.3)
    assert flown.phase_deg == pytest.approx(known.phase_deg, abs=3.0)
    # It could fail: the loop of pulses that come 10 ms later is another.
    late = computed(ultrastick(0.12, 0.003), axis)
    assert abs(late.gain_db[0] - flown.gain_db[0]) > 0.5


def rolling(l_da: float = 150.0) -> Problem:
    """Return a roll axis that is known exactly."""
    axis = UncertainAxis("roll", "roll", Trim(17.0, 0.1, 0.1), ("L_p", "L_da"),
                         np.array([-10.0, l_da]), np.zeros((2, 2)))  # fmt: skip
    drive = Actuator("aileron", 0.4, 0.0, 8.0, 0.0, 4.0, 0.01, 0.0)
    return Problem(axis, drive, AUTOPILOTS["ardupilot"].structure("roll", {}, 17.0), (17.0,))


@pytest.mark.parametrize("axis", ["roll", "yaw"])
def test_margins_are_measured_with_the_rudder_flying_too(axis: str) -> None:
    plain = ultrastick(0.12)
    drive = rolling().actuator
    pair = PairProblem(rolling(), plain.gains["roll"], drive, ardupilot_yaw.structure({}, 17.0))
    gains = {**plain.gains, "yaw": {"DAMP": 1.0, "MIX": 0.5}}
    loop = replace(plain, gains=gains, pair=pair)
    flown, known = measured([loop], axis), computed(loop, axis)
    assert flown.gain_db == pytest.approx(known.gain_db, abs=0.3)
    assert flown.phase_deg == pytest.approx(known.phase_deg, abs=3.0)
    # It could fail: with pulses 10 ms earlier the loop is another.
    early = computed(replace(loop, pulse_s=0.003), axis)
    assert abs(early.gain_db[0] - flown.gain_db[0]) > 0.5


def test_margins_of_a_law_that_is_faster_than_the_pulses_are_measured_too() -> None:
    plain = ultrastick(0.12)
    laws = {axis: AUTOPILOTS["px4"].structure(axis, {}, 17.0) for axis in AXES}
    gains = {"FF": 0.7, "P": 0.09, "I": 0.715, "D": 0.01, "TC": 0.2}
    loop = replace(plain, laws=laws, gains=dict.fromkeys(AXES, gains))
    flown, known = measured([loop], "pitch"), computed(loop, "pitch")
    # The hold of a pulse takes gain off too: a delay in its place is 1.9 dB from what is flown.
    assert flown.gain_db == pytest.approx(known.gain_db, abs=0.5)
    assert flown.phase_deg == pytest.approx(known.phase_deg, abs=3.0)


def test_a_linear_aircraft_steps_as_its_closed_loop_does_until_travel_ends() -> None:
    gains = {"P": 0.12, "I": 0.1, "D": 0.0, "FF": 0.12, "TC": 0.5}
    seen = draw(rolling(), seed=3, count=1)
    t, angle = seen.steps(gains, 4.0)
    for size_rad, same in ((0.01, True), (3.0, False)):
        demand = Demand(bank_rad=size_rad, at_s=0.0, seconds=4.0)
        ((_, (flown,)),) = fly_linear(rolling(), gains, demand, seed=3, count=1)
        assert len(flown.t_s) == len(t)
        near = np.allclose(flown.angle_rad["roll"] / size_rad, angle[0], atol=1e-9)
        assert near == same


def test_a_linear_aircraft_that_answers_the_other_way_is_lost() -> None:
    gains = {"P": 0.12, "I": 0.1, "D": 0.0, "FF": 0.12, "TC": 0.5}
    known = rolling()
    vague = replace(known, axis=replace(known.axis, covariance=np.diag([0.0, 200.0**2])))
    drawn = vague.axis.drawn(np.random.default_rng([3, 48]), 40)[:, 1]
    demand = Demand(bank_rad=0.5)
    ((_, flown),) = fly_linear(vague, gains, demand, seed=3, count=40)
    lost = np.array([one.lost for one in flown])
    assert (drawn < -20.0).sum() > 5
    assert lost[drawn < -20.0].all()
    assert not lost[(drawn > 20.0) & (drawn < 200.0)].any()


def test_a_bank_of_thirty_degrees_is_reached_and_held() -> None:
    demand = Demand(bank_rad=0.5236)
    (flown,) = fly([ultrastick(0.12)], demand)
    rise_s, overshoot, settled_s, _ = step_figures(flown, demand)
    assert 0.2 < rise_s < 1.5
    assert overshoot < 10.0
    assert settled_s < 3.0
    assert not moving_at_the_end(flown, demand)


def test_a_gain_above_the_margin_is_lost_or_keeps_swinging() -> None:
    known = computed(ultrastick(0.12), "roll").gain_db[0]
    demand = Demand(bank_rad=0.1)
    (flown,) = fly([ultrastick(0.12 * 10 ** ((known + 3.0) / 20.0))], demand)
    assert flown.lost or moving_at_the_end(flown, demand)

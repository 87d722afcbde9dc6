"""A flown loop has the margins that are computed for it, and a bad one is seen to be."""

from __future__ import annotations

import pytest
from host.aircraft.linear_aircraft import load
from host.aircraft.trim import solve
from host.control.autopilots.known import AUTOPILOTS
from studies.tuned_flights.closed_loop_flight import AXES, ClosedLoop, Demand, fly
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
    flown, known = measured(loop, axis), computed(loop, axis)
    assert flown.gain_db == pytest.approx(known.gain_db, abs=0.3)
    assert flown.phase_deg == pytest.approx(known.phase_deg, abs=3.0)
    # It could fail: the loop of pulses that come 10 ms later is another.
    late = computed(ultrastick(0.12, 0.003), axis)
    assert abs(late.gain_db[0] - flown.gain_db[0]) > 0.5


def test_a_bank_of_thirty_degrees_is_reached_and_held() -> None:
    demand = Demand(bank_rad=0.5236)
    flown = fly(ultrastick(0.12), demand)
    rise_s, overshoot, settled_s, _ = step_figures(flown, demand)
    assert 0.2 < rise_s < 1.5
    assert overshoot < 10.0
    assert settled_s < 3.0
    assert not moving_at_the_end(flown)


def test_a_gain_above_the_margin_is_lost_or_keeps_swinging() -> None:
    known = computed(ultrastick(0.12), "roll").gain_db[0]
    flown = fly(ultrastick(0.12 * 10 ** ((known + 3.0) / 20.0)), Demand(bank_rad=0.1))
    assert flown.lost or moving_at_the_end(flown)

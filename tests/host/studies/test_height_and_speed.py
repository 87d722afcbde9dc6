"""The laws of height and airspeed against loops and outputs by hand, and flown."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from host.aircraft.linear_aircraft import load
from host.aircraft.trim import solve
from host.control.autopilots.known import AUTOPILOTS
from studies.tuned_flights.closed_loop_flight import AXES, ClosedLoop, Demand, Flown, fly
from studies.tuned_flights.height_and_speed import (
    ENERGY_LAWS,
    UPDATE_S,
    ArduPlaneEnergy,
    Seen,
    Speeds,
)
from studies.tuned_flights.step_figures import moving_at_the_end, step_figures

SPEEDS = Speeds(12.0, 17.0, 21.0)
V, THETA = 17.0, 0.1
TRIM = np.array([0.5])
DEMANDED = np.zeros(1), np.full(1, V)


def level(height: float = 0.0, climb: float = 0.0) -> Seen:
    one = np.ones(1)
    return Seen(height * one, climb * one, V * one, 0.0 * one, THETA * one)


@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
def test_what_flies_is_the_height_loop_that_is_checked(autopilot: str) -> None:
    # A path that follows a sine of pitch at constant speed: what is asked back is minus the loop.
    w, a = 0.5, 0.01
    law = ENERGY_LAWS[autopilot](SPEEDS, level(-V * a / w), TRIM)
    t = UPDATE_S * np.arange(round(6.0 * 2.0 * math.pi / w / UPDATE_S))
    asked = np.array([
        law.step(DEMANDED[0], DEMANDED[1],
                 level(-V * a * math.cos(w * now) / w, V * a * math.sin(w * now)))[0][0]
        for now in t
    ])  # fmt: skip
    behind = t > 2.0 * math.pi / w
    rows = np.column_stack([np.sin(w * t), np.cos(w * t), np.ones_like(t), t])[behind]
    sine, cosine, *_ = np.linalg.lstsq(rows, asked[behind], rcond=None)[0]
    (_, outer) = AUTOPILOTS[autopilot].outer({})  # type: ignore[misc]
    one = np.ones((1, 1), dtype=complex)
    at_once = {"theta_rad": one, "alpha_rad": 0.0 * one, "airspeed_mps": 0.0 * one}
    checked = outer.loop(V, np.array([w]), at_once)[0, 0]
    assert -complex(sine, cosine) / a == pytest.approx(checked, rel=0.05)


def test_arduplanes_first_throttle_by_hand() -> None:
    # Half a metre low: the energy and, over 5 s, its rate; 7 g of rate for the whole throttle.
    law = ENERGY_LAWS["ardupilot"](SPEEDS, level(), TRIM)
    for _ in range(5):
        _, throttle = law.step(*DEMANDED, level(-0.5))
    by_hand = 0.5 / 7.0 * (1.0 / 5.0 + (1.0 + 0.5 * 0.2 / 5.0) / 5.0 + 0.1 * 0.3 / 5.0)
    assert throttle[0] - TRIM[0] == pytest.approx(by_hand, rel=1e-9)


def test_px4s_first_throttle_by_hand() -> None:
    # Half a metre low: a climb of 0.1 m/s of 5 m/s, damping and integral of its share of 7 m/s.
    law = ENERGY_LAWS["px4"](SPEEDS, level(), TRIM)
    _, throttle = law.step(*DEMANDED, level(-0.5))
    by_hand = 0.1 / 5.0 * 0.4 + 0.1 / 7.0 * (0.05 + 0.02 * UPDATE_S)
    assert throttle[0] - TRIM[0] == pytest.approx(by_hand, rel=1e-9)


def ultrastick(seconds: float, demand: Demand, time_s: float = 5.0) -> Flown:
    frame = load("ultrastick25e").airframe()
    laws = {axis: AUTOPILOTS["ardupilot"].structure(axis, {}, V) for axis in AXES}
    gains = {"P": 0.12, "I": 0.1, "D": 0.0, "FF": 0.12, "TC": 0.5}

    def begin(now: Seen, throttle: np.ndarray) -> ArduPlaneEnergy:
        law = ArduPlaneEnergy(SPEEDS, now, throttle)
        law.time_s = time_s
        return law

    loop = ClosedLoop(frame, solve(frame, V), laws, dict.fromkeys(AXES, gains), energy=begin)
    (flown,) = fly([loop], replace(demand, seconds=seconds))
    return flown


@pytest.mark.parametrize("demand", [Demand(height_m=10.0), Demand(airspeed_mps=2.0)])
def test_a_step_of_height_or_airspeed_is_reached_and_held(demand: Demand) -> None:
    flown = ultrastick(45.0, demand)
    rise_s, overshoot, settled_s, _ = step_figures(flown, demand)
    assert 3.0 < rise_s < 10.0
    assert overshoot < 25.0
    assert settled_s < 30.0
    assert not moving_at_the_end(flown, demand)
    # What is not stepped comes back.
    assert flown.height_m[-1] == pytest.approx(demand.height_m, abs=0.1)
    assert flown.airspeed_mps[-1] == pytest.approx(V + demand.airspeed_mps, abs=0.1)


def test_a_time_constant_that_the_aircraft_cannot_follow_keeps_swinging() -> None:
    demand = Demand(height_m=10.0)
    flown = ultrastick(30.0, demand, time_s=0.5)
    assert flown.lost or moving_at_the_end(flown, demand)


def test_nothing_asked_leaves_a_trimmed_flight_alone() -> None:
    begin = partial(ArduPlaneEnergy, SPEEDS)
    law = begin(level(), TRIM)
    for _ in range(100):
        pitch, throttle = law.step(*DEMANDED, level())
    assert pitch[0] == pytest.approx(THETA, abs=1e-12)
    assert throttle[0] == pytest.approx(TRIM[0], abs=1e-12)

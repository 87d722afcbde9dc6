"""Turns between test points: home is ahead behind each, and the flight stays near it."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from host.aircraft.airframe import EAST, NORTH
from host.aircraft.attitude import euler
from host.cli import main
from host.planning.card_design import design
from host.planning.flight_envelope import Envelope
from host.planning.home_turns import LEG_SHARE, turns_before, with_turns
from host.twin.flight.fly import FlightRecord, fly
from host.twin.flight.pilot import TURN_RAD
from host.twin.testcard import cards
from host.twin.testcard.cards import BEFORE_S, Card, length_s, turns_home
from host.twin.testcard.flown_by_logger import flown_by_logger

from tests.campaign import every_nth

LIMIT_M = Envelope().distance_m


@pytest.fixture(scope="module")
def demonstration() -> FlightRecord:
    return fly(cards.load("demo"))


def distance_m(record: FlightRecord) -> np.ndarray:
    return np.hypot(record.states[:, NORTH], record.states[:, EAST])


def straight_on(card: Card) -> Card:
    return replace(card, segments=tuple(s for s in card.segments if s.kind != "turn"))


def test_the_demonstration_stays_inside_the_limit_that_live_draws(
    demonstration: FlightRecord,
) -> None:
    assert distance_m(demonstration).max() < LIMIT_M
    assert distance_m(fly(straight_on(demonstration.card))).max() > 2.0 * LIMIT_M


def test_a_turn_leads_home_and_ends_before_the_input(demonstration: FlightRecord) -> None:
    card, states = demonstration.card, demonstration.states
    (phi, _, _), away = euler(states[:, 6:10]), distance_m(demonstration)
    at_s, turns = card.flight.ground_s, 0
    for s in card.segments:
        first, at_s = at_s, at_s + length_s(card, s)
        if not turns_home(s):
            continue
        turns += 1
        rows = slice(round(1000 * first), round(1000 * at_s))
        bank_rad = np.abs(phi[rows])
        assert 0.9 * TURN_RAD < bank_rad.max() < 1.35 * TURN_RAD
        assert away[rows][-1] < away[rows].max() - 25.0
        assert abs(phi[round(1000 * (at_s + BEFORE_S))]) < 0.5 * TURN_RAD  # where the input begins
    assert turns == 5


@pytest.mark.parametrize("name", every_nth(["ultrastick25e", "kadetlt40"], 2))
def test_a_designed_card_turns_before_it_leaves(name: str) -> None:
    card = design(name)
    air = cards.load("demo").air
    assert np.median([distance_m(fly(replace(card, air=air), seed=k)).max() for k in range(5)]) < (
        LIMIT_M
    )
    assert with_turns(straight_on(card)) == card
    legs = [0.0]
    for s in card.segments:
        if turns_home(s):
            legs.append(0.0)
        else:
            legs[-1] += card.flight.airspeed_mps * length_s(card, s)
    assert max(legs) <= LEG_SHARE * LIMIT_M < legs[0] + legs[1]


def test_the_demonstration_turns_where_the_rule_has_it() -> None:
    card = cards.load("demo")
    straight = replace(straight_on(card), flight=replace(card.flight, airspeed_mps=17.0))
    assert with_turns(straight).segments == card.segments


def test_the_knee_board_names_the_turns(capsys: pytest.CaptureFixture[str]) -> None:
    assert turns_before(cards.load("demo")) == [2, 4, 6, 8, 10]
    assert turns_before(cards.load("survey")) == []  # its turns have a bank and a length
    assert main(["plan", "demo", "--flights", "0"]) == 0
    assert "home is ahead (30 deg of bank) before test point 2, 4, 6, 8, 10." in (
        capsys.readouterr().out
    )
    assert main(["plan", "demo", "--flights", "0", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["turns_before"] == [2, 4, 6, 8, 10]


def test_where_the_logger_flies_the_rows_the_pilot_has_legs_of_his_own() -> None:
    card = cards.load("demo")
    assert flown_by_logger(card, 17.0, LIMIT_M) == flown_by_logger(straight_on(card), 17.0, LIMIT_M)

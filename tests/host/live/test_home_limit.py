"""Distance and bearing home, and the warning before the limit, against motion step by step."""

from pathlib import Path

import numpy as np
import pytest
from host.aircraft.linear_aircraft import load as load_aircraft
from host.live.flight_state import FlightState
from host.live.gps_fix import GpsFix
from host.live.home_limit import WARNED_S, home_view
from host.live.live_program import _limit_m
from host.live.live_request import LiveRequest
from host.live.live_stream import LiveStream
from host.physical.calibration import load_calibration
from host.planning.card_design import design
from host.planning.flight_envelope import Envelope
from host.planning.logger_card import logger_card

from tests.host.live.test_flight_state import flown


@pytest.mark.parametrize(
    ("place", "bearing"), [((0, 200), 180), ((200, 0), 270), ((-200, 0), 90), ((-100, -100), 45)]
)
def test_bearing_is_where_home_lies(place: tuple[float, float], bearing: float) -> None:
    seen = home_view(place, (0.0, 0.0), 300.0)
    assert seen["bearing_deg"] == pytest.approx(bearing)
    assert seen["distance_m"] == pytest.approx(np.hypot(*place), abs=0.1)
    assert (seen["limit_in_s"], seen["warning"]) == (None, "")


def test_the_limit_is_told_before_it_is_crossed_and_outside() -> None:
    rng = np.random.default_rng(5)
    told = 0
    for _ in range(200):
        place, velocity = rng.uniform(-200, 200, 2), rng.uniform(-25, 25, 2)
        seen = home_view((place[0], place[1]), (velocity[0], velocity[1]), 300.0)
        t = np.arange(0.0, WARNED_S, 0.01)
        away = np.hypot(*(place[:, None] + velocity[:, None] * t))
        crossed = t[away > 300.0]
        if seen["limit_in_s"] is None:
            assert len(crossed) == 0
        else:
            told += 1
            assert crossed[0] == pytest.approx(seen["limit_in_s"], abs=0.07)
            assert "turn" in seen["warning"]
    assert 20 < told < 180
    outside = home_view((0.0, 906.0), (0.0, 17.0), 300.0)
    assert outside["warning"] == "906 m from home, outside 300 m: turn home"


def test_the_state_says_it_once_as_an_event_each_time_it_leaves() -> None:
    state = FlightState(LiveStream(load_calibration()))
    state.limit_m = 250.0
    assert state.as_json()["home"] is None
    for metres in (0.0, 240.0, 260.0, 280.0, 100.0, 270.0):
        place = 50.0 + metres / 111_195.0, 8.0, 100.0
        update = flown(1)
        update.fixes.append(GpsFix(0.0, "fix_3d", 9, place, (0.0, 0.0, 0.0), 0.0, 0.0))
        state._take(update)
    assert state.as_json()["home"]["distance_m"] == pytest.approx(270.0, abs=1.0)
    said = [event["text"] for event in state.events if event["kind"] == "warning"]
    assert said == [f"{m} m from home, outside 250 m: turn home" for m in (260, 270)]


def test_a_flight_card_that_watches_no_distance_leaves_the_usual_limit(tmp_path: Path) -> None:
    plane = load_aircraft("ultrastick25e")
    for asked_m, limit_m in ((0, 300.0), (200, 200.0)):
        file = tmp_path / f"{asked_m}.card"
        around = Envelope(distance_m=asked_m)
        file.write_bytes(logger_card(design("ultrastick25e"), plane, load_calibration(), around))
        assert _limit_m(LiveRequest(flight_card=file)) == limit_m
    assert _limit_m(LiveRequest()) == 300.0

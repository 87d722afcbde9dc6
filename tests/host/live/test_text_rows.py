"""The thesis's own rows in `host live`: stick, servo, position, satellites, time."""

import gzip
from pathlib import Path

import numpy as np
import pytest
from host.live.flight_state import FlightState
from host.live.google_earth import track_document
from host.live.live_stream import LiveStream
from host.live.replay import ReplaySource, replay_source
from host.physical.calibration import load_calibration

from tests.host.test_original_rows import APPENDIX, PRINTED, SECOND

FLIGHT = Path(__file__).parents[2] / "answers" / "inputs" / "rows-paired.txt.gz"  # 20 rows a second


def shown(text: str, portion: int = 100, row_rate_hz: float | None = None) -> FlightState:
    data = text.encode()
    stream = LiveStream(load_calibration(), row_rate_hz=row_rate_hz)
    state = FlightState(stream)
    for at in range(0, len(data), portion):
        update = stream.feed(data[at : at + portion], 100.0 + at / 5000.0)
        state.received(portion, update)
    return state


@pytest.mark.parametrize("row", [APPENDIX, SECOND, PRINTED + "\r\n"], ids=["23", "26", "27"])
def test_stick_servo_throttle_position_and_satellites_are_shown(row: str) -> None:
    state = shown("".join(row.format(roll / 10) for roll in range(20)))
    told, last = state.as_json(), state._row
    assert told["who"]["firmware"].endswith("readings")
    if row.startswith(PRINTED):  # on the bench: no position yet, sticks at zero degrees
        assert (told["gps"]["fix"], told["gps"]["satellites"]) == ("none", 0)
        assert last["servo_elevator_us"] == pytest.approx(108.72 / 0.0756, abs=0.1)
        assert np.isnan(last["servo_rudder_us"])  # nought degrees is printed for two pulses
        return
    assert (told["gps"]["fix"], told["gps"]["satellites"]) == ("fix 2d", 7)
    assert told["gps"]["speed_mps"] == 15.0
    assert state.track.places == [(30.05123, 31.2, 12.0)]
    assert last["servo_elevator_us"] == pytest.approx((108.72 - 3.5) / 0.0756, abs=0.1)
    assert last["rc_throttle_us"] == pytest.approx(1100 + 0.86 * 500, abs=1.0)
    assert last["airspeed_a_mps"] == pytest.approx(15.0)
    assert last["altitude_m"] == 12.0


def test_rows_that_arrive_together_have_different_times() -> None:
    data = "".join(SECOND.format(roll / 10) for roll in range(40)).encode()
    stream = LiveStream(load_calibration())
    half = len(data) // 2
    times = [stream.feed(part, at).rows["t_s"] for part, at in ((data[:half], 5), (data[half:], 6))]
    assert np.all(np.diff(np.concatenate(times)[20:]) > 0.01)
    assert times[1][-1] == pytest.approx(1.0)


def test_a_flight_is_played_at_the_rate_that_its_rows_have(tmp_path: Path) -> None:
    flight = tmp_path / "rows.txt"
    flight.write_bytes(gzip.decompress(FLIGHT.read_bytes()))
    source = replay_source(f"{flight}@max")
    rate_hz = source.row_rate_hz
    assert rate_hz is not None
    assert rate_hz == pytest.approx(20.0, rel=0.1)  # GPS tells
    told: list[str] = []
    stream = LiveStream(load_calibration(), row_rate_hz=rate_hz)
    state = FlightState(stream)
    times = [
        stream.feed(part, 0.0).rows.get("t_s", np.empty(0)) for part in source.portions(told.append)
    ]
    t_s = np.concatenate(times)
    assert len(t_s) == 1473
    np.testing.assert_allclose(np.diff(t_s), 1.0 / rate_hz)
    assert "estimated from the way that GPS saw" in told[0]
    # Its track flies, and Google Earth gets it.
    east, north, _ = state.track.points[-1]
    assert np.hypot(east, north) > 100.0
    assert track_document(state.track.places).count("30.00") > 50


def test_rows_without_a_way_are_played_as_the_thesis_flew_or_as_told(tmp_path: Path) -> None:
    flight = tmp_path / "rows.txt"
    flight.write_text("".join(SECOND.format(roll / 10) for roll in range(40)))
    source = replay_source(str(flight))
    assert source.row_rate_hz == 20.0
    assert replay_source(str(flight), 5.0).row_rate_hz == 5.0
    told: list[str] = []
    parts = ReplaySource(flight, speed=np.inf).portions(told.append)
    assert b"".join(parts) == flight.read_bytes()
    assert "played at 20 a second, as the thesis flew" in told[0]

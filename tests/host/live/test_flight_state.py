"""What bar and tables say: recording proven by blocks, servo jumps, wind, age."""

from typing import Any

import numpy as np
import pytest
from host.live.flight_state import FlightState
from host.live.gps_fix import fix_of_frame
from host.live.link_budget import LinkBudget
from host.live.live_sample import LIVE_UNITS, LiveUpdate
from host.live.live_stream import LiveStream
from host.live.live_track import LiveTrack
from host.live.servo_watch import ServoWatch
from host.physical.calibration import load_calibration
from host.wire.schema_text import packed_schema
from numpy.typing import NDArray

from tests.host.live.radio import sent
from tests.protocol.log_writer import envelope, number, rows


def flown(count: int, **columns: NDArray[np.float64]) -> LiveUpdate:
    made: dict[str, Any] = {name: np.zeros(count) for name in LIVE_UNITS}
    made["t_s"] = np.arange(count) * 0.05
    made |= columns
    return LiveUpdate(made, np.ones(count, bool), 0, [], 0.0)


def test_recording_is_blocks_that_grow() -> None:
    stream = LiveStream(load_calibration())
    state = FlightState(stream)

    def hear(blocks: int, at: int) -> str:
        t_us = np.array([3_000_000 + at * 1_000_000], np.uint32)
        frame = rows("system", 1, t_us=t_us, blocks_written=blocks, avcc_mv=5000, rail=2048)
        data = envelope(frame.tobytes())
        state.received(len(data), stream.feed(data, 0.0))
        return str(state.as_json()["rec"]["state"])

    assert state.as_json()["rec"]["state"] == "unknown"
    for part in sent(4.0):
        if part.data[3] == 0:
            stream.feed(part.data, 0.0)
    assert hear(70, 0) == "not recording"  # a number alone proves nothing
    assert hear(70, 1) == "not recording"
    assert hear(75, 2) == "recording"
    assert state.as_json()["system"]["rail_v"] == pytest.approx(5.0)
    assert hear(3, 3) == "not recording"  # the Mega was reset: it counts from zero


def test_a_servo_that_jumps_is_counted_once_however_the_rows_come() -> None:
    servo = np.full(80, 1500.0)
    servo[30] = 1580.0
    stick = np.full(80, 1500.0)
    whole = flown(80, servo_elevator_us=servo, rc_elevator_us=stick)
    for portion in (1, 7, 80):
        watch = ServoWatch()
        found = []
        for at in range(0, 80, portion):
            part = {name: column[at : at + portion] for name, column in whole.rows.items()}
            drives = whole.mega_drives[at : at + portion]
            found += watch.add(LiveUpdate(part, drives, 0, [], 0.0))
        assert found == ["elevator"]
        assert watch.jumps == {"elevator": 1, "aileron": 0, "rudder": 0, "throttle": 0}


def test_a_servo_that_follows_its_stick_does_not_jump() -> None:
    stick = np.full(80, 1500.0)
    stick[30:33] = 1580.0
    watch = ServoWatch()
    assert watch.add(flown(80, servo_elevator_us=np.roll(stick, 1), rc_elevator_us=stick)) == []


def test_wind_is_what_circles_leave() -> None:
    track, schema = LiveTrack(), packed_schema()
    fix = number("gps_fix", "fix_3d")
    wind_east, wind_north, speed = 3.0, -2.0, 16.0
    for at in range(600):
        psi = 2.0 * np.pi * at / 100
        row = rows(
            "gps", 1, fix=fix, latitude=500_000_000, longitude=80_000_000, height=120_000,
            v_east=round(100 * (speed * np.sin(psi) + wind_east)),
            v_north=round(100 * (speed * np.cos(psi) + wind_north)),
        )[0]  # fmt: skip
        track.add(fix_of_frame(schema, row, 0.0), speed, 0.0, psi)
    assert track.wind_mps == pytest.approx((wind_east, wind_north), abs=0.1)
    assert track.points[-1] == pytest.approx((0.0, 0.0, 0.0))


def test_a_pitot_blown_into_on_the_ground_is_no_wind() -> None:
    track, schema = LiveTrack(), packed_schema()
    row = rows("gps", 1, fix=number("gps_fix", "fix_3d"), v_east=30, v_north=-140)[0]  # carried
    for _ in range(50):
        track.add(fix_of_frame(schema, row, 0.0), 24.0, 0.1, 1.0)
    assert track.wind_mps is None
    assert len(track.points) == 50


def test_no_wind_on_the_ground_and_no_track_without_a_fix() -> None:
    track, schema = LiveTrack(), packed_schema()
    none = rows("gps", 1, fix=number("gps_fix", "none"))[0]
    track.add(fix_of_frame(schema, none, 0.0), 16.0, 0.0, 0.0)
    assert track.points == []
    fix = fix_of_frame(schema, rows("gps", 1, fix=number("gps_fix", "fix_3d"))[0], 0.0)
    track.add(fix, 1.0, 0.0, 0.0)
    track.add(fix, float("nan"), 0.0, 0.0)
    assert track.wind_mps is None


def test_link_counts_what_was_lost_and_knows_silence() -> None:
    link = LinkBudget()
    assert link.at(0.0).silent
    for at in range(100):
        link.add(at * 0.1, 100, 2, 0, True)
    link.add(10.0, 100, 2, 18, True)
    state = link.at(10.5)
    assert state.lost_percent == pytest.approx(100 * 18 / (18 + 2 * 96), abs=0.5)
    assert not state.silent
    assert link.at(11.1).silent
    assert link.at(30.0).rows_per_s == 0.0

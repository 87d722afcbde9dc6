"""The pilot's pulses: repeated exactly, released when they must be, never invented."""

from pathlib import Path

import numpy as np
import pytest
from host.original import rows as original_rows
from host.twin.recorder.sitl_library import TICKS_PER_S, Level, Port
from host.wire.framing import text_of
from host.wire.schema_text import packed_schema

from tests.protocol import oracle
from tests.sitl.bench import Bench, config_places, events, flight, idle_receiver
from tests.sitl.script import Receiver

MEGA, DIRECT_LOST, DIRECT_RELAY = (
    packed_schema().number("drive", word)
    for word in ("mega", "direct_receiver_lost", "direct_relay")
)


def ticks(seconds: float) -> int:
    return round(seconds * TICKS_PER_S)


def test_every_servo_pulse_repeats_an_accepted_width_of_its_channel() -> None:
    bench = Bench()
    plan = flight(34.0)
    plan.give(bench.sitl)
    bench.sitl.power_on()
    bench.sitl.run_until(ticks(18.0))
    start, output, width = bench.sitl.pulses()
    assert len(start) > 4 * 800
    for channel in range(4):
        mine = output == channel
        fall = plan.receiver.start[:, channel] + plan.receiver.width[:, channel]
        for at, ticks_wide in zip(start[mine].tolist(), width[mine].tolist(), strict=True):
            recent = (fall < at) & (fall > at - ticks(0.1))
            assert ticks_wide in plan.receiver.width[recent, channel]
    # From the end of the input to the start of the output: one servo frame and 2 ms at most.
    fall = plan.receiver.start[:, 0] + plan.receiver.width[:, 0]
    mine = start[output == 0]
    for at, ticks_wide in zip(mine.tolist(), width[output == 0].tolist(), strict=True):
        newest = np.searchsorted(fall, at - ticks(0.022)) - 1
        if newest >= 3:
            assert ticks_wide in plan.receiver.width[newest : newest + 3, 0]


def test_relay_engages_only_after_direct_and_then_mega() -> None:
    bench = Bench()
    flight(34.0).give(bench.sitl)  # direct for two seconds, then Mega
    bench.sitl.power_on()
    bench.sitl.run_until(ticks(1.9))
    assert not bench.sitl.state().relay
    bench.sitl.run_until(ticks(5.0))
    assert bench.sitl.state().relay
    assert bench.sitl.state().drive == MEGA
    at, level = bench.sitl.levels(Level.RELAY)
    assert level.tolist() == [1]
    assert ticks(2.1) < int(at[0]) < ticks(2.4)


def test_switch_at_mega_from_the_start_stays_direct() -> None:
    bench = Bench()
    count = 500
    width = np.tile(np.array([3000, 3000, 3000, 2200, 3800]), (count, 1))
    start = (np.arange(count)[:, None] * 40_000) + np.arange(5) * 5000 + 2000
    bench.sitl.add_edges(*Receiver(start, width).edges())
    bench.sitl.power_on()
    bench.sitl.run_until(ticks(9.0))
    assert bench.sitl.levels(Level.RELAY)[0].size == 0


def test_receiver_lost_releases_the_relay_within_100_ms() -> None:
    bench = Bench()
    plan = flight(34.0)
    at, levels = plan.receiver.edges()
    last = int(at[at < ticks(8.0)][-1])
    bench.sitl.add_edges(at[at <= last], levels[at <= last])
    bench.sitl.power_on()
    bench.sitl.run_until(ticks(9.0))
    when, level = bench.sitl.levels(Level.RELAY)
    assert level.tolist() == [1, 0]
    # The pump holds the relay 30 ms longer than the heartbeat.
    assert int(when[1]) - last < ticks(0.1)
    assert bench.sitl.state().drive == DIRECT_LOST
    start, _, width = bench.sitl.pulses()
    assert int(start[-1]) - last < ticks(0.1)
    assert int(width.min()) >= 1800


def test_hung_program_releases_the_relay() -> None:
    """No turn of the main loop, no heartbeat: here the power of the chip alone goes."""
    bench = Bench()
    flight(34.0).give(bench.sitl)
    bench.sitl.power_on()
    bench.sitl.run_until(ticks(5.0))
    bench.sitl.reset(packed_schema().number("reset_cause", "watchdog"))
    bench.sitl.run_for(0.5)
    when, level = bench.sitl.levels(Level.RELAY)
    assert level.tolist() == [1, 0]
    assert int(when[1]) - ticks(5.0) < ticks(0.05)
    bench.sitl.run_until(ticks(12.0))
    assert not bench.sitl.state().relay  # the switch was not seen at direct since


def test_telemetry_keeps_its_budget_and_decodes() -> None:
    bench = Bench()
    flight(34.0).give(bench.sitl)
    bench.sitl.power_on()
    bench.sitl.run_until(ticks(12.0))
    sent = bench.sitl.sent(Port.TELEMETRY)
    assert 12 * 1500 < len(sent) <= 12 * 2600 + 1300
    stream = oracle.decode_stream(sent)
    assert stream.failed == 0
    assert stream.skipped == 0
    kinds = {frame[0] for frame in stream.frames}
    assert kinds >= {0, 1, 2, 3, 4, 5, 6, 7, 8, 9}
    hashes = [frame[1:] for frame in stream.frames if frame[0] == 0]
    assert len(hashes) >= 2


def test_original_rows_for_the_original_station() -> None:
    """Rows of the second flight's kind, five a second at most, read by the host's own parser."""
    bench = Bench()
    plan = flight(34.0)
    plan.give(bench.sitl)
    bench.configure(telemetry=packed_schema().number("telemetry", "ascii"))
    bench.sitl.power_on()
    bench.sitl.run_until(ticks(18.0))
    sent = bench.sitl.sent(Port.TELEMETRY)
    assert len(sent) <= 18 * 2600 + 1300
    rows = sent.split(b"\r")
    assert 80 <= len(rows) <= 18 * 5 + 1
    assert all(row.startswith(b"RLL:") and row.endswith(b",000000000000000") for row in rows[:-1])
    assert max(map(len, rows)) < 360
    parsed = original_rows.parse_rows(sent)
    assert parsed.variant == "26 readings"
    live = slice(10, -1)
    # Rows carry no time: every triple of rates was in one packet (65.5 to 16.4 counts per deg/s).
    rates = np.stack([parsed.values[f"AN{axis}"] for axis in range(3)], axis=1)[live]
    sent_rates = plan.imu.raw[:, :3] * 16.4 / 65.5
    distance = np.abs(rates[:, None, :] - sent_rates[None, :, :]).max(axis=2).min(axis=1)
    assert np.median(distance) < 5.0  # a row takes 60 ms at 57600 baud; the script moves meanwhile
    force = np.stack([parsed.values[f"AN{axis + 3}"] for axis in range(3)], axis=1)[live]
    away = np.abs(force[:, None, :] + plan.imu.raw[None, :, 3:6]).max(axis=2).min(axis=1)
    assert float(away.max()) < 4000.0
    speed = parsed.values["velocitya"][live]
    assert 150.0 < float(np.nanmax(speed)) < 207.0  # 2 kPa are 57.1 m/s
    altitude = parsed.values["altitude"][live]
    assert float(np.nanmin(altitude)) < 200.0


def test_status_line_says_what_is_there() -> None:
    bench = Bench()
    idle_receiver(bench.sitl, 0.1, 6.0)
    bench.sitl.power_on()
    bench.sitl.run_until(ticks(5.5))
    lines = text_of(bench.sitl.sent(Port.USB)).decode("ascii").split("\r\n")
    assert lines[0].startswith("sitl ")
    assert lines[-2].startswith("sitl ")
    assert "imu missing | alpha missing" in lines[-2]
    assert "baro missing | gps missing" in lines[-2]
    assert "rc us 1500 1500 1500 1100 1100" in lines[-2]
    assert "card ready 1" in lines[-2]
    assert 4 <= len(lines) - 2 <= 7


def lose_receiver(hold_ms: int) -> tuple[Bench, int]:
    """Fly with the Mega driving until the receiver falls silent; give the end of its last pulse."""
    bench = Bench()
    bench.configure(hold_ms=hold_ms)
    plan = flight(34.0)
    at, levels = plan.receiver.edges()
    last = int(at[at < ticks(8.0)][-1])
    bench.sitl.add_edges(at[at <= last], levels[at <= last])
    bench.sitl.power_on()
    bench.sitl.run_until(ticks(7.9))
    assert bench.sitl.state().drive == MEGA
    bench.sitl.run_until(ticks(11.0))
    return bench, last


def released_s(bench: Bench, last: int) -> float:
    """Time from the last pulse to the release of the relay."""
    when, level = bench.sitl.levels(Level.RELAY)
    assert level.tolist() == [1, 0]
    return (int(when[1]) - last) / TICKS_PER_S


def test_holding_is_off_unless_asked_for() -> None:
    config = Bench().sitl.default_config()
    start, size = config_places()["hold_ms"]
    assert config[start : start + size] == bytes(size)


@pytest.mark.parametrize("hold_ms", [200, 1000])
def test_holding_delays_the_release_by_its_time_for_surfaces_only(hold_ms: int) -> None:
    plain_s = released_s(*lose_receiver(0))  # one instrument at a time
    bench, last = lose_receiver(hold_ms)
    longer_s = released_s(bench, last) - plain_s
    assert longer_s == pytest.approx(hold_ms / 1000, abs=0.01)
    assert longer_s <= 1.001  # a turn of the loop
    start, output, width = bench.sitl.pulses()
    held = start > last + ticks(0.1)
    assert set(output[held].tolist()) == {0, 1, 2}  # never throttle
    for channel in range(3):
        mine = width[(output == channel) & held]
        before = width[(output == channel) & (start <= last + ticks(0.1))][-1]
        assert set(mine.tolist()) == {int(before)}
        assert len(mine) >= hold_ms / 20 - 5
    # From the release on there is not one pulse more.
    assert (int(start[-1]) - last) / TICKS_PER_S < hold_ms / 1000 + 0.1


def test_more_than_a_second_of_holding_is_refused() -> None:
    with pytest.raises(ValueError, match="out of its range"):
        Bench().configure(hold_ms=1001)


def test_relay_that_never_pulls_in_is_told_and_wants_the_switch_sequence() -> None:
    """Its contact stays open: released 50 ms behind the first edge, with an alarm."""
    bench = Bench()
    bench.sitl.cut_relay()
    idle_receiver(bench.sitl, 0.1, 3.0)
    idle_receiver(bench.sitl, 3.0, 8.0, switch_us=1900)
    idle_receiver(bench.sitl, 8.0, 10.0)
    idle_receiver(bench.sitl, 10.0, 14.0, switch_us=1900)
    bench.sitl.power_on()
    bench.sitl.run_until(ticks(3.5))
    assert bench.sitl.state().drive == DIRECT_RELAY
    bench.sitl.run_until(ticks(7.9))
    assert bench.sitl.state().drive == DIRECT_RELAY
    at, level = bench.sitl.levels(Level.BUZZER)
    assert np.count_nonzero(level[at > ticks(3.0)] == 1) >= 8
    bench.sitl.cut_relay(False)
    bench.sitl.run_until(ticks(12.0))
    assert bench.sitl.state().relay
    at, level = bench.sitl.levels(Level.BUZZER)
    assert not np.any(at > ticks(11.0))


def test_relay_that_drops_in_flight_is_told(tmp_path: Path) -> None:
    bench = Bench()
    flight(34.0).give(bench.sitl)
    bench.power_on_and_record(8.0)
    assert bench.sitl.state().relay
    bench.sitl.cut_relay()
    bench.sitl.run_for(0.1)
    assert bench.sitl.state().drive == DIRECT_RELAY
    bench.sitl.run_until(ticks(20.0))
    assert bench.sitl.state().drive == DIRECT_RELAY
    bench.stop()
    assert events(bench.log(tmp_path), "relay_lost") == [1]

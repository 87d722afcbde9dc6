"""Receivers of every timing, the original IMU, lost sensors."""

import struct
from pathlib import Path

import numpy as np
import pytest
from host.twin.recorder.sitl_library import TICKS_PER_S, byte_ticks

from tests.sitl import script as scripted
from tests.sitl.bench import Bench, events, flight, missing
from tests.sitl.compare import compare

FRESH, TRIGGERED, ORIGINAL = 0x0400, 0x2000, 0x4000


def ticks(seconds: float) -> int:
    return round(seconds * TICKS_PER_S)


@pytest.mark.parametrize("simultaneous", [False, True])
@pytest.mark.parametrize("frame_us", [14_000.0, 20_000.0, 22_500.0])
def test_receivers(tmp_path: Path, frame_us: float, simultaneous: bool) -> None:
    bench = Bench()
    plan = flight(34.0, frame_us, simultaneous)
    plan.give(bench.sitl)
    bench.power_on_and_record(10.0)
    bench.sitl.run_until(ticks(20.0))
    bench.stop()
    log = bench.log(tmp_path)
    found = {d.channel: d for d in compare(log.frames, plan)}
    for name in scripted.RC:
        assert found[name].good, found[name]
        assert found[name].high - found[name].low > 1500
    system = log.frames["system"]
    # What stood on the lines before the first pulses is not known: at most one each.
    assert int(system["rc_glitches"].max()) == int(system["rc_glitches"].min()) <= 5
    assert np.all(np.abs(system["rc_frame_us"][2:].astype(int) - frame_us) < 2000)
    assert bench.sitl.state().lost_edges == 0


def original(index: int) -> tuple[bytes, bytes, list[int]]:
    """Return both original packets and the raw values they make."""
    wave = [
        round(float(scripted.triangle(np.array(index), 101 + 6 * k, -8000 - k, 8000 + k)))
        for k in range(9)
    ]
    angles = [value / 100 for value in wave[:3]]
    first = struct.pack("<8f", *angles, *wave[3:8])
    second = struct.pack("<8f", wave[8], 29.9, 31.2, 120.0, 45.0, 12.5, 1.0, 8.0)
    return first, second, wave


def test_original_imu_packets(tmp_path: Path) -> None:
    bench = Bench()
    count = 500
    rows = [original(index) for index in range(count)]
    start = ticks(0.1) + np.arange(count) * ticks(0.02)
    # Both packets of 33 bytes at 100 kHz, one behind the other.
    at = np.stack([start, start + 8000], axis=1).ravel()
    for index in range(count):
        bench.sitl.add_packets([at[2 * index]], scripted.ORIGINAL_1, [rows[index][0]], byte_us=90.0)
        bench.sitl.add_packets(
            [at[2 * index + 1]], scripted.ORIGINAL_2, [rows[index][1]], byte_us=90.0
        )
    bench.power_on_and_record(8.0)
    bench.stop()
    log = bench.log(tmp_path)
    ident = log.frames["ident"]
    live = ident[ident["t_us"] < 9_500_000]
    assert np.all(live["valid"] & (ORIGINAL | TRIGGERED) == ORIGINAL)  # the timer sets the time
    assert events(log, "imu_found") == [1]
    arrived = start + 8000 + 33 * byte_ticks(90.0)
    row = np.searchsorted(arrived, live["t_us"].astype(np.int64) * 2, side="right") - 1
    want = np.array([rows[r][2] for r in row])
    names = ("phi", "theta", "psi", "p", "q", "r", "ax", "ay", "az")
    for k, name in enumerate(names):
        assert np.array_equal(live[name], want[:, k]), name
    # 50 Hz of packets in 100 Hz of frames: every other one is fresh.
    fresh = (live["valid"] & FRESH) != 0
    assert abs(float(fresh.mean()) - 0.5) < 0.02
    assert np.all(np.diff(live["t_us"]) == 10_000)


def test_imu_lost_then_timer_then_found(tmp_path: Path) -> None:
    bench = Bench()
    plan = flight(34.0)
    gone = (plan.imu.start > ticks(4.0)) & (plan.imu.start < ticks(7.0))
    keep = np.flatnonzero(~gone)
    bench.sitl.add_edges(*plan.receiver.edges())
    packets = plan.imu.packets()
    bench.sitl.add_packets(plan.imu.start[keep], scripted.IMU_ADDRESS, [packets[i] for i in keep])
    bench.power_on_and_record(10.0)
    bench.sitl.run_until(ticks(20.0))
    bench.stop()
    log = bench.log(tmp_path)
    ident = log.frames["ident"]
    at_s = ident["t_us"] / 1e6
    silent = (at_s > 4.1) & (at_s < 6.9)
    assert silent.sum() > 270
    assert np.all(ident["valid"][silent] & (FRESH | TRIGGERED) == 0)
    assert len(np.unique(ident["imu_seq"][silent])) == 1
    assert np.all(ident["valid"][at_s > 7.1] & (FRESH | TRIGGERED) == FRESH | TRIGGERED)
    gaps = np.diff(ident["t_us"])
    assert int(gaps.max()) <= 16_000
    assert missing(ident["count"]) == 0
    assert len(events(log, "imu_lost")) == 1
    assert events(log, "imu_found") == [0, 0]
    assert int(log.frames["system"]["imu_lost"].max()) == 0  # a silence is no gap in its sequence


def test_damaged_imu_packets_are_dropped_and_counted(tmp_path: Path) -> None:
    bench = Bench()
    plan = flight(34.0)
    packets = plan.imu.packets()
    rng = np.random.default_rng(5)
    damaged = rng.choice(len(packets), len(packets) // 100, replace=False)
    for i in damaged:
        broken = bytearray(packets[i])
        broken[rng.integers(len(broken))] ^= 1 << int(rng.integers(8))
        packets[i] = bytes(broken)
    bench.sitl.add_packets(plan.imu.start, scripted.IMU_ADDRESS, packets)
    bench.power_on_and_record(15.0)
    bench.stop()
    log = bench.log(tmp_path)
    ident = log.frames["ident"]
    good = np.delete(plan.imu.raw, damaged, axis=0)
    known = {tuple(row) for row in good.tolist()}
    rows = np.stack([ident[name] for name in scripted.IMU], axis=1).tolist()
    assert all(tuple(row) in known for row in rows)
    until = int(log.frames["system"]["t_us"][-1]) * 2
    ended = plan.imu.start + 37 * byte_ticks() <= until
    assert int(log.frames["system"]["imu_bad_packets"][-1]) == int(ended[damaged].sum())


def test_pressure_sensor_lost(tmp_path: Path) -> None:
    bench = Bench()
    flight(34.0).give(bench.sitl)
    bench.power_on_and_record(5.0)
    bench.sitl.remove_pressure()
    bench.sitl.run_until(ticks(20.0))
    bench.stop()
    log = bench.log(tmp_path)
    assert events(log, "baro_lost") == [1]
    assert int(log.frames["baro"]["t_us"].max()) < 5_700_000
    assert missing(log.frames["ident"]["count"]) == 0
    assert int(np.diff(log.frames["ident"]["t_us"]).max()) < 12_000

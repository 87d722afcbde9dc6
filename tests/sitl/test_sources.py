"""Sensors that stand in for others, and what GPS time is used for."""

import struct
from pathlib import Path

import numpy as np
import pytest
from host.twin.recorder.sitl_library import TICKS_PER_S

from tests.sitl import script as scripted
from tests.sitl.bench import Bench, flight, idle_receiver

# BST-BMP280-DS001-26, section 3.12: dig_T1 ... dig_P9, and what 519888 and 415148 mean with them.
BMP280_WORDS = (
    27504, 26435, -1000, 36477, -10685, 3024, 2855, 140, -7, 15500, -14600, 6000,
)  # fmt: skip
BMP280_RAW = (519888, 415148)
GPS_EPOCH_DAYS = 3657  # 1980-01-06 since 1970-01-01
ORIGINAL_GPS = 2


def ticks(seconds: float) -> int:
    return round(seconds * TICKS_PER_S)


def test_bmp280_end_to_end(tmp_path: Path) -> None:
    bench = Bench()
    # The example's point, then 4000 counts of pressure in 10 s.
    step = ticks(0.1)
    rows = np.tile(np.array(BMP280_RAW, dtype=float), (200, 1))
    rows[50:150, 1] += np.arange(100) * 40.0
    rows[150:, 1] += 4000.0
    bench.sitl.set_bmp280(BMP280_WORDS, 0, step, rows)
    bench.power_on_and_record(12.0)
    bench.stop()
    log = bench.log(tmp_path)
    baro = log.frames["baro"]
    assert len(baro) > 11 * 25
    assert set(baro["sensor"].tolist()) == {2}
    still = baro[baro["t_us"] < 4_900_000]
    assert np.all(still["raw_temperature"] == BMP280_RAW[0])
    assert np.all(still["raw_pressure"] == BMP280_RAW[1])
    assert np.all(still["temperature"] == 2508)
    # 100653.27 Pa; the datasheet's own 32-bit arithmetic gives 3 Pa more.
    assert np.all(np.abs(still["static_pressure"] / 16.0 - 100653.27) < 4.0)
    # Each value is that of its t_us, the middle of the conversion.
    grid = np.arange(len(rows)) * step
    expected = np.floor(np.interp(baro["t_us"] * 2.0, grid, rows[:, 1]))
    assert np.abs(baro["raw_pressure"].astype(np.int64) - expected).max() <= 1
    assert int(baro["raw_pressure"].max()) > BMP280_RAW[1] + 3700
    words = log.frames["baro_coefficients"]["words"][-1]
    assert [int(w) for w in words] == [w & 0xFFFF for w in BMP280_WORDS]
    assert float(log.table()["static_pa"].notna().mean()) > 0.95  # but for the first half second


def original_pair(index: int) -> tuple[bytes, bytes, tuple[float, ...]]:
    position = (29.9 + index * 1e-4, 31.2 - index * 1e-4, 120.0 + index, 45.0 + index % 300,
                12.5 + index % 20, 1.0, 5.0 + index % 7)  # fmt: skip
    first = struct.pack("<8f", 1.0, 2.0, 3.0, 10.0, 20.0, 30.0, 100.0, 200.0)
    return first, struct.pack("<8f", -8190.0, *position), position


def test_position_from_the_original_imus_packet(tmp_path: Path) -> None:
    bench = Bench()
    bench.configure(gps_source=ORIGINAL_GPS)
    count = 400
    rows = [original_pair(index // 10) for index in range(count)]  # 5 Hz in packets of 50 Hz
    start = ticks(0.1) + np.arange(count) * ticks(0.02)
    for at, (first, second, _) in zip(start.tolist(), rows, strict=True):
        bench.sitl.add_packets([at], scripted.ORIGINAL_1, [first], byte_us=90.0)
        bench.sitl.add_packets([at + 8000], scripted.ORIGINAL_2, [second], byte_us=90.0)
    bench.power_on_and_record(6.0)
    bench.stop()
    gps = bench.log(tmp_path).frames["gps"]
    assert len(gps) > 20
    assert set(gps["source"].tolist()) == {ORIGINAL_GPS}
    assert set(gps["fix"].tolist()) == {3}
    for row in gps:
        sent = rows[int(np.searchsorted(start, int(row["t_us"]) * 2, side="right")) - 1][2]
        # float32 of the packet: 2e-6 degrees
        assert row["latitude"] * 1e-7 == pytest.approx(sent[0], abs=3e-6)
        assert row["longitude"] * 1e-7 == pytest.approx(sent[1], abs=3e-6)
        assert row["height"] * 1e-3 == pytest.approx(sent[2], abs=0.01)
        assert row["course"] * 1e-2 == pytest.approx(sent[3], abs=0.02)
        assert row["ground_speed"] * 1e-2 == pytest.approx(sent[4], abs=0.02)
        assert int(row["satellites"]) == int(sent[6])


def fat_stamp(image: bytearray, name: bytes) -> tuple[int, int]:
    """Return the date and time of last change of a root entry, as FAT stores them."""
    at = bytes(image[: 4 << 20]).index(name)
    time, date = struct.unpack_from("<HH", image, at + 22)
    return date, time


def test_files_carry_the_date_of_gps() -> None:
    bench = Bench()
    plan = flight(34.0)
    plan.give(bench.sitl)
    bench.power_on_and_record(19.0)
    bench.stop()
    ended_s = bench.sitl.now() / TICKS_PER_S
    date, time = fat_stamp(bench.image, b"FLT00001BIN")
    epoch = int(np.searchsorted(plan.gps.start, ticks(ended_s)) - 1)
    week, itow_ms = (int(plan.gps.values[name][epoch]) for name in ("week", "itow_ms"))
    seconds = week * 604_800 + itow_ms // 1000 - 18  # UTC
    day = np.datetime64("1970-01-01") + GPS_EPOCH_DAYS + seconds // 86_400
    year, month, of_month = (int(part) for part in str(day).split("-"))
    assert date == (year - 1980) << 9 | month << 5 | of_month
    of_day = seconds % 86_400
    found_s = (time >> 11) * 3600 + (time >> 5 & 63) * 60 + (time & 31) * 2
    assert 0 <= of_day - found_s < 8  # closing and preparing the next file take time


def test_without_gps_the_date_says_so() -> None:
    bench = Bench()
    idle_receiver(bench.sitl, 0.1, 10.0)
    bench.power_on_and_record(2.0)
    bench.stop()
    assert fat_stamp(bench.image, b"FLT00001BIN")[0] == (2026 - 1980) << 9 | 1 << 5 | 1

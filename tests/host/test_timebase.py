"""The Mega's clock: wraps, long gaps, GPS scale, sessions."""

from pathlib import Path

import numpy as np
import pytest
from host.errors import LogError

from tests.host.logs import even, flight, read, written
from tests.protocol.flights import ident, simple_log, slow, wrapped, write_flight
from tests.protocol.log_writer import BLOCK, LogWriter, Timed


def test_clock_that_wraps(tmp_path: Path) -> None:
    streams = flight(4.0, start_us=2**32 - 1_500_000)
    truth_us = even(streams[0], start_us=2**32 - 1_500_000)
    assert (np.diff(streams[0].rows["t_us"].astype(np.int64)) < 0).any()
    columns = read(tmp_path, written(*streams)).columns()
    np.testing.assert_allclose(columns["t_s"], (truth_us - truth_us[0]) * 1e-6, atol=2e-5)
    assert np.isfinite(columns["static_pa"]).mean() > 0.98


@pytest.mark.parametrize("minutes", [20, 60, 200])
def test_long_loss_keeps_its_wraps(tmp_path: Path, minutes: int) -> None:
    writer = LogWriter()
    writer.begin()
    before_us = write_flight(writer, 5.0)
    lost = minutes * 60 * 14
    writer.skip(lost)
    again_us = before_us + minutes * 60_000_000
    write_flight(writer, 5.0, start_us=again_us, first_count=minutes * 6000)
    writer.end()
    log = read(tmp_path, writer.data())
    t_s = log.columns()["t_s"]
    assert t_s[-1] == pytest.approx(minutes * 60 + 10, abs=0.1)
    (loss,) = log.loss.losses
    assert loss.blocks == lost
    assert loss.seconds == pytest.approx(minutes * 60, abs=0.1)
    assert loss.frames == pytest.approx(minutes * 6000 - 500, abs=1)


@pytest.mark.parametrize("ppm", [-4800.0, 0.0, 3000.0])
def test_gps_corrects_the_clock(tmp_path: Path, ppm: float) -> None:
    rng = np.random.default_rng(7)
    streams = flight(120.0)
    gps = next(stream for stream in streams if stream.rows["id"][0] == 5)
    t_us = streams[0].finished_us[0] + np.arange(len(gps.rows)) * 200_000
    true_ms = 345_600_000 + t_us * 1e-3 * (1 + ppm * 1e-6)
    gps.rows["itow_ms"] = true_ms
    late_us = rng.normal(80_000, 8_000, len(t_us))
    late_us[rng.integers(0, len(t_us), 40)] += 300_000  # a receiver that stutters
    gps.rows["t_us"] = wrapped((t_us + late_us).astype(np.int64))
    log = read(tmp_path, written(*streams))
    clock = log.clock
    assert clock is not None
    assert clock.applied
    assert abs(clock.scale_error * 1e6 - ppm) < 1.5 * clock.half_width * 1e6
    assert clock.half_width < 100e-6
    t_s = log.columns()["t_s"]
    raw_s = (streams[0].rows["t_us"][-1] - streams[0].rows["t_us"][0]) * 1e-6
    assert t_s[-1] == pytest.approx(raw_s * (1 + clock.scale_error), abs=1e-6)


def test_half_width_covers_the_truth(tmp_path: Path) -> None:
    from host.physical.timebase import fit_gps

    hits = 0
    for seed in range(200):
        rng = np.random.default_rng(seed)
        t_us = np.arange(600, dtype=np.int64) * 200_000
        gps_ms = np.rint(t_us * 1e-3 * 1.002 + rng.normal(0, 5, 600)).astype(np.int64)
        fit = fit_gps([(t_us, gps_ms)])
        assert fit is not None
        hits += abs(fit.scale_error - 0.002) <= fit.half_width
    assert 180 <= hits <= 200


def test_clock_without_gps_is_left_alone(tmp_path: Path) -> None:
    streams = flight(3.0)
    log = read(tmp_path, written(streams[0]))
    assert log.clock is None
    assert log.sessions[0].clock_scale == 1.0


def two_sessions(gap_s: float) -> bytes:
    """Return a log with a reset in flight: the clock starts anew, GPS time goes on."""
    writer = LogWriter()
    writer.begin()
    write_flight(writer, 30.0)
    writer.resume()
    rng = np.random.default_rng(3)
    later = [ident(500_000, 3000, rng=rng), *slow(500_000, 30.0, rng=rng)]
    gps = next(stream for stream in later if stream.rows["id"][0] == 5)
    gps.rows["itow_ms"] += round((32.0 + gap_s - 0.5) * 1000)
    writer.extend(later)
    writer.end()
    return writer.data()


def test_sessions_are_placed_by_gps(tmp_path: Path) -> None:
    log = read(tmp_path, two_sessions(1.7))
    table = log.table()
    first, second = (table[table["session"] == number] for number in (1, 2))
    assert len(first) == len(second) == 3000
    gap_s = second["t_s"].iloc[0] - first["t_s"].iloc[-1]
    assert gap_s == pytest.approx(1.7 + 0.01, abs=0.003)
    assert log.complete == "complete"
    assert not log.loss.any


def test_one_session(tmp_path: Path) -> None:
    log = read(tmp_path, two_sessions(1.7), session=2)
    table = log.table()
    assert set(table["session"]) == {2}
    assert table["t_s"].iloc[0] == 0.0
    assert not log.loss.any
    with pytest.raises(LogError, match="holds 1, 2"):
        read(tmp_path, two_sessions(1.7), session=9)


def test_older_flight_behind_the_end(tmp_path: Path) -> None:
    older = simple_log(20.0, seed=4)
    size = len(older.data())
    newer = LogWriter(session=2, first_block_before=older.data()[:BLOCK], preallocated=size)
    newer.begin()
    newer.extend([Timed(*_one_ident())])
    newer.flush()
    newer.tail(older.data()[newer.sequence * BLOCK :])
    log = read(tmp_path, newer.data())
    assert len(log.frames["ident"]) == 1
    (foreign,) = log.selection.foreign
    assert (foreign.file_id, foreign.sessions) == (older.file_id, (1,))
    assert (log.complete, log.loss.losses) == ("truncated", ())
    again = read(tmp_path, newer.data(), file_id=older.file_id)
    assert 0 < len(again.frames["ident"]) < 2000
    assert again.complete == "damaged"


def _one_ident() -> tuple[np.ndarray, np.ndarray]:
    one = ident(10_000, 1, rng=np.random.default_rng(0))
    return one.rows, one.finished_us

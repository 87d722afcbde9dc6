"""The synchronous table against a truth: ramps, whose value at any instant is known."""

from pathlib import Path

import numpy as np
import pytest
from host.log import read_log
from host.physical.columns import ANALOGUE, COLUMNS
from numpy.typing import NDArray

from tests.host.logs import even, flight, read, written
from tests.protocol.flights import simple_log
from tests.protocol.log_writer import Timed

COUNT_PER_S = 150.0  # slope of the ramps: 1.5 raw steps per row, within every channel's range


def ramps(seconds: float = 6.0, age_us: int = 260) -> tuple[list[Timed], NDArray[np.int64]]:
    """Return streams whose channels are ramps in time, sampled where the schema says."""
    streams = flight(seconds)
    t_us = even(streams[0])
    rows = streams[0].rows
    rows["imu_age"] = age_us // 4
    for slot, name in enumerate(ANALOGUE):
        late_us = 1728 + 104 * slot
        rows[name] = np.rint(1500 + COUNT_PER_S * 4 * (t_us - t_us[0] + late_us) * 1e-6 / 4)
    for name, delay_us in (("q", 4800.0), ("az", 4900.0), ("theta", 0.0)):
        sampled_us = t_us - t_us[0] - delay_us - age_us
        rows[name] = np.rint(-400 + COUNT_PER_S * sampled_us * 1e-6)
    return streams, t_us


@pytest.mark.parametrize("age_us", [260, 7000])  # 7 ms are one raw step of the ramps
def test_every_channel_stands_at_the_instant_of_its_row(tmp_path: Path, age_us: int) -> None:
    streams, t_us = ramps(age_us=age_us)
    log = read(tmp_path, written(*streams))
    columns = log.columns()
    t_s = (t_us - t_us[0]) * 1e-6
    for name, (column, line) in ANALOGUE.items():
        zero, slope = (log.calibration.lines[line].zero[0], log.calibration.lines[line].slope[0])
        truth = ((1500 + COUNT_PER_S * t_s) * 0.25 - zero) * slope
        off = np.abs(columns[column] - truth)[1:] / (0.25 * slope)
        assert np.nanmax(off) < 0.51, name  # half a raw step; 2 ms of delay would be 0.3 more
        assert not np.isnan(off).any()
    frame = log.schema.by_name["ident"]
    for name, column in (("q", "q_radps"), ("az", "az_mps2"), ("theta", "theta_rad")):
        truth = -400 + COUNT_PER_S * t_s
        off = np.abs(columns[column] / frame.field(name).scale - truth)[:-2]
        assert np.nanmax(off) < 0.51, name
        assert not np.isnan(off).any()


def test_without_alignment_each_value_is_the_sample(tmp_path: Path) -> None:
    streams, _ = ramps()
    log = read(tmp_path, written(*streams))
    table = log.table(aligned=False)
    raw = streams[0].rows
    line = log.calibration.lines["channel.alpha_a"]
    counts = table["alpha_a_rad"] / line.slope[0] + line.zero[0]
    np.testing.assert_allclose(counts, raw["alpha_a"] * 0.25, atol=1e-9)
    scale = log.schema.by_name["ident"].field("q").scale
    np.testing.assert_allclose(table["q_radps"], raw["q"] * scale, rtol=1e-12)
    for name, column in log.channels().items():
        np.testing.assert_allclose(column, table[name], atol=1e-12, err_msg=name)


def test_nothing_is_interpolated_over_a_lost_row(tmp_path: Path) -> None:
    streams, _ = ramps()
    rows = streams[0].rows
    keep = np.ones(len(rows), bool)
    keep[100:103] = False
    fast = type(streams[0])(rows[keep], streams[0].finished_us[keep])
    columns = read(tmp_path, written(fast, *streams[1:])).columns()
    # Analogue values of row 103 would need row 102, inertial ones of row 99 row 100.
    assert np.flatnonzero(np.isnan(columns["alpha_a_rad"])).tolist() == [0, 100]
    assert np.flatnonzero(np.isnan(columns["q_radps"])).tolist() == [99, len(rows) - 4]
    assert np.isfinite(columns["servo_elevator_us"]).all()


def test_invalid_samples_are_not_used(tmp_path: Path) -> None:
    streams, _ = ramps()
    rows = streams[0].rows
    valid = rows["valid"]
    valid[200] &= ~np.uint16(1 << 0)  # alpha_a
    rows["q"][300] = -32768
    rows["rc_switch"][400] = 0
    columns = read(tmp_path, written(*streams)).columns()
    assert np.flatnonzero(np.isnan(columns["alpha_a_rad"])).tolist() == [0, 200, 201]
    assert np.flatnonzero(np.isnan(columns["q_radps"])).tolist() == [299, 300, len(rows) - 1]
    assert np.flatnonzero(np.isnan(columns["rc_switch_us"])).tolist() == [400]
    # The other vane still gives an angle of attack.
    np.testing.assert_allclose(columns["alpha_rad"][200], columns["alpha_b_rad"][200])


@pytest.mark.parametrize("every", [2, 10])
def test_a_slower_imu_fills_the_rows_between(tmp_path: Path, every: int) -> None:
    streams, t_us = ramps(100.0)  # more rows than one piece of the table
    rows = streams[0].rows
    behind = np.arange(len(rows)) % every
    old = behind > 0
    for name in ("p", "q", "r", "ax", "ay", "az", "phi", "theta", "psi"):
        rows[name] = rows[name][np.arange(len(rows)) - behind]
    rows["imu_age"] += (behind * 10_000 // 4).astype(np.uint16)
    rows["imu_seq"] = np.arange(len(rows)) // every
    rows["valid"][old] &= ~np.uint16(1 << 10)
    columns = read(tmp_path, written(*streams)).columns()
    truth = -400 + COUNT_PER_S * (t_us - t_us[0]) * 1e-6
    off = np.abs(columns["q_radps"] / 2.664624812204e-4 - truth)[: -every - 1]
    assert np.nanmax(off) < 0.51
    assert not np.isnan(off).any()


def test_saturated_samples_are_invalid(tmp_path: Path) -> None:
    streams, _ = ramps()
    rows = streams[0].rows
    rows["q"][50:53] = 32767
    rows["valid"][50:53] &= ~np.uint16(1 << 11)
    columns = read(tmp_path, written(*streams)).columns()
    assert np.flatnonzero(np.isnan(columns["q_radps"]))[:4].tolist() == [49, 50, 51, 52]


def test_heading_is_unwrapped_across_pieces_and_gaps(tmp_path: Path) -> None:
    streams = flight(400.0)
    t_us = even(streams[0])
    degrees = 90.0 + 30.0 * (t_us - t_us[0]) * 1e-6  # 33 turns, beyond several pieces of rows
    streams[0].rows["psi"] = np.rint(((degrees + 180.0) % 360.0 - 180.0) * 100.0)
    streams[0].rows["imu_age"] = 0
    streams[0].rows["valid"][1000:1010] &= ~np.uint16(1 << 12)
    columns = read(tmp_path, written(*streams)).columns()
    off = columns["psi_rad"] - np.deg2rad(degrees)
    assert np.nanmax(np.abs(off)) < 1e-4
    assert np.count_nonzero(np.isnan(off)) == 10
    raw = read(tmp_path, written(*streams)).channels()["psi_rad"]
    np.testing.assert_allclose(raw, columns["psi_rad"], atol=1e-9)


@pytest.mark.parametrize(("bits", "source"), [(0x3FF, "measured"), (0x03F, "commanded")])
def test_inputs_are_positions_where_measured_else_commands(
    tmp_path: Path, bits: int, source: str
) -> None:
    streams = flight(2.0)
    even(streams[0])
    rows = streams[0].rows
    rows["valid"] = (rows["valid"] & ~np.uint16(0x3FF)) | bits
    rows["valid"][:100] |= np.uint16(1 << 15)  # the Mega drives
    rows["valid"][100:] &= ~np.uint16(1 << 15)
    log = read(tmp_path, written(*streams))
    table = log.table()
    assert log.inputs == dict.fromkeys(("elevator", "aileron", "rudder"), source)
    assert table.attrs["inputs"]["aileron"] == source
    if source == "measured":
        left, right = (table[f"aileron_{side}_rad"].to_numpy() for side in ("left", "right"))
        expected = 0.5 * (left - right)
    else:
        line = log.calibration.lines["pulse.aileron"]
        pulse = np.where(rows["valid"] >> 15, rows["servo_aileron"], rows["rc_aileron"]) * 0.5
        expected = (pulse - line.zero[0]) * line.slope[0]
    np.testing.assert_allclose(table["aileron_rad"], expected, atol=1e-12)
    assert table["mega_drives"].tolist() == [1] * 100 + [0] * 100


def test_packets_of_the_original_imu_are_turned_once(tmp_path: Path) -> None:
    streams = flight(2.0)
    even(streams[0])
    rows = streams[0].rows
    rows["valid"] |= np.uint16(1 << 14)
    for name in ("p", "q", "r"):
        rows[name] = 164  # 10 deg/s at 16.4 LSB per deg/s
    rows["ax"], rows["ay"], rows["az"] = 0, 0, 8192  # level at rest, as the old firmware says it
    table = read(tmp_path, written(*streams)).table(aligned=False)
    np.testing.assert_allclose(table["q_radps"], np.deg2rad(10.0), rtol=1e-6)
    np.testing.assert_allclose(table["az_mps2"], -9.80665, rtol=1e-6)


def test_streaming_gives_the_same_table(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    data = written(*flight(300.0))
    whole = read(tmp_path, data).columns()
    monkeypatch.setattr("host.wire.store.KEEP_BLOCKS", 0)
    monkeypatch.setattr("host.wire.frames.BLOCKS_AT_ONCE", 97)
    log = read(tmp_path, data)
    assert not log.store.in_memory
    pieces = log.columns()
    for column in COLUMNS:
        np.testing.assert_array_equal(pieces[column.name], whole[column.name], column.name)
    assert len(log.frames["ident"]) == len(whole["t_s"])


def test_table_says_its_units(tmp_path: Path) -> None:
    table = read(tmp_path, written(*flight(1.0))).table()
    assert list(table.columns) == [column.name for column in COLUMNS]
    assert table.attrs["units"]["qbar_pa"] == "Pa"
    assert table.attrs["calibration"] == "default"


def test_a_log_says_in_a_line_what_it_is(tmp_path: Path) -> None:
    path = tmp_path / "<b>flight.bin"
    path.write_bytes(simple_log(3.0).data())
    log = read_log(path)
    assert "300 rows, complete, nothing lost" in repr(log)
    assert "&lt;b&gt;" in log._repr_html_() and "<b>" not in log._repr_html_()

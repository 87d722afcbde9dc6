"""Overview and packing: extremes survive, numbers come back, sizes hold."""

import base64
import zlib
from dataclasses import replace

import numpy as np
import pytest
from host.report import page_data as sizes
from host.report.channel_list import channels_of
from host.report.overview import buckets, min_max
from host.report.packing import Packed, pack
from host.report.page_data import OVERVIEW_BYTES, PAGE_BYTES, page_data
from host.report.shown_flight import ShownFlight
from host.sysid.maneuvers import DetectedManeuver, Grade
from numpy.typing import NDArray


def unpacked(packed: Packed) -> tuple[NDArray[np.float64], list[NDArray[np.float64]]]:
    """Read a block as the page does, written again from its description."""
    raw = np.frombuffer(zlib.decompress(base64.b64decode(packed.body)), np.uint8)
    rows = packed.head["rows"]
    ticks = raw[: 4 * rows].reshape(4, rows).T.copy().view("<u4")[:, 0].cumsum()
    values = []
    for at, (low, step) in enumerate(packed.head["scales"]):
        part = raw[4 * rows + 2 * rows * at :][: 2 * rows].reshape(2, rows).T.copy()
        numbers = part.view("<u2")[:, 0].cumsum() % 65536
        values.append(np.where(numbers == 65535, np.nan, low + step * numbers))
    return packed.head["start_s"] + ticks * packed.head["tick_s"], values


def test_values_come_back_to_their_step_and_nothing_stays_nothing() -> None:
    rng = np.random.default_rng(1)
    t_s = np.cumsum(rng.uniform(0.004, 0.006, 5000)) + 17.0
    series = [rng.normal(size=5000).cumsum(), np.full(5000, np.nan), np.full(5000, 3.0)]
    series[0][100:200] = np.nan
    packed = pack(t_s, series)
    times, back = unpacked(packed)
    assert np.abs(times - t_s).max() < 2e-6
    for want, got, (_, step) in zip(series, back, packed.head["scales"], strict=True):
        assert (np.isnan(want) == np.isnan(got)).all()
        known = np.isfinite(want)
        assert not known.any() or np.abs(want - got)[known].max() <= 0.5 * step + 1e-12


def test_overview_keeps_every_peak_and_shows_a_gap() -> None:
    t_s = np.arange(100_000) / 200.0
    values = np.sin(t_s)
    values[12_345] = 9.0
    values[60_000:70_000] = np.nan
    own = buckets(t_s, 4000)
    drawn = min_max(values, own)
    assert np.nanmax(drawn) == 9.0 and np.nanmin(drawn) == np.nanmin(values)
    hole = (own.t_s > t_s[60_100]) & (own.t_s < t_s[69_900])
    assert np.isnan(drawn[hole]).all() and np.isfinite(drawn[~hole]).mean() > 0.99


def test_page_stays_below_its_size_and_says_what_it_left_out(
    flight: ShownFlight, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sizes, "OVERVIEW_BYTES", OVERVIEW_BYTES // 10)
    monkeypatch.setattr(sizes, "PAGE_BYTES", PAGE_BYTES // 10)
    rng = np.random.default_rng(2)
    rows = 60_000
    t_s = np.arange(rows) / 200.0
    noise = {f"noise{k}": rng.normal(size=rows) for k in range(12)}
    item = DetectedManeuver("elevator_rad", "doublet", 0.0, 1.0, 4.0, 0.1, 3)
    points = [replace(item, start_s=at, end_s=at + 4.0) for at in np.arange(20.0, 280.0, 8.0)]
    long = replace(
        flight,
        columns={"t_s": t_s, **noise},
        maneuvers=[(one, Grade(1.0, 1.0, 0.0, 0.0, ())) for one in points[::2]],
    )
    data = page_data(long, channels_of(long))
    assert len(data.overview) <= OVERVIEW_BYTES // 10 and not data.whole
    assert len(data.overview) + sum(map(len, data.stretches)) <= PAGE_BYTES // 10
    assert any("LEFT OUT" in one for one in data.remarks)
    first = data.stretches[0].head
    assert first["start_s"] <= 20.0 - 4.9 and first["end_s"] >= 24.0 + 4.9
    every = page_data(long, channels_of(long), full=True)
    assert every.whole and sum(one.head["rows"] for one in every.stretches) == rows

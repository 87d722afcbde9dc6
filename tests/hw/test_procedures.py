"""What the pages of hw/ promise: the snippet runs, the example loads, codes are the firmware's."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from host.physical.calibration import load_calibration

from tests.host.logs import flight, written
from tests.protocol.flights import wrapped
from tests.protocol.log_writer import Timed, rows

ROOT = Path(__file__).resolve().parents[2]
HEAD = 'format = "flight-test-calibration"\nversion = 1\nname = "test"\ndate = "2026-11-21"\n'


def test_snippet_turns_marks_into_points(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    text = (ROOT / "hw/calibration/README.md").read_text()
    (code,) = re.findall(r"```python\n(.*?)```", text, re.S)
    (row,) = re.findall(r"settings = (\[.*?\])", code)
    settings = np.array([int(one) for one in row.strip("[]").split(",")])
    streams = flight(4.0 * len(settings) + 1.0)
    ident = streams[0].rows
    marks_us = int(ident["t_us"][0]) + 4_000_000 * (1 + np.arange(len(settings)))
    place = np.searchsorted(marks_us, ident["t_us"]).clip(0, len(settings) - 1)
    ident["alpha_a"] = 4 * (500 + 3 * settings[place])
    marks = rows("event", len(settings), t_us=wrapped(marks_us), code=24)
    streams.append(Timed(marks, marks_us + 5000))
    (tmp_path / "FLT00003.BIN").write_bytes(written(*streams))
    monkeypatch.chdir(tmp_path)
    exec(compile(code, "README.md", "exec"), {})
    true, raw = np.loadtxt("points.csv", delimiter=",", skiprows=1).T
    assert true.tolist() == settings.tolist()
    assert raw == pytest.approx(500 + 3 * settings)


def test_example_of_the_imu_loads(tmp_path: Path) -> None:
    text = (ROOT / "hw/calibration/procedure-imu.md").read_text()
    table = "\n".join(re.findall(r"^    (.*)$", text, re.M))
    path = tmp_path / "own.toml"
    path.write_text(HEAD + table + "\n")
    assert load_calibration(path).lines["imu.accel"].zero == (0.12, -0.05, 0.31)


def test_flash_codes_are_those_of_the_firmware() -> None:
    panel = (ROOT / "firmware/app/panel.cpp").read_text()
    body = panel.partition("trouble_flashes")[2].partition("\n}")[0]
    made = {int(one) for one in re.findall(r"return (\d+);", body)} - {0}
    table = (ROOT / "hw/bring-up.md").read_text().partition("## Step by step")[0]
    assert {int(one) for one in re.findall(r"^\| (\d)(?: flashes|) ?", table, re.M)} - {0} == made

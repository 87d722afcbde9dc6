"""What the pages of hw/ promise: the example loads, codes are the firmware's."""

from __future__ import annotations

import re
from pathlib import Path

from host.physical.calibration import load_calibration

ROOT = Path(__file__).resolve().parents[2]
HEAD = 'format = "flight-test-calibration"\nversion = 1\nname = "test"\ndate = "2026-11-21"\n'


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
    made |= {int(one) for one in re.findall(r"kRelayFlashes = (\d+);", panel)}
    table = (ROOT / "host/HELP.md").read_text().partition("## What you see on the computer")[0]
    assert {int(one) for one in re.findall(r"^\| (\d)(?: flashes|) ?", table, re.M)} - {0} == made

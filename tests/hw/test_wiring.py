"""The wiring pictures: committed ones are current, a wire that leads nowhere stops generation."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path
from types import ModuleType

import pytest

from tests.hw.test_pin_map import load_module

HW = Path(__file__).resolve().parents[2] / "hw"
HARNESS = (HW / "harness.toml").read_text()
PIN_MAP = (HW / "pin_map.toml").read_text()
GENERATOR: ModuleType = load_module("generate_wiring")


def check(folder: Path) -> tuple[int, str]:
    done = subprocess.run(
        [sys.executable, folder / "generate_wiring.py", "--check"], capture_output=True, text=True
    )
    return done.returncode, done.stderr


def test_committed_pictures_are_current() -> None:
    assert check(HW) == (0, "")


@pytest.mark.parametrize(
    "name", ["wiring-control.yml", "wiring-sensors.svg", "power.yml", "imu.svg", "CABLES.md"]
)
def test_an_old_picture_is_found(name: str, tmp_path: Path) -> None:
    folder = tmp_path / "hw"
    shutil.copytree(HW, folder)
    path = folder / "generated" / name
    path.write_text(
        path.read_text().replace("sha256", "sha1").replace("pins", "legs", 1).replace("J12", "J99")
    )
    code, said = check(folder)
    assert code == 6
    assert f"{name} is not current" in said


@pytest.mark.parametrize(
    ("before", "after", "complaint"),
    [
        ('["wiper", "pot_rudder"]', '["wiper", "pot_flap"]', "has no signal pot_flap"),
        ('["wiper", "pot_rudder"]', '["wiper", "pot_elevator"]', "pot_elevator has two ends"),
        ('pins = [["OUT", "dp_b"]]', "pins = []", "signal dp_b of pin_map.toml goes to no device"),
        ('"Pot rudder", "IMU"', '"Pot rudder"', "IMU: rail '5 V sensors' does not feed it"),
        ('side = "left"', 'side = "top"', "expected left or right"),
    ],
)
def test_wires_that_lead_nowhere_are_refused(before: str, after: str, complaint: str) -> None:
    assert before in HARNESS
    with pytest.raises(GENERATOR.HarnessError, match=complaint):
        GENERATOR.load_devices(HARNESS.replace(before, after, 1), PIN_MAP)


def test_every_signal_leaves_the_board_at_its_own_pin() -> None:
    shown: dict[str, str] = {}
    pins: list[str] = []
    for picture in GENERATOR.PICTURES:
        source = GENERATOR.signal_picture(HARNESS, PIN_MAP, picture)
        shown |= labels(source)
        used = re.findall(r'^    - "Arduino Mega 2560": (.*)$', source, re.M)
        pins += [str(pin) for row in used for pin in json.loads(row)]
    signals = tomllib.loads(PIN_MAP)["signal"]
    assert shown == {row["name"]: row["pin"] for row in signals}
    assert sorted(pins) == sorted(row["pin"] for row in signals)


def labels(source: str) -> dict[str, str]:
    """Return the Mega's pin of each signal in a picture's source."""
    board = re.search(r'"Arduino Mega 2560":\n.*\n.*\n    pins: (.*)\n    pinlabels: (.*)', source)
    assert board is not None
    return dict(zip(json.loads(board[2]), map(str, json.loads(board[1])), strict=True))


def test_a_wire_has_one_colour_in_table_and_pictures() -> None:
    nets = (HW / "board/generated/nets.csv").read_text()
    table = GENERATOR.cable_table(HARNESS, nets)
    modules = GENERATOR.signal_picture(HARNESS, PIN_MAP, "modules")
    (cable,) = re.findall(r'- "Arduino Mega 2560": \[16, 17\]\n    - (W\d+)', modules)
    (colours,) = re.findall(rf"  {cable}:\n    wirecount: 2\n    colors: \[(\w+), (\w+)\]", modules)
    assert colours == ("BN", "OG")  # GPS: RX first in the harness, then TX
    assert "| J24 | GPS | its own | 4 | RX | BN |" in table
    assert "| J24 | GPS | its own | 3 | TX | OG |" in table


def test_every_plug_of_the_shield_has_a_cable() -> None:
    nets = (HW / "board/generated/nets.csv").read_text(encoding="utf-8")
    plugs = set(re.findall(r",(J\d+),", nets))
    table = GENERATOR.cable_table(HARNESS, nets)
    assert {plug for plug in plugs if f"| {plug} |" not in table} == set()
    assert "| J11 | BEC or servo battery | its own, 18 AWG | 2 | 4.8 to 6 V | RD | 0.25 |" in table
    assert "| Pro Mini | D2 | GY-521 | INT | BU | 0.04 |" in table


def test_a_lead_to_no_plug_is_refused() -> None:
    nets = (HW / "board/generated/nets.csv").read_text(encoding="utf-8")
    with pytest.raises(GENERATOR.HarnessError, match=r"J66 of harness\.toml is no plug"):
        GENERATOR.cable_table(HARNESS.replace('connector = "J6"', 'connector = "J66"'), nets)

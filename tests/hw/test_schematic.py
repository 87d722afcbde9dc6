"""The schematic's nets: held against pin map, harness and relay from committed text alone."""

from __future__ import annotations

import re
from pathlib import Path
from types import ModuleType

import pytest

from tests.hw.test_pin_map import load_module

HW = Path(__file__).resolve().parents[2] / "hw"
BOARD = HW / "board"
PARTS = (BOARD / "generated" / "parts.csv").read_text()
NETS = (BOARD / "generated" / "nets.csv").read_text()
MAP, HARNESS, RELAY = (
    (HW / name).read_text() for name in ("pin_map.toml", "harness.toml", "relay.md")
)
CHECK: ModuleType = load_module("board/check_nets")
BOARDS: ModuleType = load_module("board/boards")


def faults(nets: str = NETS, pin_map: str = MAP, harness: str = HARNESS) -> list[str]:
    return list(CHECK.faults(CHECK.load(PARTS, nets), pin_map, harness, RELAY))


def test_schematic_agrees_with_pin_map_harness_and_relay() -> None:
    assert faults() == []


@pytest.mark.parametrize("board", ["logger", "vane", "pitot"])
@pytest.mark.parametrize("name", ["nets.csv", "parts.csv"])
def test_nets_and_parts_are_those_of_the_committed_sheets(name: str, board: str) -> None:
    found = BOARDS.named(board)
    first_line = (found.generated / name).read_text(encoding="utf-8").splitlines()[0]
    assert first_line.endswith(found.sheets_hash()), "run hw/board/export.py"


def swapped(one: str, other: str) -> str:
    """Return the nets with two pins (reference,pin) exchanged, as a wrong wire would."""
    rows = NETS.splitlines()
    places = {pin: i for i, row in enumerate(rows) for pin in (one, other) if f",{pin}," in row}
    a, b = rows[places[one]].split(",", 1), rows[places[other]].split(",", 1)
    rows[places[one]], rows[places[other]] = f"{b[0]},{a[1]}", f"{a[0]},{b[1]}"
    return "\n".join(rows)


@pytest.mark.parametrize(
    ("one", "other", "complaint"),
    [
        ("M1,2", "M1,3", "pin 2 carries servo_aileron .* the schematic has servo_elevator"),
        ("M1,12", "M1,6", "pin 6 carries led .* unconnected"),
        ("J12,3", "J13,3", "Vane alpha left OUT leads to alpha_b_in, harness.toml says alpha_a"),
        ("J23,1", "J24,2", "Barometer 3V3 stands on .*5V, expected .*3V3"),
        ("J16,1", "J16,2", "Pitot left GND stands on .*5V, expected GND"),
        ("J1,3", "J2,3", "Receiver CH1 aileron leads to rx_elevator"),
        ("K2,2", "K2,4", "K2 pin 2 is on .* relay.md says receiver aileron"),
        ("K1,3", "K2,3", "K1 pin 3 is on servo_aileron_out, relay.md says elevator servo"),
        ("K3,8", "K3,9", "K3 pin 9 is on GND, relay.md says open"),
        ("R4,2", "R3,2", "relay.md says pin 3 through R4"),
        ("M1,50", "M1,51", "pin 50 carries card_miso"),
        ("M2,A4", "M2,A5", "Shield J22 SDA and Pro Mini A4 of harness.toml"),
        ("M4,INT", "M5,SDA", "Pro Mini D2 and GY-521 INT of harness.toml"),
    ],
)
def test_a_wrong_wire_is_found(one: str, other: str, complaint: str) -> None:
    said = "\n".join(faults(swapped(one, other)))
    assert re.search(complaint, said), said


@pytest.mark.parametrize(
    ("before", "after", "complaint"),
    [
        ('name = "buzzer"\npin = "7"', 'name = "buzzer"\npin = "4"', "pin 4 carries buzzer"),
        ('name = "led"\npin = "6"', 'name = "lamp"\npin = "6"', "pin 6 carries lamp"),
    ],
)
def test_a_map_that_moved_on_is_found(before: str, after: str, complaint: str) -> None:
    assert before in MAP
    assert complaint in "\n".join(faults(pin_map=MAP.replace(before, after)))


def test_a_value_of_the_pump_that_differs_is_found() -> None:
    board = CHECK.load(PARTS.replace("C1,0.33u", "C1,1u").replace("R9,10k", "R9,1k"), NETS)
    said = CHECK.faults(board, MAP, HARNESS, RELAY)
    assert "C1 is 1u in the schematic, 0.33 uF in relay.md" in said
    assert "R9 is 1k in the schematic, 10 kohm in relay.md" in said


def test_a_device_the_board_does_not_have_is_found() -> None:
    more = HARNESS.replace('name = "Barometer"', 'name = "Second barometer"', 1)
    assert "Second barometer of harness.toml has no symbol" in faults(harness=more)

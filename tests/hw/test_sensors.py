"""The boards on the wing against shield, harness and data sheets, from committed text alone."""

from __future__ import annotations

from pathlib import Path
from types import ModuleType

import pytest

from tests.hw.test_pin_map import load_module

HW = Path(__file__).resolve().parents[2] / "hw"
CHECK: ModuleType = load_module("board/check_sensors")
NETS: ModuleType = load_module("board/check_nets")
HARNESS = (HW / "harness.toml").read_text(encoding="utf-8")


def text(board: str, name: str) -> str:
    place = "board/generated" if board == "logger" else f"board/sensors/generated/{board}"
    return (HW / place / name).read_text(encoding="utf-8")


def faults(wrong: dict[tuple[str, str], tuple[str, str]], harness: str = HARNESS) -> str:
    """Return what is found with texts replaced in (board, file)."""

    def load(board: str) -> object:
        texts = [
            text(board, name).replace(*wrong.get((board, name), ("", "")))
            for name in ("parts.csv", "nets.csv")
        ]
        return NETS.load(*texts)

    sensors = {board: load(board) for board in CHECK.CHIPS}
    return "\n".join(CHECK.faults(sensors, load("logger"), harness))


def test_boards_on_the_wing_agree_with_shield_harness_and_data_sheets() -> None:
    assert faults({}) == ""


@pytest.mark.parametrize(
    ("board", "name", "before", "after", "complaint"),
    [
        ("vane", "nets.csv", "GND,U1,8,DIR", "+5V,U1,8,DIR", "U1 pin 8 is on +5V"),
        ("vane", "nets.csv", "/raw,U1,3,OUT", "/raw,U1,5,PGO", "U1 pin 3 is on no such pin"),
        ("pitot", "nets.csv", "+5V,U1,2", "GND,U1,2", "U1 pin 2 is on GND"),
        ("pitot", "nets.csv", "/out,J1,3", "/raw,J1,3", "J1 pin 3, OUT, is on raw"),
        ("vane", "nets.csv", "GND,J1,1,GND", "GND,J1,1,5V", "J12 pin 1 is GND, J1 of the vane"),
        ("logger", "nets.csv", ",J16,1,GND", ",J16,1,OUT", "J16 pin 1 is OUT"),
        ("vane", "parts.csv", "C2,1u", "C2,1n", "nothing of 1u between inner_3V3 and GND"),
        ("pitot", "nets.csv", "GND,C3,2", "/out,C3,2", "nothing of 470p between raw and GND"),
    ],
)
def test_a_wrong_wire_is_found(
    board: str, name: str, before: str, after: str, complaint: str
) -> None:
    assert before in text(board, name)
    assert complaint in faults({(board, name): (before, after)})


def test_a_board_that_is_not_there_is_found() -> None:
    assert "there is no vain board" in faults(
        {}, HARNESS.replace('board = "vane"', 'board = "vain"')
    )

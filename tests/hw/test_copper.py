"""The routed board's copper, from its committed text: currents, places kept free."""

from __future__ import annotations

import re
from pathlib import Path
from types import ModuleType

import pytest

from tests.hw.test_pin_map import load_module

HW = Path(__file__).resolve().parents[2] / "hw"
TEXT = (HW / "board/logger.kicad_pcb").read_text(encoding="utf-8")
COPPER: ModuleType = load_module("board/copper")


def test_committed_board_carries_its_currents() -> None:
    assert COPPER.faults(TEXT) == []


def test_every_track_and_via_of_the_file_is_read() -> None:
    drawn = len(re.findall(r"^\t\((?:segment|via)$", TEXT, re.M))
    assert len(COPPER.tracks(TEXT)) == drawn > 1000


@pytest.mark.parametrize(
    ("current_a", "rise_K", "width_mm"),
    # Read off the standard's chart for outer layers of one ounce: 1 A 10 K, 3 A 10 K, 5 A 20 K.
    [(1.0, 10.0, 0.30), (3.0, 10.0, 1.37), (5.0, 20.0, 1.81)],
)
def test_width_follows_the_standard(current_a: float, rise_K: float, width_mm: float) -> None:
    assert COPPER.width_mm(current_a, rise_K) == pytest.approx(width_mm, rel=0.03)


def test_pins_stand_where_the_mega_has_its_sockets() -> None:
    # Inches from the lower left corner, printed in the drawing of the Mega 2560 R3.
    text = (HW / "board/logger.pretty/Mega2560_shield.kicad_mod").read_text(encoding="utf-8")
    pads = {
        name: (float(x) / 25.4, -float(y) / 25.4)
        for name, x, y in re.findall(r'\(pad "(\w+)" thru_hole \w+ \(at (\S+) (\S+)\)', text)
    }
    known = {"VIN": (1.8, 0.1), "A0": (2.0, 0.1), "A15": (3.6, 0.1), "0": (2.5, 2.0)}
    known |= {"13": (1.14, 2.0), "8": (1.64, 2.0), "7": (1.8, 2.0), "21": (3.4, 2.0)}
    known |= {"22": (3.7, 1.9), "53": (3.8, 0.4)}
    for name, place in known.items():
        assert pads[name] == pytest.approx(place, abs=1e-3), name


def test_a_thin_rail_is_found() -> None:
    assert "(width 2.5)" in TEXT
    said = COPPER.faults(TEXT.replace("(width 2.5)", "(width 1.5)"))
    assert any("no track of 1.82 mm" in line for line in said)


def test_a_track_above_the_usb_shell_is_found() -> None:
    more = (
        "\t(segment\n\t\t(start 62 80)\n\t\t(end 80 80)\n\t\t(width 0.15)\n"
        '\t\t(layer "F.Cu")\n\t\t(net 2)\n\t\t(uuid "0")\n\t)\n'
    )
    said = "\n".join(COPPER.faults(TEXT + more))
    assert "+5V above the Mega's USB shell" in said
    assert "+5V: 0.15 mm, least 0.2 mm" in said

"""The page to solder by: every part of the board, where the board has it."""

from __future__ import annotations

import csv
import json
import re
from pathlib import Path

HW = Path(__file__).resolve().parents[2] / "hw"
PAGE = (HW / "board/generated/assembly.html").read_text(encoding="utf-8")


def test_every_part_on_the_board_lights_up_somewhere() -> None:
    with (HW / "board/generated/parts.csv").open(encoding="utf-8") as file:
        next(file)
        parts = {row["ref"] for row in csv.DictReader(file) if row["footprint"]}
    listed = {ref for refs in re.findall(r'data-refs="([^"]+)"', PAGE) for ref in refs.split()}
    # Test points are not placed.
    assert listed == {ref for ref in parts if not ref.startswith("TP")}


def test_places_are_those_of_the_board() -> None:
    (found,) = re.findall(r"const at=(\{.*?\}),svg", PAGE)
    places = json.loads(found)
    # From the board's file: J12 at 20, -19.5 mm from the Mega's corner, C3 at 35.2, 8.2.
    across = places["C3"][0] - places["J12"][0]
    down = places["C3"][1] - places["J12"][1]
    assert (round(across, 2), round(down, 2)) == (15.2, -27.7)


def test_page_needs_no_network() -> None:
    assert not re.search(r'(?:src|href)="?https?:', PAGE)

"""The bill of materials: counted in schematic and harness, its totals stated on the pages."""

from __future__ import annotations

import csv
import re
import tomllib
from pathlib import Path
from types import ModuleType

import pytest

from tests.hw.test_pin_map import load_module

ROOT = Path(__file__).resolve().parents[2]
HW = ROOT / "hw"
GENERATOR: ModuleType = load_module("generate_bom")
PARTS, HARNESS = (
    (HW / path).read_text(encoding="utf-8") for path in ("parts.toml", "harness.toml")
)
LIGHT = tomllib.loads((HW / "light.toml").read_text(encoding="utf-8"))
SYMBOLS = {
    board: (HW / path).read_text(encoding="utf-8") for board, (path, _) in GENERATOR.SYMBOLS.items()
}


def test_committed_list_is_current() -> None:
    assert (HW / "bom.csv").read_text(encoding="utf-8") == GENERATOR.text(GENERATOR.read())


def test_page_of_the_light_variant_is_current() -> None:
    found = GENERATOR.light_page(GENERATOR.read(), LIGHT, HARNESS)
    assert (HW / "generated" / "LIGHT.md").read_text(encoding="utf-8") == found


def test_what_leaves_weighs_what_the_list_says() -> None:
    # Two of four vane boards: half of the board's parts, two boards, two magnets, four bearings.
    found = GENERATOR.read()
    (vanes,) = (row for row in LIGHT["leave"] if "boards" in row)
    wire_m = GENERATOR.wire_m(HARNESS)
    bare = {key: row for key, row in vanes.items() if key != "made"}
    less = GENERATOR.lightened(found, bare, wire_m)
    left = GENERATOR.flown_g(found, LIGHT)[0] - GENERATOR.flown_g(less, LIGHT)[0]
    own = sum(
        line.weight_g * len(line.refs) * 2
        for line in found
        if line.refs and all(ref.startswith("vane ") for ref in line.refs)
    )
    shared = sum(
        line.weight_g * sum(ref.startswith("vane ") for ref in line.refs) * 2
        for line in found
        if not all(ref.startswith("vane ") for ref in line.refs)
    )
    assert left == pytest.approx(own + shared + 2 * 1.6 + 2 * 0.53 + 4 * 0.35)


def test_wire_of_a_device_left_out_is_not_counted() -> None:
    # Two supplies and one signal of 1.4 m.
    less = GENERATOR.wire_m(HARNESS) - GENERATOR.wire_m(HARNESS, ["Vane alpha right"])
    assert less == pytest.approx(3 * 1.4, abs=1.0)


def test_what_cannot_leave_is_refused() -> None:
    found = GENERATOR.read()
    with pytest.raises(GENERATOR.BomError, match="has no sail"):
        GENERATOR.lightened(found, {"parts": {"sail": 0}}, 1.0)
    with pytest.raises(GENERATOR.BomError, match="has no keel"):
        GENERATOR.lightened(found, {"made": {"keel": 0}}, 1.0)


def test_readme_states_every_total() -> None:
    said = (HW / "README.md").read_text(encoding="utf-8")
    sums = GENERATOR.totals(GENERATOR.read())
    for price, weight in sums.values():
        assert f"{price:.2f} USD, {weight:.0f} g" in said
    weights = ", ".join(f"{weight:.0f}" for _, weight in sums.values())
    assert f"; {weights} g |" in (ROOT / "tests/FIGURES.md").read_text(encoding="utf-8")
    top = (ROOT / "README.md").read_text(encoding="utf-8")
    prices = [f"{sums[kit][0]:.0f}" for kit in GENERATOR.KITS]
    assert "about {} USD, {} with a radio pair, {} ready to fly".format(*prices) in top
    first = top.split("![")[0]
    (promise,) = map(int, re.findall(r"about (\d+) USD of electronics", " ".join(first.split())))
    assert abs(promise - sums["logger"][0]) <= 1.0


def test_totals_are_the_sum_of_the_list() -> None:
    with (HW / "bom.csv").open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    price = sum(float(row["quantity"]) * float(row["unit price USD"]) for row in rows)
    assert price == pytest.approx(GENERATOR.totals(GENERATOR.read())["flight"][0], abs=0.005)
    assert all(row["part number"] and row["maker"] and row["alternative"] for row in rows)


def test_every_symbol_stands_in_exactly_one_line() -> None:
    symbols = [ref for refs in GENERATOR.counted(SYMBOLS).values() for ref in refs]
    listed = [ref for line in GENERATOR.read() for ref in line.refs]
    assert sorted(listed) == sorted(symbols)


def test_four_vane_boards_have_four_times_its_parts() -> None:
    (chip,) = (line for line in GENERATOR.read() if line.number == "AS5600-ASOM")
    (plug,) = (line for line in GENERATOR.read() if line.number == "B3B-XH-A")
    assert (chip.quantity, chip.refs) == (4, ("vane U1",))
    assert plug.quantity == len(plug.refs) - 2 + 4 + 1  # one a reference but the vane's


def test_drawings_named_are_there() -> None:
    for line in GENERATOR.read():
        assert line.drawing, line.what
        assert (HW / line.drawing).exists(), line.what


@pytest.mark.parametrize(
    ("before", "after", "complaint"),
    [
        ('key = "bss138"', 'key = "bss139"', "bss139 has no quantity and the schematic does not"),
        ('kit = "radio"', 'kit = "radios"', "expected one of"),
    ],
)
def test_parts_that_contradict_are_refused(before: str, after: str, complaint: str) -> None:
    with pytest.raises(GENERATOR.BomError, match=complaint):
        GENERATOR.lines(PARTS.replace(before, after), SYMBOLS, HARNESS)


def test_a_symbol_without_a_line_is_refused() -> None:
    more = SYMBOLS | {"": SYMBOLS[""] + "U9,LM358,lm358,,\n"}
    with pytest.raises(GENERATOR.BomError, match="schematic uses lm358"):
        GENERATOR.lines(PARTS, more, HARNESS)


@pytest.mark.parametrize(
    ("value", "code"), [("330", "330R"), ("1k", "1K"), ("4.7k", "4K7"), ("43k", "43K")]
)
def test_a_resistor_is_ordered_by_its_makers_code(value: str, code: str) -> None:
    assert GENERATOR.resistor_code(value) == code

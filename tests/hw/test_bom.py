"""The bill of materials keeps its promise."""

from __future__ import annotations

import csv
from pathlib import Path

BOM = Path(__file__).resolve().parents[2] / "hw" / "bom.csv"


def test_electronics_cost_less_than_100_usd() -> None:
    with BOM.open(newline="") as file:
        rows = list(csv.DictReader(file))
    total_usd = sum(float(row["quantity"]) * float(row["unit price USD"]) for row in rows)
    assert 0 < total_usd < 100
    total_g = sum(float(row["quantity"]) * float(row["unit weight g"]) for row in rows)
    said = BOM.with_name("README.md").read_text(encoding="utf-8")
    assert f"{total_usd:.2f} USD and {total_g:.0f} g" in said
    assert all(row["part number"] and float(row["unit weight g"]) > 0 for row in rows)

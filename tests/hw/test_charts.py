"""The charts: what is committed is what their table says; text that a box cannot hold."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

from tests.hw.test_pin_map import load_module

ROOT = Path(__file__).resolve().parents[2]
GENERATOR: ModuleType = load_module("generate_charts")
CHARTS: list[dict[str, Any]] = tomllib.loads(
    (ROOT / "hw" / "charts.toml").read_text(encoding="utf-8")
)["chart"]


@pytest.mark.parametrize("chart", CHARTS, ids=lambda chart: Path(chart["file"]).stem)
def test_committed_chart_is_current(chart: dict[str, Any]) -> None:
    assert (ROOT / chart["file"]).read_text(encoding="utf-8") == GENERATOR.draw(chart)


@pytest.mark.parametrize("chart", CHARTS, ids=lambda chart: Path(chart["file"]).stem)
def test_every_arrow_begins_and_ends_at_a_box(chart: dict[str, Any]) -> None:
    # A branch may begin at the middle of another arrow; what it points at is always a box.
    for arrow in chart["arrow"]:
        x, y = arrow["points"][-1]
        edges = [
            (left <= x <= left + wide and y in (top, top + high))
            or (top <= y <= top + high and x in (left, left + wide))
            for left, top, wide, high in (row["at"] for row in chart["box"])
        ]
        assert any(edges), arrow


def test_states_of_the_drive_are_those_of_the_status_line() -> None:
    status = (ROOT / "firmware/app/status.cpp").read_text(encoding="utf-8")
    said = set(re.findall(r'"(direct \(.+?\)|mega)"', status))
    (chart,) = (chart for chart in CHARTS if "boot" in chart["file"])
    titles = {row["title"] for row in chart["box"]}
    assert {name for name in titles if name.startswith(("direct", "mega"))} <= said


def test_text_wider_or_higher_than_its_box_is_refused() -> None:
    row = {"at": [0, 0, 60, 40], "kind": "b", "title": "a title that is long"}
    with pytest.raises(GENERATOR.ChartError, match="in 60 x 40"):
        GENERATOR.box(row)
    with pytest.raises(GENERATOR.ChartError, match="in 60 x 40"):
        GENERATOR.box({**row, "title": "a", "lines": ["b", "c", "d"]})
    with pytest.raises(GENERATOR.ChartError, match="1 points"):
        GENERATOR.arrow({"points": [[1, 2]]})

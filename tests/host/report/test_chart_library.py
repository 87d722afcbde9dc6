"""The chart library: found where it is installed, one clear line where it is not."""

import sys
from pathlib import Path

import pytest
from host.errors import UsageError
from host.installation.inventory import inventory

from host import chart_library


def test_script_and_style_are_found_and_nothing_of_the_package_runs() -> None:
    assert "uPlot" in chart_library.chart_script()
    assert ".uplot" in chart_library.chart_style()
    assert "uplot" not in sys.modules and "IPython" not in sys.modules


def test_neither_reaches_for_a_host() -> None:
    text = chart_library.chart_script() + chart_library.chart_style()
    for word in ("fetch(", "XMLHttpRequest", "@import", "url(", "WebSocket", "eval("):
        assert word not in text


def test_its_licence_is_a_file_beside_it_or_the_head_of_its_script(tmp_path: Path) -> None:
    script = tmp_path / "uPlot.iife.js"
    script.write_text("var uPlot", encoding="utf-8")
    assert chart_library.chart_licence(tmp_path) is None
    script.write_text("/* (MIT Licensed) */ var uPlot", encoding="utf-8")
    assert chart_library.chart_licence(tmp_path) == script
    (tmp_path / "LICENSE").write_text("MIT", encoding="utf-8")
    assert chart_library.chart_licence(tmp_path) == tmp_path / "LICENSE"


def test_missing_library_is_one_line_with_the_command(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(chart_library, "_PACKAGE", "uplot_that_is_not_there")
    monkeypatch.setattr(chart_library, "_PLACES", ())
    with pytest.raises(UsageError) as raised:
        chart_library.chart_script()
    said = str(raised.value)
    assert inventory().charts == ["uPlot missing", chart_library.chart_hint()]
    assert "\n" not in said and "pip install --no-deps uplot-python==1.1.1" in said

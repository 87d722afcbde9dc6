"""Gains in the report: what `host tune` says, refused before minutes of work."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from host.cli import main
from host.control import AUTOPILOTS, ControlError, Tuning
from host.report import gains_section


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--tune", "betaflight", "--aircraft", "ultrastick25e"], "expected ardupilot, px4, inav"),
        (["--tune", "px4"], "--tune needs --aircraft"),
    ],
)
def test_gains_that_cannot_be_had_are_refused_before_the_flight_is_read(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], words: list[str], said: str
) -> None:
    source = tmp_path / "flight.csv"
    source.write_text("nothing that could be read\n", encoding="utf-8")
    assert main(["report", str(source), *words]) == 2
    assert said in capsys.readouterr().err


def test_what_tune_says_is_text_in_the_page(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: dict[str, Any] = {}

    def told(found: Any, **options: Any) -> Tuning:
        asked.update(options)
        return Tuning(AUTOPILOTS["px4"], "<b>mine</b>", (), ("a note",))

    monkeypatch.setattr(gains_section, "tune", told)
    source = tmp_path / "flight.csv"
    source.write_text("t_s\n", encoding="utf-8")
    found: Any = None
    page = gains_section.gains_section(found, "px4", "mine.toml", source)
    assert "&lt;b&gt;mine&lt;/b&gt;, gains for px4" in page
    assert "a note" in page
    assert (asked["autopilot"], asked["aircraft"]) == ("px4", "mine.toml")


def test_an_answer_without_gains_says_why_and_the_page_goes_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def none(found: Any, **options: Any) -> Tuning:
        raise ControlError("no travel of the <aileron>")

    monkeypatch.setattr(gains_section, "tune", none)
    source = tmp_path / "flight.csv"
    source.write_text("t_s\n", encoding="utf-8")
    found: Any = None
    page = gains_section.gains_section(found, "px4", "mine.toml", source)
    assert page == "<p>no travel of the &lt;aileron&gt;</p>"

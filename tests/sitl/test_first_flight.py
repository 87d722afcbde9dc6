"""The answer that host/IDENTIFY.md shows is the one that its commands give today."""

from __future__ import annotations

from pathlib import Path

import pytest
from studies import first_flight


def test_page_shows_todays_answer(tmp_path: Path) -> None:
    page = first_flight.PAGE.read_text(encoding="utf-8")
    answer = first_flight.flown_answer(tmp_path)
    assert first_flight.page_with(answer, page, first_flight.flown_maneuvers(tmp_path)) == page


def test_a_stale_answer_is_seen() -> None:
    page = first_flight.PAGE.read_text(encoding="utf-8")
    assert first_flight.page_with("Known from this flight: pitch not.\n", page) != page
    answer = first_flight.ANSWER.findall(page)[0]
    assert first_flight.page_with(answer, page, "9 maneuvers found") != page
    with pytest.raises(ValueError, match="shows 0 answers"):
        first_flight.page_with("", "# A page without one")

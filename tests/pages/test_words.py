"""Pages do not grow: words by group, long lines and full cells have limits that only fall."""

from __future__ import annotations

from pathlib import Path

from tests.pages.__main__ import read_limits, write_limits
from tests.pages.page_words import count_page, count_pages, group_of, totals


def test_pages_hold_no_more_than_their_limits() -> None:
    found, limits = totals(count_pages()), read_limits()
    assert found.keys() == limits.keys()
    assert {n: (c, limits[n]) for n, c in found.items() if c > limits[n]} == {}


def test_every_page_has_the_group_of_its_folder() -> None:
    groups = {
        "README.md": "user",
        "host/IDENTIFY.md": "user",
        "hw/calibration/procedure-imu.md": "user",
        "host/studies/gusts.md": "studies",
        "tests/chip/README.md": "tests",
        "tests/chip/LICENSE.md": "apart",
        "hw/relay.md": "hw",
        "hw/mechanics/README.md": "hw",
        "protocol/generated/FRAMES.md": "generated",
        "host/src/host/twin/README.md": "rooms",
        "SECURITY.md": "rooms",
    }
    assert {page: group_of(page) for page in groups} == groups


def test_long_lines_and_full_cells_are_seen() -> None:
    long, full = "word " * 40, "word " * 26
    text = f"{long}\n| a | {full} |\n    {long}\n```\n{long}\n```\n| a \\| b | c |\n- {long}"
    count = count_page("hw/relay.md", text)
    assert count.long_lines == (1, 8)
    assert count.full_cells == (2,)
    assert count_page("a/generated/B.md", text).long_lines == ()


def test_signs_of_a_table_are_no_words() -> None:
    assert count_page("hw/relay.md", "| --- | a | 5 V |\n- b").words == 4


def test_limits_only_fall(tmp_path: Path) -> None:
    file = tmp_path / "limits.toml"
    write_limits({"a": 5, "b": 9, "c": 1101}, {"a": 7, "b": 8, "c": 1900}, file)
    assert read_limits(file) == {"a": 5, "b": 8, "c": 1200, "generated": 16_000}

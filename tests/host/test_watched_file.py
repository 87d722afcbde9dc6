"""A bar while another library reads a large file, none of a small one or without a terminal."""

from __future__ import annotations

import io
import sys
from pathlib import Path

import pytest
from host.files.watched import watched_file


class Terminal(io.StringIO):
    """A stream that says it is a terminal."""

    def isatty(self) -> bool:
        return True


@pytest.mark.parametrize(("size", "drawn"), [(21_000_000, True), (1000, False)])
def test_a_bar_of_a_large_file(
    size: int, drawn: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "log"
    path.write_bytes(bytes(size))
    terminal = Terminal()
    monkeypatch.setattr(sys, "stderr", terminal)
    with watched_file(path) as file:
        assert sum(len(part) for part in iter(lambda: file.read(70_001), b"")) == size
        file.seek(5)
        assert file.read(3) == bytes(3)
    said = terminal.getvalue()
    assert ("reading" in said and "%" in said) == drawn

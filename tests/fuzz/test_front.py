"""The front of `make fuzz`: its table, what it remembers, and that a kind cannot run for ever."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from tests.fuzz import __main__ as front

WELL = "print('well')"
BAD = "import sys; print('a rule is broken'); sys.exit(6)"


def kind(name: str, program: str, of: tuple[str, ...] = ("tests/fuzz/kinds.toml",)) -> front.Kind:
    """Make a row that runs a small Python program."""
    return front.Kind(name, ("{python}", "-c", program), 10, of)


def test_every_row_names_what_is_there_and_can_be_run() -> None:
    for row in front.load():
        assert row.full >= front.USUAL_RUNS
        assert front.state_of(row, row.full)
        assert row.filled(7)[0] == sys.executable
        assert "7" in row.filled(7)


def test_a_campaign_goes_on_with_what_has_not_passed(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rows = [kind("first", WELL), kind("second", BAD)]
    assert front.campaign(rows, full=True, out=tmp_path) == ["second"]
    assert "a rule is broken" in capsys.readouterr().out
    assert list(json.loads((tmp_path / "passed.json").read_text())) == ["first"]
    mended = [rows[0], kind("second", WELL)]
    assert front.campaign(mended, full=True, out=tmp_path) == []
    said = capsys.readouterr().out
    assert "first          passed before" in said
    assert "second         ok" in said
    # All have passed: the next campaign begins anew.
    assert front.campaign(mended, full=True, out=tmp_path) == []
    assert "passed before" not in capsys.readouterr().out


def test_what_a_kind_is_about_makes_it_run_again(tmp_path: Path) -> None:
    (tmp_path / "code").mkdir()
    source = tmp_path / "code" / "a.cpp"
    source.write_text("1")
    row = kind("one", WELL, of=("code",))
    before = front.state_of(row, 5, tmp_path)
    assert front.state_of(row, 5, tmp_path) == before
    assert front.state_of(row, 6, tmp_path) != before
    source.write_text("2")
    assert front.state_of(row, 5, tmp_path) != before
    with pytest.raises(FileNotFoundError, match="named in"):
        front.state_of(kind("two", WELL, of=("nowhere",)), 5, tmp_path)


def test_a_kind_that_never_ends_is_stopped_with_all_it_started(tmp_path: Path) -> None:
    child = "import time; time.sleep(600)"
    program = f"import subprocess, sys; subprocess.run([sys.executable, '-c', {child!r}])"
    well, said = front.run(kind("endless", program), 1, limit_s=2.0, out=tmp_path)
    assert not well
    assert "stopped behind" in said
    left = subprocess.run(["ps", "-eo", "args"], capture_output=True, text=True, check=True).stdout
    assert child not in "".join(
        line for line in left.splitlines() if line.startswith(sys.executable)
    )


def test_an_unknown_kind_is_told(capsys: pytest.CaptureFixture[str]) -> None:
    assert front.main(["nothing"]) == 2
    assert "there are rc_decoder" in capsys.readouterr().err

"""What host/README.md promises: its example runs, its codes are those of the code."""

import re
from pathlib import Path

import pytest
from host.cli import main
from host.errors import ExitCode

import host
from tests.host.logs import ROOT
from tests.protocol.flights import simple_log

TEXT = (ROOT / "host/README.md").read_text()


def test_example_runs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("flight.bin").write_bytes(simple_log(25.0).data())
    code, _ = re.findall(r"```python\n(.*?)```", TEXT, re.S)
    exec(compile(code, "README.md", "exec"), {})
    said = capsys.readouterr().out
    assert "Pa measured" in said
    assert "complete" in said


def test_exit_codes() -> None:
    table = TEXT.partition("## Exit codes")[2].partition("##")[0]
    assert {int(code) for code in re.findall(r"^\| (\d+) \|", table, re.M)} == set(ExitCode)


def test_the_notebook_runs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """On tables of two virtual flights in place of logs, whose recorder is not always built."""
    monkeypatch.chdir(tmp_path)
    for name, seed in (("other", "4"), ("flight", "3")):
        options = ["--seed", seed, "--firmware", "none", "--no-picture", "-o", "."]
        assert main(["simulate", "demo", *options]) == 0
        Path("flight.csv").rename(f"{name}.csv")
    _, code = re.findall(r"```python\n(.*?)```", TEXT, re.S)
    capsys.readouterr()
    place: dict[str, object] = {"host": host}
    exec(compile(code.replace(".bin", ".csv"), "README.md", "exec"), place)
    assert "Known from this flight: pitch" in capsys.readouterr().out
    assert isinstance(place["found"], host.Identification)

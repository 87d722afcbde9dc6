"""What a user sees of damage: exit code, summary, JSON, and one line instead of a traceback."""

import json
import os
from pathlib import Path

import numpy as np
import pytest
from host.cli import main

from tests.protocol.damage import DAMAGES
from tests.protocol.flights import simple_log
from tests.protocol.log_writer import BLOCK
from tests.protocol.test_damage import OTHER_FILES

FLIGHT = simple_log(2.0)
OK, LOSSES, NOT_A_LOG, CHECK = 0, 3, 4, 6


def run(path: Path, *options: str) -> int:
    return main(["decode", str(path), "-o", str(path.with_suffix(".csv")), *options])


def test_clean_log_is_exit_code_0(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "flight.bin"
    path.write_bytes(FLIGHT.data())
    assert run(path, "--json") == OK
    said = json.loads(capsys.readouterr().out)
    assert said["rows"] == 200
    assert said["complete"] == "complete"
    assert said["losses"]["ranges"] == []


def test_lost_range_is_in_summary_json_and_exit_code(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "flight.bin"
    data = FLIGHT.data()
    path.write_bytes(data[: 30 * BLOCK] + bytes(4 * BLOCK) + data[34 * BLOCK :])
    assert run(path) == LOSSES
    text = capsys.readouterr().out
    assert f"byte {30 * BLOCK}, {4 * BLOCK} bytes" in text
    assert run(path, "--json") == LOSSES
    (lost,) = json.loads(capsys.readouterr().out)["losses"]["ranges"]
    rows, blocks = FLIGHT.truth("ident")
    gone = int(((blocks >= 30) & (blocks < 34)).sum())
    assert (lost["offset"], lost["length"]) == (30 * BLOCK, 4 * BLOCK)
    assert (lost["frames"], lost["cause"]) == (gone, "zeroed")
    assert lost["seconds"] == pytest.approx(0.01 * gone, abs=1e-4)
    assert len(path.with_suffix(".csv").read_text().splitlines()) > len(rows) - gone


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("name", DAMAGES)
def test_any_damage_ends_in_a_documented_code(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], name: str, seed: int
) -> None:
    path = tmp_path / "flight.bin"
    path.write_bytes(DAMAGES[name](FLIGHT.data(), np.random.default_rng(seed)))
    code = run(path, "--json")
    said = capsys.readouterr()
    assert code in (OK, LOSSES, NOT_A_LOG)
    assert "Traceback" not in said.err
    if code == NOT_A_LOG:
        assert said.err.count("\n") == 1
    else:
        summary = json.loads(said.out)
        assert (code == LOSSES) == bool(summary["losses"]["ranges"])
        assert (summary["complete"] == "complete") or code == LOSSES


@pytest.mark.parametrize("what", OTHER_FILES)
def test_other_files_are_exit_code_4_and_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], what: str
) -> None:
    path = tmp_path / "other.bin"
    path.write_bytes(OTHER_FILES[what])
    assert run(path) == NOT_A_LOG
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err.count("\n") == 1
    assert not path.with_suffix(".csv").exists()


def test_sparse_file_of_ten_gigabytes(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "flight.bin"
    path.write_bytes(FLIGHT.data())
    os.truncate(path, 10 * 1024**3)
    assert run(path, "--json") == OK
    assert json.loads(capsys.readouterr().out)["rows"] == 200


def never_closed(path: Path) -> None:
    """Write a flight whose file has its full size and no end of its session."""
    size = 400 * BLOCK
    data = simple_log(8.0, preallocated=size).data()[: -2 * BLOCK]
    path.write_bytes(data + bytes(size - len(data)))


def test_file_never_closed_is_exit_code_0_and_fails_strict(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "flight.bin"
    never_closed(path)
    assert run(path) == OK
    said = capsys.readouterr().out
    assert "complete as far as blocks reach, " in said
    assert "losses       none" not in said
    assert run(path, "--strict") == CHECK
    capsys.readouterr()
    assert run(path, "--json", "--session", "1") == OK
    summary = json.loads(capsys.readouterr().out)
    assert summary["complete"] == "truncated"
    assert summary["losses"]["unproven_bytes"] > 0


@pytest.mark.parametrize("words", [["maneuvers"], ["identify", "--method", "equation-error"]])
def test_first_line_says_that_the_end_is_not_proven(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], words: list[str]
) -> None:
    path = tmp_path / "flight.bin"
    never_closed(path)
    code = main(
        [*words, str(path)]
    )  # nothing was flown in it: an answer, or one line that says why
    said = capsys.readouterr()
    first = (said.out or said.err).splitlines()[0]
    assert "complete as far as blocks reach, " in first, (code, said)

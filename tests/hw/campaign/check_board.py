"""The routed board in KiCad itself: rules, nothing unrouted, its schematic, current files."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

BOARD = Path(__file__).resolve().parents[3] / "hw" / "board"


def fabricate(folder: Path) -> tuple[int, str]:
    done = subprocess.run(
        [sys.executable, folder / "fabricate.py", "--check"], capture_output=True, text=True
    )
    return done.returncode, done.stderr


def test_board_has_no_violation_and_its_files_are_current() -> None:
    assert fabricate(BOARD) == (0, "")


def test_a_track_taken_away_is_found(tmp_path: Path) -> None:
    folder = tmp_path / "board"
    shutil.copytree(BOARD, folder)
    path = folder / "logger.kicad_pcb"
    text = path.read_text()
    start = text.index("\t(segment\n")
    end = text.index("\n\t)\n", start) + 4
    path.write_text(text[:start] + text[end:])
    code, said = fabricate(folder)
    assert code == 5
    assert "unconnected" in said or "dangling" in said


def test_a_part_the_schematic_renamed_is_found(tmp_path: Path) -> None:
    folder = tmp_path / "board"
    shutil.copytree(BOARD, folder)
    path = folder / "heartbeat.kicad_sch"
    path.write_text(path.read_text().replace('"Q1"', '"Q2"'))
    code, said = fabricate(folder)
    assert code == 5
    assert "Q1" in said

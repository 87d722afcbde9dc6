"""The routed board in KiCad itself: rules, nothing unrouted, its schematic, current files."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

BOARD = Path(__file__).resolve().parents[3] / "hw" / "board"


def fabricate(folder: Path, *options: str) -> tuple[int, str]:
    done = subprocess.run(
        [sys.executable, folder / "fabricate.py", "--check", *options],
        capture_output=True,
        text=True,
    )
    return done.returncode, done.stderr


def test_boards_have_no_violation_and_their_files_are_current() -> None:
    assert fabricate(BOARD) == (0, "")


def test_a_track_taken_away_is_found(tmp_path: Path) -> None:
    folder = tmp_path / "board"
    shutil.copytree(BOARD, folder)
    path = folder / "sensors/vane.kicad_pcb"
    text = path.read_text()
    # From pin 2 of the chip to its capacitor.
    start = text.rindex("\t(segment\n", 0, text.index("(start 97.525 99.365)"))
    end = text.index("\n\t)\n", start) + 4
    path.write_text(text[:start] + text[end:])
    code, said = fabricate(folder, "--only", "vane")
    assert code == 5
    assert "unconnected" in said or "dangling" in said


def test_a_part_the_schematic_renamed_is_found(tmp_path: Path) -> None:
    folder = tmp_path / "board"
    shutil.copytree(BOARD, folder)
    path = folder / "heartbeat.kicad_sch"
    path.write_text(path.read_text().replace('"Q1"', '"Q2"'))
    code, said = fabricate(folder, "--only", "logger")
    assert code == 5
    assert "Q1" in said


def labels(folder: Path) -> tuple[int, str]:
    # pcbnew belongs to the system's Python.
    done = subprocess.run(
        ["/usr/bin/python3", folder / "labels.py"], capture_output=True, text=True
    )
    return done.returncode, done.stdout


def test_no_label_lies_above_a_hole_or_a_pad() -> None:
    assert labels(BOARD) == (0, "no label lies above a hole or a pad\n")


def test_a_label_above_a_pad_is_found(tmp_path: Path) -> None:
    folder = tmp_path / "board"
    shutil.copytree(BOARD, folder)
    path = folder / "logger.kicad_pcb"
    text = path.read_text()
    at = text.index('(gr_text "FLIGHT-TEST LOGGER rev 1"')
    path.write_text(text[:at] + text[at:].replace("86.3", "63.0", 1).replace("81.5", "78.0", 1))
    code, said = labels(folder)
    assert code == 6
    assert "'FLIGHT-TEST LOGGER rev 1' lies above a pad of K1" in said

"""The sheets in KiCad itself: no violation, current exports, a planted wrong wire is found."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

BOARD = Path(__file__).resolve().parents[3] / "hw" / "board"


def export(folder: Path, *options: str) -> tuple[int, str]:
    done = subprocess.run(
        [sys.executable, folder / "export.py", "--check", *options], capture_output=True, text=True
    )
    return done.returncode, done.stderr


def test_sheets_have_no_violation_and_exports_are_current() -> None:
    assert export(BOARD) == (0, "")


@pytest.mark.parametrize(
    ("board", "sheet", "before", "after", "code", "complaint"),
    [
        # A label changed by hand: the sheets still pass the electrical rules, the nets differ.
        ("vane", "sensors/vane", '(label "raw" ', '(label "out" ', 6, "nets.csv is not current"),
        ("logger", "vanes", '(label "alpha_a" ', '(label "alpha_c" ', 6, "nets.csv is not current"),
        # A label moved off its wire.
        ("logger", "heartbeat", '(label "coils" (at ', '(label "coils" (at 1', 5, "Label not"),
    ],
)
def test_a_planted_wrong_net_is_found(
    board: str, sheet: str, before: str, after: str, code: int, complaint: str, tmp_path: Path
) -> None:
    folder = tmp_path / "board"
    shutil.copytree(BOARD, folder)
    path = folder / f"{sheet}.kicad_sch"
    path.write_text(path.read_text().replace(before, after))
    found, said = export(folder, "--only", board)
    assert found == code
    assert complaint in said

"""Check the routed boards with KiCad and write what a board house wants.

python hw/board/fabricate.py           check, then write fabrication files and pictures
python hw/board/fabricate.py --check   check, and prove that the files to order are current

A routed .kicad_pcb is a source: nothing here routes or changes it.
"""

from __future__ import annotations

import argparse
import re
import sys
import tempfile
from pathlib import Path

import assembly
from boards import BOARDS, Board, BoardError
from export import slim, stale, write

LAYERS = "F.Cu,B.Cu,F.Mask,B.Mask,F.SilkS,B.SilkS,F.Paste,Edge.Cuts"
# Dates and the reader's clock: everything else of a Gerber is the board's.
_DATED = re.compile(r"^.*(?:CreationDate|Created by KiCad|DRILL file|\"CreationDate\").*\n", re.M)
# What stands on a footprint.
_MODEL = re.compile(r'\n\t\t\(model "[^"]*"\n.*?\n\t\t\)', re.S)
_PICTURE_PX = {"logger": 1366, "vane": 640, "pitot": 640}


def outputs(board: Board) -> dict[str, str]:
    """Check a board and return the files to order, without dates.

    Raises
    ------
    BoardError
        See `Board.check_rules`.
    """
    with tempfile.TemporaryDirectory() as scratch:
        out = Path(scratch) / "fabrication"
        out.mkdir()
        board.check_rules("pcb", Path(scratch) / "drc.json")
        to, copper = f"{out}/", board.copper
        board.kicad("pcb", "export", "gerbers", "--no-protel-ext", "-l", LAYERS, "-o", to, copper)
        board.kicad("pcb", "export", "drill", "-o", to, copper)
        places = str(out / "pick-and-place.csv")
        board.kicad(
            *("pcb", "export", "pos", "--format", "csv", "--units", "mm", "-o", places, copper)
        )
        made = {
            f"fabrication/{path.name}": _DATED.sub("", path.read_text(encoding="utf-8"))
            for path in sorted(out.iterdir())
        }
        if board.name == "logger":
            made["assembly.html"] = _assembly(board, Path(scratch), Path(places))
        return made


def _assembly(board: Board, scratch: Path, places: Path) -> str:
    print_svg = scratch / "print.svg"
    board.kicad(
        *("pcb", "export", "svg", "-l", "F.Mask,F.SilkS,Edge.Cuts", "--mode-single"),
        *("--page-size-mode", "2", "--exclude-drawing-sheet", "-o", str(print_svg), board.copper),
    )
    picture = slim(print_svg.read_text(encoding="utf-8"), "print")
    return assembly.page(picture, places.read_text(encoding="utf-8"))


def render(board: Board) -> None:
    """Write the pictures: both sides bare, where every label is seen; the upper one with parts."""
    with tempfile.TemporaryDirectory() as scratch:
        bare = Path(scratch) / board.copper
        text = (board.folder / board.copper).read_text(encoding="utf-8")
        bare.write_text(_MODEL.sub("", text), encoding="utf-8")
        for side in ("top", "bottom"):
            _picture(board, side, f"{side}.png", str(bare))
    _picture(board, "top", "assembled.png", board.copper)


def _picture(board: Board, side: str, name: str, copper: str) -> None:
    px, to = str(_PICTURE_PX[board.name]), str(board.generated / name)
    board.kicad("pcb", "render", "--side", side, "-w", px, "--height", px, "-o", to, copper)


def main(arguments: list[str] | None = None) -> int:
    """Write or check; 0 ok, 5 no KiCad or a violation, 6 a file is not current."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--check", action="store_true", help="compare with what is committed")
    parser.add_argument("--only", choices=[board.name for board in BOARDS], help="one board")
    parsed = parser.parse_args(arguments)
    code = 0
    for board in BOARDS:
        if parsed.only not in (None, board.name):
            continue
        try:
            made = outputs(board)
            if not parsed.check:
                write(board, made)
                render(board)
        except BoardError as error:
            print(f"hw/board: {error}", file=sys.stderr)
            return 5
        if parsed.check:
            for name in stale(board, made):
                print(f"{board.name}: {name} is not current: run fabricate.py", file=sys.stderr)
                code = 6
        else:
            print(f"{board.name}: {len(made)} files and three pictures")
    return code


if __name__ == "__main__":
    sys.exit(main())

"""Check the routed board with KiCad and write what a board house wants.

python hw/board/fabricate.py           check, then write generated/fabrication and the pictures
python hw/board/fabricate.py --check   check, and prove that the files to order are current

The routed logger.kicad_pcb is a source: nothing here routes or changes it.
"""

from __future__ import annotations

import argparse
import json
import re
import sys
import tempfile
from pathlib import Path

import assembly
from export import ExportError, kicad, slim

HERE = Path(__file__).resolve().parent
BOARD = "logger.kicad_pcb"
LAYERS = "F.Cu,B.Cu,F.Mask,B.Mask,F.SilkS,B.SilkS,F.Paste,Edge.Cuts"
# Dates and the reader's clock: everything else of a Gerber is the board's.
_DATED = re.compile(r"^.*(?:CreationDate|Created by KiCad|DRILL file|\"CreationDate\").*\n", re.M)


def check_rules(folder: Path, out: Path) -> None:
    """Run the design rules, unrouted connections and agreement with the schematic.

    Raises
    ------
    ExportError
        Names every violation.
    """
    report = out / "drc.json"
    kicad(
        folder,
        *("pcb", "drc", "--schematic-parity", "--severity-all", "--format", "json"),
        *("-o", str(report), BOARD),
    )
    read = json.loads(report.read_text(encoding="utf-8"))
    found = [
        f"{one['type']}: " + "; ".join(item["description"] for item in one["items"])
        for group in ("violations", "unconnected_items", "schematic_parity")
        for one in read[group]
    ]
    if found:
        raise ExportError("design rules:\n  " + "\n  ".join(found))


def outputs(folder: Path) -> dict[str, str]:
    """Check the board and return the files to order, without dates.

    Raises
    ------
    ExportError
        See `check_rules`.
    """
    with tempfile.TemporaryDirectory() as scratch:
        out = Path(scratch) / "fabrication"
        out.mkdir()
        check_rules(folder, Path(scratch))
        to = f"{out}/"
        kicad(folder, "pcb", "export", "gerbers", "--no-protel-ext", "-l", LAYERS, "-o", to, BOARD)
        kicad(folder, "pcb", "export", "drill", "-o", to, BOARD)
        places = str(out / "pick-and-place.csv")
        kicad(
            folder, "pcb", "export", "pos", "--format", "csv", "--units", "mm", "-o", places, BOARD
        )
        print_svg = Path(scratch) / "print.svg"
        kicad(
            folder,
            *("pcb", "export", "svg", "-l", "F.Mask,F.SilkS,Edge.Cuts", "--mode-single"),
            *("--page-size-mode", "2", "--exclude-drawing-sheet", "-o", str(print_svg), BOARD),
        )
        picture = slim(print_svg.read_text(encoding="utf-8"), "print")
        made = {"assembly.html": assembly.page(picture, Path(places).read_text(encoding="utf-8"))}
        return made | {
            f"fabrication/{path.name}": _DATED.sub("", path.read_text(encoding="utf-8"))
            for path in sorted(out.iterdir())
        }


def main(arguments: list[str] | None = None) -> int:
    """Write or check; 0 ok, 5 no KiCad or a violation, 6 a file is not current."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--check", action="store_true", help="compare with what is committed")
    check = parser.parse_args(arguments).check
    generated = HERE / "generated"
    try:
        made = outputs(HERE)
        if not check:
            for side in ("top", "bottom"):
                picture = str(generated / f"{side}.png")
                kicad(HERE, "pcb", "render", "--side", side, "-w", "1366", "--height", "1366",
                      "-o", picture, BOARD)  # fmt: skip
    except ExportError as error:
        print(f"hw/board: {error}", file=sys.stderr)
        return 5
    for name, text in made.items():
        path = generated / name
        if check:
            if not path.exists() or path.read_text(encoding="utf-8") != text:
                print(
                    f"hw/board/generated/{name} is not current: run fabricate.py", file=sys.stderr
                )
                return 6
        else:
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text, encoding="utf-8", newline="\n")
    if not check:
        print(f"wrote {len(made)} files and two pictures")
    return 0


if __name__ == "__main__":
    sys.exit(main())

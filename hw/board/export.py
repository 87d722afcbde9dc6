"""Check the schematics with KiCad and write what people and tests read of them.

python hw/board/export.py           check, then write each board's generated folder
python hw/board/export.py --check   check, and prove that what is committed there is current

Needs kicad-cli 9 (`.ci/setup.sh hw`). The sheets are the source: they are drawn in KiCad.
"""

from __future__ import annotations

import argparse
import csv
import io
import re
import sys
import tempfile
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterable, Sequence
from pathlib import Path

from boards import BOARDS, Board, BoardError

MADE_BY = "made by hw/board/export.py from the sheets, sha256"
# Numbers of a picture: a hundredth of a millimetre is a twentieth of a pixel.
_NUMBER = re.compile(r"-?\d+\.\d{3,}")


def netlist(board: Board, out: Path) -> dict[str, str]:
    """Return nets.csv and parts.csv."""
    path = out / "netlist.xml"
    board.kicad(
        *("sch", "export", "netlist", "--format", "kicadxml", "-o", str(path), board.root_sheet)
    )
    tree = ElementTree.parse(path).getroot()
    head = f"# {MADE_BY} {board.sheets_hash()}"
    parts = []
    for comp in tree.iterfind("components/comp"):
        fields = {f.get("name", ""): f.text or "" for f in comp.iterfind("fields/field")}
        placed = not any(p.get("name") == "exclude_from_board" for p in comp.iterfind("property"))
        parts.append(
            (
                comp.get("ref", ""),
                comp.findtext("value", ""),
                fields.get("Part", ""),
                fields.get("Device", ""),
                comp.findtext("footprint", "") if placed else "",
            )
        )
    nets = [
        (net.get("name", ""), node.get("ref", ""), node.get("pin", ""), _pin_name(node))
        for net in tree.iterfind("nets/net")
        for node in net.iterfind("node")
    ]
    return {
        "parts.csv": _table(head, ("ref", "value", "part", "device", "footprint"), parts),
        "nets.csv": _table(head, ("net", "ref", "pin", "pin name"), nets),
    }


def _pin_name(node: ElementTree.Element) -> str:
    # KiCad writes an underscore for a blank, and the pin's number behind a name used twice.
    return node.get("pinfunction", "").replace("_", " ").removesuffix(f" {node.get('pin')}")


def _natural(row: Iterable[str]) -> list[tuple[str, int]]:
    return [
        (letters, int(digits or 0))
        for cell in row
        for letters, digits in re.findall(r"(\D*)(\d*)", cell)
    ]


def _table(head: str, names: tuple[str, ...], rows: Sequence[tuple[str, ...]]) -> str:
    text = io.StringIO()
    text.write(head + "\n")
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(names)
    writer.writerows(sorted(rows, key=_natural))
    return text.getvalue()


def pictures(board: Board, out: Path) -> dict[str, str]:
    """Return the sheets as SVG, without date and in hundredths of a millimetre."""
    board.kicad("sch", "export", "svg", "-o", str(out / "svg"), board.root_sheet)
    found: dict[str, str] = {}
    paths = sorted((out / "svg").glob("*.svg"))
    for path in paths:
        name = path.stem.removeprefix(f"{board.name}-").replace(", ", "-").replace(" ", "-").lower()
        place = f"schematic/{name}.svg" if len(paths) > 1 else "schematic.svg"
        found[place] = slim(path.read_text(encoding="utf-8"), name)
    return found


def slim(picture: str, name: str) -> str:
    """Return an SVG of KiCad's without date, in hundredths of a millimetre, a third of its size."""
    text = re.sub(r"<title>.*?</title>", f"<title>{name}</title>", picture)
    text = _NUMBER.sub(lambda n: f"{float(n[0]):.2f}", text)
    text = re.sub(r"\s*\n\s*", "\n", text)
    # A letter is many strokes, each a path of its own: one path says the same.
    return re.sub(r'(?:<path d="[^"]*"\s*/>\n){2,}', _joined, text)


def _joined(paths: re.Match[str]) -> str:
    return '<path d="' + "\n".join(re.findall(r'd="([^"]*)"', paths[0])) + '" />\n'


def outputs(board: Board) -> tuple[dict[str, str], bytes]:
    """Check the sheets and make every text, and the PDF.

    Raises
    ------
    BoardError
        See `Board.check_rules` and `Board.kicad`.
    """
    with tempfile.TemporaryDirectory() as scratch:
        out = Path(scratch)
        board.check_rules("sch", out / "erc.json")
        made = netlist(board, out) | pictures(board, out)
        board.kicad("sch", "export", "pdf", "-o", str(out / "schematic.pdf"), board.root_sheet)
        return made, (out / "schematic.pdf").read_bytes()


def stale(board: Board, made: dict[str, str]) -> list[str]:
    """Return which of a board's texts are not those in its generated folder."""
    return [
        name
        for name, text in made.items()
        if not (path := board.generated / name).exists() or path.read_text(encoding="utf-8") != text
    ]


def write(board: Board, made: dict[str, str]) -> None:
    """Write a board's texts into its generated folder."""
    for name, text in made.items():
        path = board.generated / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8", newline="\n")


def main(arguments: list[str] | None = None) -> int:
    """Write or check; 0 ok, 5 no KiCad or a violation, 6 a file is not current."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--check", action="store_true", help="compare with what is committed")
    parser.add_argument("--only", choices=[board.name for board in BOARDS], help="one board")
    parsed = parser.parse_args(arguments)
    code = 0
    for board in BOARDS:
        if parsed.only not in (None, board.name):
            continue
        try:
            made, pdf = outputs(board)
        except BoardError as error:
            print(f"hw/board: {error}", file=sys.stderr)
            return 5
        old = stale(board, made)
        if parsed.check:
            for name in old:
                print(f"{board.name}: {name} is not current: run export.py", file=sys.stderr)
            code = 6 if old else code
            continue
        write(board, made)
        # A PDF carries its date: write it only where something changed.
        if old or not (board.generated / "schematic.pdf").exists():
            (board.generated / "schematic.pdf").write_bytes(pdf)
        print(f"{board.name}: {len(made) + 1} files, {len(old)} changed")
    return code


if __name__ == "__main__":
    sys.exit(main())

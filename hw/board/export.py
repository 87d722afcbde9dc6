"""Check the schematic with KiCad and write what people and tests read of it.

python hw/board/export.py           check, then write hw/board/generated
python hw/board/export.py --check   check, and prove that what is committed there is current

Needs kicad-cli 9 (`.ci/setup.sh hw`). The sheets are the source: they are drawn in KiCad.
"""

from __future__ import annotations

import argparse
import csv
import hashlib
import io
import json
import re
import subprocess
import sys
import tempfile
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterable, Sequence
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT_SHEET = "logger.kicad_sch"
MADE_BY = "made by hw/board/export.py from the sheets, sha256"
# Numbers of a picture: a hundredth of a millimetre is a twentieth of a pixel.
_NUMBER = re.compile(r"-?\d+\.\d{3,}")


class ExportError(Exception):
    """KiCad found a violation, or is not there."""


def sheets_hash(folder: Path) -> str:
    """Return the hash of all sheets, the same with any line ending."""
    digest = hashlib.sha256()
    for path in sorted(folder.glob("*.kicad_sch")):
        digest.update(path.name.encode() + b"\0" + path.read_bytes().replace(b"\r\n", b"\n"))
    return digest.hexdigest()


def kicad(folder: Path, *arguments: str) -> None:
    """Run kicad-cli in a folder.

    Raises
    ------
    ExportError
        No kicad-cli, or it failed; with what it said.
    """
    try:
        done = subprocess.run(
            ["kicad-cli", *arguments], cwd=folder, capture_output=True, text=True, check=False
        )
    except FileNotFoundError:
        raise ExportError("no kicad-cli found: run .ci/setup.sh hw") from None
    if done.returncode:
        raise ExportError(f"kicad-cli {' '.join(arguments[:2])}: {done.stdout}{done.stderr}")


def check_rules(folder: Path, out: Path) -> None:
    """Run the electrical rules; any violation, warnings too, is an error.

    Raises
    ------
    ExportError
        Names every violation.
    """
    report = out / "erc.json"
    kicad(
        folder,
        *("sch", "erc", "--severity-all", "--format", "json", "-o", str(report), ROOT_SHEET),
    )
    found = [
        f"{sheet['path']}: {one['description']}: "
        + "; ".join(item["description"] for item in one["items"])
        for sheet in json.loads(report.read_text(encoding="utf-8"))["sheets"]
        for one in sheet["violations"]
    ]
    if found:
        raise ExportError("electrical rules:\n  " + "\n  ".join(found))


def netlist(folder: Path, out: Path) -> dict[str, str]:
    """Return nets.csv and parts.csv."""
    path = out / "netlist.xml"
    kicad(folder, "sch", "export", "netlist", "--format", "kicadxml", "-o", str(path), ROOT_SHEET)
    tree = ElementTree.parse(path).getroot()
    head = f"# {MADE_BY} {sheets_hash(folder)}"
    parts = []
    for comp in tree.iterfind("components/comp"):
        fields = {f.get("name", ""): f.text or "" for f in comp.iterfind("fields/field")}
        board = not any(p.get("name") == "exclude_from_board" for p in comp.iterfind("property"))
        parts.append(
            (
                comp.get("ref", ""),
                comp.findtext("value", ""),
                fields.get("Part", ""),
                fields.get("Device", ""),
                comp.findtext("footprint", "") if board else "",
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


def pictures(folder: Path, out: Path) -> dict[str, str]:
    """Return the sheets as SVG, without date and in hundredths of a millimetre."""
    kicad(folder, "sch", "export", "svg", "-o", str(out / "svg"), ROOT_SHEET)
    found: dict[str, str] = {}
    for path in sorted((out / "svg").glob("*.svg")):
        name = path.stem.removeprefix("logger-").replace(", ", "-").replace(" ", "-").lower()
        found[f"schematic/{name}.svg"] = slim(path.read_text(encoding="utf-8"), name)
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


def outputs(folder: Path) -> tuple[dict[str, str], bytes]:
    """Check the sheets and make every text, and the PDF.

    Raises
    ------
    ExportError
        See `check_rules` and `kicad`.
    """
    with tempfile.TemporaryDirectory() as scratch:
        out = Path(scratch)
        check_rules(folder, out)
        made = netlist(folder, out) | pictures(folder, out)
        kicad(folder, "sch", "export", "pdf", "-o", str(out / "schematic.pdf"), ROOT_SHEET)
        return made, (out / "schematic.pdf").read_bytes()


def main(arguments: list[str] | None = None) -> int:
    """Write or check; 0 ok, 5 no KiCad or a violation, 6 a file is not current."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--check", action="store_true", help="compare with what is committed")
    check = parser.parse_args(arguments).check
    try:
        made, pdf = outputs(HERE)
    except ExportError as error:
        print(f"hw/board: {error}", file=sys.stderr)
        return 5
    generated = HERE / "generated"
    stale = [
        name
        for name, text in made.items()
        if not (generated / name).exists() or (generated / name).read_text("utf-8") != text
    ]
    if check:
        for name in stale:
            print(f"hw/board/generated/{name} is not current: run export.py", file=sys.stderr)
        return 6 if stale else 0
    for name, text in made.items():
        (generated / name).parent.mkdir(parents=True, exist_ok=True)
        (generated / name).write_text(text, encoding="utf-8", newline="\n")
    # A PDF carries its date: write it only where something changed.
    if stale or not (generated / "schematic.pdf").exists():
        (generated / "schematic.pdf").write_bytes(pdf)
    print(f"wrote hw/board/generated: {len(made) + 1} files, {len(stale)} changed")
    return 0


if __name__ == "__main__":
    sys.exit(main())

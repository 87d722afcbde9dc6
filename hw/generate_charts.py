"""Draw the charts of `charts.toml` as SVG: the system, boot to drive, row to answer.

python hw/generate_charts.py           write the pictures
python hw/generate_charts.py --check   compare with the committed ones
"""

from __future__ import annotations

import argparse
import sys
import tomllib
from collections.abc import Mapping
from html import escape
from pathlib import Path
from typing import Any

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent
LINE_PX = 15
TITLE_PX = 18
# Mean advance of a letter of DejaVu Sans as a share of its size, bold for titles.
LETTER, BOLD_LETTER = 0.57, 0.66
STYLE = """.b{fill:#f6f6f2;stroke:#555} .m{fill:#e8f0f8;stroke:#23527c;stroke-width:1.6} \
.r{fill:#fbeaea;stroke:#a33;stroke-width:1.6} .h{fill:#eaf6ea;stroke:#2a6b2a;stroke-width:1.6} \
.f{fill:none;stroke:#999;stroke-dasharray:7 5}
.t{font-size:14px;font-weight:bold;text-anchor:middle;fill:#111} \
.s{font-size:11.5px;text-anchor:middle;fill:#333} \
.l{font-size:10.5px;text-anchor:middle;fill:#23527c}
.a{fill:none;stroke:#444;stroke-width:1.4;marker-end:url(#h)}"""
ARROW_HEAD = (
    '<defs><marker id="h" viewBox="0 0 8 8" refX="7.5" refY="4" markerWidth="8" markerHeight="8"'
    ' orient="auto"><path d="M0 0 L8 4 L0 8 z" fill="#444"/></marker></defs>'
)


class ChartError(Exception):
    """Text that its box does not hold, an arrow that is no line."""


def box(row: Mapping[str, Any]) -> list[str]:
    """Return a box with its title and its lines, each in the middle.

    Raises
    ------
    ChartError
        If the text is wider or higher than the box.
    """
    x, y, wide, high = row["at"]
    lines = row.get("lines", [])
    widest = max(
        [len(row["title"]) * 14 * BOLD_LETTER, *(len(line) * 11.5 * LETTER for line in lines)]
    )
    needed = TITLE_PX + LINE_PX * len(lines) + 10
    if row["kind"] != "f" and (widest > wide or needed > high):
        raise ChartError(f"{row['title']}: text of {widest:.0f} x {needed} px in {wide} x {high}")
    found = [f'<rect class="{row["kind"]}" x="{x}" y="{y}" width="{wide}" height="{high}" rx="6"/>']
    middle = x + wide / 2
    top = y + (TITLE_PX if row["kind"] == "f" else (high - needed) / 2 + TITLE_PX + 1)
    found.append(f'<text class="t" x="{middle:g}" y="{top:g}">{escape(row["title"])}</text>')
    for number, line in enumerate(lines, 1):
        place = top + 2 + LINE_PX * number
        found.append(f'<text class="s" x="{middle:g}" y="{place:g}">{escape(line)}</text>')
    return found


def arrow(row: Mapping[str, Any]) -> list[str]:
    """Return an arrow through its points, with its label where that is said."""
    points = row["points"]
    if len(points) < 2:
        raise ChartError(f"an arrow of {len(points)} points")
    way = " L".join(f"{x} {y}" for x, y in points)
    dashed = ' stroke-dasharray="5 4"' if row.get("dashed") else ""
    found = [f'<path class="a" d="M{way}"{dashed}/>']
    if "label" in row:
        (x, y), (x2, y2) = points[:2]
        place = row.get("label_at", [(x + x2) / 2, (y + y2) / 2 - 5])
        found.append(
            f'<text class="l" x="{place[0]:g}" y="{place[1]:g}">{escape(row["label"])}</text>'
        )
    return found


def draw(chart: Mapping[str, Any]) -> str:
    """Return one chart as SVG."""
    wide, high = chart["size"]
    parts = [
        "<!-- made by hw/generate_charts.py from charts.toml -->",
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {wide} {high}"'
        ' font-family="DejaVu Sans, Helvetica, sans-serif">',
        f"<title>{escape(chart['title'])}</title>",
        f"<style>\n{STYLE}\n</style>",
        ARROW_HEAD,
        f'<rect width="{wide}" height="{high}" fill="white"/>',
    ]
    for row in chart["box"]:
        parts += box(row)
    for row in chart["arrow"]:
        parts += arrow(row)
    return "\n".join([*parts, "</svg>", ""])


def main(arguments: list[str] | None = None) -> int:
    """Write or check; 0 ok, 2 a chart is wrong, 6 a picture is not current."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--check", action="store_true", help="compare with what is committed")
    check = parser.parse_args(arguments).check
    charts = tomllib.loads((HERE / "charts.toml").read_text(encoding="utf-8"))["chart"]
    for chart in charts:
        try:
            text = draw(chart)
        except ChartError as error:
            print(f"hw: charts.toml: {error}", file=sys.stderr)
            return 2
        path = ROOT / chart["file"]
        if not check:
            path.write_text(text, encoding="utf-8", newline="\n")
        elif not path.is_file() or path.read_text(encoding="utf-8") != text:
            print(
                f"{chart['file']} is not current: run python hw/generate_charts.py", file=sys.stderr
            )
            return 6
    return 0


if __name__ == "__main__":
    sys.exit(main())

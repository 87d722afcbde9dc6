"""What a study leaves behind: one table as Markdown and CSV, one picture as SVG."""

from __future__ import annotations

import csv
import io
import re
from dataclasses import dataclass
from math import isnan
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Cell = str | int | float
# Left out of a picture as matplotlib writes it: digits that nobody sees, comments, names, turns by
# nothing.
_LEFT_OUT = (
    (r"(\d\.\d)\d+", r"\1"), (r" \nL ", " "), (r"<!--.*?-->", ""), (r'<g id="[^"]+">', "<g>"),
    (r' transform="rotate\(-0 [^"]*"', ""), (r"\n\s+", "\n"),
    (r"; text-anchor: start|; stroke-linecap: square", ""),
    (r'(<use .*?) style="stroke: #000000; stroke-width: 0.8"', r"\1"),  # as its shape has it
    (r"; font-family: 'DejaVu Sans', sans-serif", ""),
    ("<svg ", "<svg font-family=\"'DejaVu Sans', sans-serif\" "),
)  # fmt: skip


@dataclass(frozen=True)
class Table:
    """Rows under named columns, and the words that belong above and below them."""

    title: str
    columns: tuple[str, ...]
    rows: tuple[tuple[Cell, ...], ...]
    remark: str = ""


def shown(cell: Cell) -> str:
    """Return a cell as people read it: four digits of a number, a dash for none."""
    if isinstance(cell, float):
        return "-" if isnan(cell) else f"{cell:.4g}"
    return str(cell)


def markdown(table: Table) -> str:
    """Return a table in Markdown."""
    lines = [
        "| " + " | ".join(table.columns) + " |",
        "| " + " | ".join("---" for _ in table.columns) + " |",
        *("| " + " | ".join(shown(c) for c in row) + " |" for row in table.rows),
    ]
    words = [f"# {table.title}", "", "Simulated data throughout.", "", *lines]
    if table.remark:
        words += ["", table.remark]
    return "\n".join(words) + "\n"


def write(table: Table, figure: Figure, stem: Path) -> list[Path]:
    """Write `stem`.md, .csv and .svg; return the paths."""
    text, cells, picture = (stem.with_suffix(s) for s in (".md", ".csv", ".svg"))
    text.write_text(markdown(table), encoding="utf-8")
    with cells.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(table.columns)
        writer.writerows(table.rows)
    picture.write_text(small_svg(figure), encoding="utf-8")
    figure.clear()
    return [text, cells, picture]


def small_svg(figure: Figure) -> str:
    """Return a picture as SVG with letters as letters, places to a tenth of a point, fewer of them.

    Matplotlib draws letters as shapes and writes places to a millionth: four times the size.
    """
    import matplotlib as mpl

    text = io.StringIO()
    style: Any = {"svg.fonttype": "none", "svg.hashsalt": "host studies",
             "font.sans-serif": ["DejaVu Sans"], "path.simplify_threshold": 0.3}  # fmt: skip
    with mpl.rc_context(style):
        figure.tight_layout()
        figure.savefig(text, format="svg", metadata={"Date": None})
    short = text.getvalue()
    for pattern, instead in _LEFT_OUT:
        short = re.sub(pattern, instead, short)
    return short

"""What a study leaves behind: one table as Markdown and CSV, one picture as SVG."""

from __future__ import annotations

import csv
from dataclasses import dataclass
from math import isnan
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Cell = str | int | float


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
    figure.tight_layout()
    figure.savefig(picture, metadata={"Date": None})
    figure.clear()
    return [text, cells, picture]

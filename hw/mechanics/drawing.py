"""A dimensioned drawing of a body as SVG: three views, hidden edges dashed, sizes in mm.

Overall sizes are measured on the solid; the table beside the views gives what vane.toml owns.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any
from xml.sax.saxutils import escape

SHEET = (297.0, 210.0)
_FONT = "font-family='DejaVu Sans, sans-serif'"
# name, eye, up: third angle projection
VIEWS = (
    ("from the side", (0.0, -1000.0, 0.0), (0.0, 0.0, 1.0)),
    ("from above", (0.0, 0.0, 1000.0), (0.0, 1.0, 0.0)),
    ("from behind", (1000.0, 0.0, 0.0), (0.0, 0.0, 1.0)),
)
_CELLS = ((20.0, 20.0, 150.0, 72.0), (20.0, 108.0, 150.0, 72.0), (185.0, 20.0, 95.0, 72.0))
_SCALES = (5.0, 4.0, 3.0, 2.0, 1.5, 1.0, 0.75, 0.5, 0.4, 0.25, 0.2)

Line = list[tuple[float, float]]


def _polylines(edges: Iterable[Any]) -> list[Line]:
    found: list[Line] = []
    for edge in edges:
        straight = str(edge.geom_type).endswith("LINE") and "SPLINE" not in str(edge.geom_type)
        steps = 1 if straight else 24
        points = [edge.position_at(k / steps) for k in range(steps + 1)]
        found.append([(p.X, p.Y) for p in points])
    return found


def draw(shape: Any, title: str, table: list[tuple[str, str]], note: str) -> str:
    """Return the drawing.

    Parameters
    ----------
    shape
        The body, or a compound of bodies.
    title, note
        For the strip below.
    table
        What is measured, and its size.
    """
    views = []
    for name, eye, up in VIEWS:
        middle = shape.center()  # an eye beside the axis would see round things as ellipses
        there = (middle.X + eye[0], middle.Y + eye[1], middle.Z + eye[2])
        visible, hidden = shape.project_to_viewport(there, up, middle)
        views.append((name, _polylines(visible), _polylines(hidden)))
    scale = min(_fit(lines, cell) for (_, lines, _), cell in zip(views, _CELLS, strict=True))
    body: list[str] = []
    for (name, lines, hidden), cell in zip(views, _CELLS, strict=True):
        body += _view(name, lines, hidden, cell, scale)
    body += _table(table)
    strip = f"{title}; scale {scale:g}:1, mm, third angle; {note}; never built; CERN-OHL-P-2.0"
    body.append("<line x1='8' y1='193' x2='289' y2='193' stroke='#000' stroke-width='0.3'/>")
    body.append(f"<text x='12' y='199.2' font-size='4.2' {_FONT}>{escape(strip)}</text>")
    return (
        f"<svg xmlns='http://www.w3.org/2000/svg' width='{SHEET[0]:g}mm' height='{SHEET[1]:g}mm'"
        f" viewBox='0 0 {SHEET[0]:g} {SHEET[1]:g}'>\n"
        "<rect width='100%' height='100%' fill='#fff'/>\n"
        "<rect x='8' y='8' width='281' height='194' fill='none' stroke='#000'"
        " stroke-width='0.4'/>\n" + "\n".join(body) + "\n</svg>\n"
    )


def _bounds(lines: list[Line]) -> tuple[float, float, float, float]:
    xs = [x for line in lines for x, _ in line]
    ys = [y for line in lines for _, y in line]
    return min(xs), min(ys), max(xs), max(ys)


def _fit(lines: list[Line], cell: tuple[float, float, float, float]) -> float:
    x1, y1, x2, y2 = _bounds(lines)
    room = min((cell[2] - 16) / max(x2 - x1, 1e-6), (cell[3] - 16) / max(y2 - y1, 1e-6))
    return next((scale for scale in _SCALES if scale <= room), 0.1)


def _view(
    name: str,
    lines: list[Line],
    hidden: list[Line],
    cell: tuple[float, float, float, float],
    scale: float,
) -> list[str]:
    x1, y1, x2, y2 = _bounds(lines)
    left = cell[0] + (cell[2] - scale * (x2 - x1)) / 2
    top = cell[1] + (cell[3] - scale * (y2 - y1)) / 2

    def at(x: float, y: float) -> tuple[float, float]:
        return left + scale * (x - x1), top + scale * (y2 - y)

    out = []
    for group, style in ((hidden, "stroke='#888' stroke-width='0.15' stroke-dasharray='1 0.8'"),
                         (lines, "stroke='#000' stroke-width='0.3'")):  # fmt: skip
        path = " ".join(
            "M" + " L".join(f"{px:.2f} {py:.2f}" for px, py in (at(*p) for p in line))
            for line in group
        )
        out.append(f"<path d='{path}' fill='none' {style}/>")
    right, bottom = at(x2, y1)
    out += _dimension(left, bottom + 5, right, bottom + 5, f"{x2 - x1:.1f}", turn=False)
    out += _dimension(left - 5, bottom, left - 5, top, f"{y2 - y1:.1f}", turn=True)
    out.append(
        f"<text x='{cell[0] + cell[2] / 2:.1f}' y='{cell[1] - 4:.1f}' font-size='3.6'"
        f" text-anchor='middle' {_FONT}>{name}</text>"
    )
    return out


def _dimension(x1: float, y1: float, x2: float, y2: float, text: str, *, turn: bool) -> list[str]:
    style = "stroke='#06c' stroke-width='0.2'"
    mx, my = (x1 + x2) / 2, (y1 + y2) / 2
    rotate = f" transform='rotate(-90 {mx - 1:.2f} {my:.2f})'" if turn else ""
    ticks = []
    for x, y in ((x1, y1), (x2, y2)):
        ends = (x - 1.5, y, x + 1.5, y) if turn else (x, y - 1.5, x, y + 1.5)
        a, b, c, d = (f"{v:.2f}" for v in ends)
        ticks.append(f"<line x1='{a}' y1='{b}' x2='{c}' y2='{d}' {style}/>")
    offset = (mx - 1, my) if turn else (mx, my + 4.2)
    return [
        f"<line x1='{x1:.2f}' y1='{y1:.2f}' x2='{x2:.2f}' y2='{y2:.2f}' {style}/>",
        *ticks,
        f"<text x='{offset[0]:.2f}' y='{offset[1]:.2f}' font-size='3.6' fill='#06c'"
        f" text-anchor='middle' {_FONT}{rotate}>{text}</text>",
    ]


def _table(rows: list[tuple[str, str]]) -> list[str]:
    out = []
    for k, (what, size) in enumerate(rows):
        y = 112 + 5.2 * k
        out.append(f"<text x='185' y='{y:.1f}' font-size='3.6' {_FONT}>{escape(what)}</text>")
        end = f"<text x='284' y='{y:.1f}' font-size='3.6' text-anchor='end' {_FONT}>"
        out.append(f"{end}{escape(size)}</text>")
    return out

"""Read a .kicad_pcb: where each footprint stands, what its fabrication drawing covers, its pins."""

from __future__ import annotations

import re
from dataclasses import dataclass

_TOKEN = re.compile(r'"((?:[^"\\]|\\.)*)"|([()])|([^\s()"]+)')
Node = list["Node | str"]


@dataclass(frozen=True, slots=True)
class Placed:
    """One footprint, in its own frame, mm, y down.

    Attributes
    ----------
    at
        x, y of the sheet and degrees counter-clockwise.
    outline
        x1, y1, x2, y2 of what its layer F.Fab draws.
    pins
        Pads with a hole: x, y.
    """

    reference: str
    package: str
    at: tuple[float, float, float]
    outline: tuple[float, float, float, float]
    pins: tuple[tuple[float, float], ...]
    below: bool


def parse(text: str) -> Node:
    """Return the nested lists of an s-expression."""
    stack: list[Node] = [[]]
    for quoted, bracket, word in _TOKEN.findall(text):
        if bracket == "(":
            stack.append([])
        elif bracket == ")":
            done = stack.pop()
            stack[-1].append(done)
        else:
            stack[-1].append(word or quoted)
    (root,) = stack[0]
    assert isinstance(root, list)
    return root


def _all(node: Node, name: str) -> list[Node]:
    return [one for one in node if isinstance(one, list) and one and one[0] == name]


def _numbers(node: Node) -> list[float]:
    return [float(word) for word in node[1:] if isinstance(word, str) and _is_number(word)]


def _is_number(word: str) -> bool:
    return re.fullmatch(r"-?\d+(\.\d+)?", word) is not None


def placed(text: str) -> list[Placed]:
    """Return every footprint of a board."""
    return [_footprint(node) for node in _all(parse(text), "footprint")]


def outline(text: str) -> tuple[float, float, float, float]:
    """Return x1, y1, x2, y2 of the board's edge on its sheet."""
    points = [
        _numbers(end)
        for line in _all(parse(text), "gr_line")
        if ["layer", "Edge.Cuts"] in line
        for name in ("start", "end")
        for end in _all(line, name)
    ]
    xs, ys = [p[0] for p in points], [p[1] for p in points]
    return min(xs), min(ys), max(xs), max(ys)


def _footprint(node: Node) -> Placed:
    x, y, *turn = _numbers(_all(node, "at")[0])
    names = {str(one[1]): str(one[2]) for one in _all(node, "property")}
    points: list[tuple[float, float]] = []
    for kind in ("fp_line", "fp_rect", "fp_circle", "fp_poly", "fp_arc"):
        for drawn in _all(node, kind):
            if ["layer", "F.Fab"] in drawn or ["layer", "B.Fab"] in drawn:
                points += _reach(kind, drawn)
    pads = [pad for pad in _all(node, "pad") if pad[2] == "thru_hole"]
    pins = tuple((p[0], p[1]) for p in (_numbers(_all(pad, "at")[0]) for pad in pads))
    xs, ys = [p[0] for p in points] or [0.0], [p[1] for p in points] or [0.0]
    return Placed(
        names["Reference"],
        str(node[1]).partition(":")[2],
        (x, y, turn[0] if turn else 0.0),
        (min(xs), min(ys), max(xs), max(ys)),
        pins,
        ["layer", "B.Cu"] in node,
    )


def _reach(kind: str, drawn: Node) -> list[tuple[float, float]]:
    if kind == "fp_circle":
        cx, cy = _numbers(_all(drawn, "center")[0])
        ex, ey = _numbers(_all(drawn, "end")[0])
        radius = ((ex - cx) ** 2 + (ey - cy) ** 2) ** 0.5
        return [(cx - radius, cy - radius), (cx + radius, cy + radius)]
    if kind == "fp_poly":
        return [(p[0], p[1]) for p in map(_numbers, _all(_all(drawn, "pts")[0], "xy"))]
    ends = [_numbers(end) for name in ("start", "end") for end in _all(drawn, name)]
    return [(p[0], p[1]) for p in ends]

"""Mega, shield with its parts, box: everything that stands in each other, in the Mega's frame.

x along the Mega from its USB side, y across, z up, zero at the Mega's lower left corner on the
upper face of its board; mm. Places come from the routed board, heights from components.toml.
"""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from typing import Any

import kicad_text
import solids
from build123d import Align, Box, Cylinder, Part, Pos, Rot
from sources import COMPONENTS, STACK, hash_of

# Of the sheet: the Mega's lower left corner (hw/board/copper.py).
ORIGIN_MM = (60.0, 120.0)
_UP = (Align.CENTER, Align.CENTER, Align.MIN)
_LOW = (Align.MIN, Align.MIN, Align.MIN)


@dataclass(frozen=True, slots=True)
class Solid:
    """One body of the stack; those of one owner may touch and share volume."""

    name: str
    owner: str
    shape: Any
    colour: str
    bounds: tuple[float, float, float, float, float, float]


def solid(name: str, owner: str, shape: Any, colour: str) -> Solid:
    """Return a body with its bounds."""
    box = shape.bounding_box()
    low, high = box.min, box.max
    return Solid(name, owner, shape, colour, (low.X, low.Y, low.Z, high.X, high.Y, high.Z))


def components() -> dict[str, Any]:
    """Read components.toml."""
    return tomllib.loads(COMPONENTS.read_text(encoding="utf-8"))


def body_of(package: str, outline: tuple[float, float, float, float], height: float) -> Part:
    """Return a part standing on its board, in its footprint's frame turned y up."""
    x1, y1, x2, y2 = outline
    table = components()["package"][package]
    middle = Pos((x1 + x2) / 2, -(y1 + y2) / 2, 0)
    if table.get("shape") == "cylinder":
        return middle * Cylinder((x2 - x1) / 2, height, align=_UP)
    return middle * Box(x2 - x1, y2 - y1, height, align=_UP)


def board_top(table: dict[str, Any]) -> float:
    """Return z of the shield's upper face."""
    return float(table["mega"]["socket"] + table["stack"]["socket_strip"] + 1.6)


def shield(text: str, *, plugged: bool = True) -> list[Solid]:
    """Return the shield's board and every part on it.

    Parameters
    ----------
    text
        Content of logger.kicad_pcb.
    plugged
        With plugs and the bend of their wires.
    """
    table = components()
    top = board_top(table)
    x1, y1, x2, y2 = kicad_text.outline(text)
    board = Pos(x1 - ORIGIN_MM[0], ORIGIN_MM[1] - y2, top - 1.6) * Box(
        x2 - x1, y2 - y1, 1.6, align=_LOW
    )
    found = [solid("board", "shield", board, "#4c5238")]
    for part in kicad_text.placed(text):
        place = Pos(part.at[0] - ORIGIN_MM[0], ORIGIN_MM[1] - part.at[1], 0)
        at = place * Rot(0, 0, part.at[2])
        if part.package in table["package"]:
            row = table["package"][part.package]
            height = row["mated"] if plugged and "mated" in row else row["height"]
            shape = Pos(0, 0, top) * at * body_of(part.package, part.outline, height)
            found.append(solid(part.reference, part.reference, shape, row["colour"]))
        if part.reference != "M1":
            stub = table["stack"]["stub"]
            for k, (x, y) in enumerate(part.pins):
                wire = Pos(0, 0, top - 1.6 - stub) * at * Pos(x, -y, 0)
                shape = wire * Cylinder(0.5, stub, align=_UP)
                found.append(solid(f"{part.reference} wire {k + 1}", "shield", shape, "#b0b0b0"))
    return found


def card_module(text: str) -> Solid:
    """Return the card module lying above the shield, its pins in J26."""
    table = components()
    card, socket = table["card_module"], table["package"]["PinSocket_1x06_P2.54mm_Vertical"]
    (plug,) = (part for part in kicad_text.placed(text) if part.reference == "J26")
    middle_y = ORIGIN_MM[1] - plug.at[1] - 2.5 * 2.54
    right = plug.at[0] - ORIGIN_MM[0] + card["beyond"]
    low = board_top(table) + socket["height"] + card["lift"]
    shape = Pos(right - card["length"], middle_y - card["width"] / 2, low) * Box(
        card["length"], card["width"], card["thickness"], align=_LOW
    )
    return solid("card module", "card module", shape, "#3050a0")


def mega(text: str) -> list[Solid]:
    """Return the Mega: board, sockets under the shield's rows, what stands high."""
    table = components()["mega"]
    board = Pos(0, 0, -table["thickness"]) * Box(
        table["length"], table["width"], table["thickness"], align=_LOW
    )
    for x, y in table["holes"]:
        board -= Pos(x, y, -table["thickness"]) * Cylinder(1.6, table["thickness"], align=_UP)
    found = [solid("Mega's board", "Mega", board, "#187888")]
    (plugs,) = (part for part in kicad_text.placed(text) if part.reference == "M1")
    # Up to the shield: the sockets and, above them, the plastic of its strips.
    high = board_top(components()) - 1.6
    for k, (x, y) in enumerate(plugs.pins):
        shape = Pos(x, -y, 0) * Box(2.5, 2.5, high, align=_UP)
        found.append(solid(f"socket {k + 1}", "Mega", shape, "#202020"))
    for name, (x1, y1, x2, y2, height) in table["parts"].items():
        shape = Pos(x1, y1, 0) * Box(x2 - x1, y2 - y1, height, align=_LOW)
        found.append(solid(name, "Mega", shape, "#c0c0c0" if "shell" in name else "#303030"))
    leads = Pos(2.0, 4.5, -table["thickness"] - table["leads"]) * Box(
        table["length"] - 4.0, table["width"] - 9.0, table["leads"], align=_LOW
    )
    for x, y in table["holes"]:
        leads -= Pos(x, y, -5.0) * Cylinder(3.2, 5.0, align=_UP)
    return [*found, solid("Mega's leads", "Mega", leads, "#b0b0b0")]


def case(sizes: solids.Sizes) -> list[Solid]:
    """Return box, lid, the glands' nuts and a USB plug in its hole."""
    box, table = sizes["box"], components()["stack"]
    found = [
        solid(body.name, body.name, body.shape, "#d8d8d0")
        for body in solids.cases(sizes)
        if body.name != "IMU tray"
    ]
    diameter, depth = table["gland_nut"]
    floor = -box["boss"] - 1.6
    for k in range(round(box["glands"])):
        x = box["inner_x"] / 2 + (k - (box["glands"] - 1) / 2) * 30.0 - box["mega_x"]
        nut = Pos(x, -box["mega_y"], floor + box["gland_z"]) * Rot(-90, 0, 0)
        shape = nut * Cylinder(diameter / 2, depth, align=_UP)
        found.append(solid(f"gland nut {k + 1}", f"gland nut {k + 1}", shape, "#303030"))
    shell = components()["mega"]["parts"]["USB shell"]
    wide, high, long = table["usb_plug"]
    shape = Pos(shell[0] - long / 2, (shell[1] + shell[3]) / 2, shell[4] / 2) * Box(
        long, wide, high
    )
    return [*found, solid("USB plug", "USB plug", shape, "#f0f0f0")]


def everything(sizes: solids.Sizes, text: str) -> list[Solid]:
    """Return the closed box with all in it."""
    return [*mega(text), *shield(text), card_module(text), *case(sizes)]


def _apart(one: Solid, other: Solid) -> bool:
    a, b = one.bounds, other.bounds
    return any(a[k] >= b[k + 3] - 1e-6 or b[k] >= a[k + 3] - 1e-6 for k in range(3))


def faults(bodies: list[Solid]) -> list[str]:
    """Name every two bodies of different owners that share volume.

    Parameters
    ----------
    bodies
        See `everything`. Bounds are compared first: a hundred bodies take seconds.
    """
    found = []
    for k, one in enumerate(bodies):
        for other in bodies[k + 1 :]:
            if one.owner == other.owner or _apart(one, other):
                continue
            shared = one.shape & other.shape
            volume = float(shared.volume) if shared else 0.0
            if volume > 1e-3:
                found.append(f"{one.name} and {other.name} share {volume:.2f} mm3")
    return found


def clearance(sizes: solids.Sizes, bodies: list[Solid]) -> dict[str, float]:
    """Return what is left, in mm: below the lid's rim, beside the board, under the Mega."""
    box = sizes["box"]
    inside = [body for body in bodies if body.owner not in _CASE and "USB plug" not in body.name]
    rim = -box["boss"] - 1.6 + box["height"] - 2.0
    left, right = -box["mega_x"], box["inner_x"] - box["mega_x"]
    front, back = -box["mega_y"], box["inner_y"] - box["mega_y"]
    return {
        "below the lid": rim - max(body.bounds[5] for body in inside),
        "left": min(body.bounds[0] for body in inside) - left,
        "right": right - max(body.bounds[3] for body in inside),
        "front": min(body.bounds[1] for body in inside) - front,
        "back": back - max(body.bounds[4] for body in inside),
        "under the Mega": min(body.bounds[2] for body in inside) + box["boss"] + 1.6,
    }


_CASE = ("box", "box lid", *(f"gland nut {k}" for k in range(1, 9)))


def report(sizes: solids.Sizes, bodies: list[Solid]) -> str:
    """Return stack.csv: what is left, and how high each part of the shield reaches."""
    rows = [
        f"# made by hw/mechanics/make_parts.py, sha256 of its sources {hash_of(STACK)}",
        "what,mm",
    ]
    rows += [f"left {name},{value:.2f}" for name, value in clearance(sizes, bodies).items()]
    rows += [
        f"top of {body.name},{body.bounds[5]:.2f}"
        for body in bodies
        if " wire " not in body.name and "socket" not in body.name
    ]
    return "\n".join(rows) + "\n"

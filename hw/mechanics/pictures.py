"""The pictures of the build page, rendered from the bodies."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import render
import solids
import stack
from build123d import Box, Cylinder, Pos, Rot
from sources import SHIELD

_COLOURS = {
    "petg": "#d8d8d0", "balsa": "#e8d0a0", "carbon": "#383838", "steel": "#a0a8b0",
    "brass": "#d0a840", "magnet": "#707880", "bought": "#70a070",
}  # fmt: skip
# How far each part of the vane is drawn from its place, along the shaft.
_APART_MM = {
    "lid": -58.0, "encoder board": -42.0, "magnet": -26.0, "magnet holder": -20.0,
    "second bearing": -8.0, "bearing": 12.0, "shaft": 32.0, "hub": 50.0, "arm": 62.0, "fin": 62.0,
    "counterweight": 62.0,
}  # fmt: skip
Painted = list[tuple[Any, str]]


def _vane(bodies: Sequence[solids.Body], *, apart: bool = False) -> Painted:
    return [
        (
            Pos(0, 0, _APART_MM.get(body.name, 0.0) if apart else 0.0) * body.shape,
            _COLOURS[body.material],
        )
        for body in bodies
    ]


def shield(sizes: solids.Sizes, text: str) -> Painted:
    """Return the board with its parts, no plugs in them."""
    return [(one.shape, one.colour) for one in stack.shield(text, plugged=False)]


def box(sizes: solids.Sizes, text: str) -> Painted:
    """Return what goes into the box, drawn above each other."""
    high = {"box": 0.0, "Mega": 55.0, "card module": 122.0, "box lid": 165.0}
    bodies = [*stack.mega(text), *stack.shield(text, plugged=False), stack.card_module(text)]
    bodies += [one for one in stack.case(sizes) if one.name in ("box", "box lid")]
    return [(Pos(0, 0, high.get(one.owner, 95.0)) * one.shape, one.colour) for one in bodies]


def vane_parts(sizes: solids.Sizes, text: str) -> Painted:
    """Return one vane, its parts drawn apart along the shaft."""
    return _vane(solids.vane(sizes), apart=True)


def boom(sizes: solids.Sizes, text: str) -> Painted:
    """Return a vane on its boom and a pitot on its own beside it, with clamps."""
    axis, pitot = solids.boom_z(sizes), sizes["pitot"]
    parts = {body.name: body for body in solids.mounts(sizes)}
    start = sizes["housing"]["side"] / 2 + 4.0
    middle = start + sizes["boom"]["length"] / 2
    outer = sizes["boom"]["outer"] / 2 + 0.1 + sizes["clamp"]["wall"]
    found = _vane(solids.vane(sizes))
    for y in (0.0, -pitot["beside_vane"]):
        tube = Pos(middle, y, axis) * Rot(0, 90, 0) * parts["boom"].shape
        found.append((tube, _COLOURS["carbon"]))
        for x in (start + 190.0, start + 270.0):
            found.append((Pos(x, y, axis - outer) * parts["boom clamp"].shape, _COLOURS["petg"]))
    flush = Pos(start + pitot["length"] / 2, -pitot["beside_vane"], axis)
    turned = Rot(-90, 0, 0) * Rot(0, 90, 0)
    found.append((flush * turned * parts["pitot holder"].shape, _COLOURS["petg"]))
    behind = start + pitot["tube_long"] / 2 - pitot["ahead"]
    probe = Pos(pitot["offset"], 0, 0) * Cylinder(pitot["tube"] / 2, pitot["tube_long"])
    at = Pos(behind, -pitot["beside_vane"], axis) * turned
    found.append((at * probe, _COLOURS["brass"]))
    return found


def linkage(sizes: solids.Sizes, text: str) -> Painted:
    """Return a surface's pot: arm, rod, horn."""
    pot = sizes["pot"]
    parts = {body.name: body.shape for body in solids.mounts(sizes)}
    far = 60.0
    body = Pos(0, 0, -6.0) * (Cylinder(6.5, 6.0) + Pos(0, 0, 6.0) * Cylinder(pot["shaft"] / 2, 8.0))
    rod = Pos(far / 2, pot["arm"], 3.5) * Rot(0, 90, 0) * Cylinder(0.8, far)
    surface = Pos(far + 15.0, 0, 5.5) * Box(60.0, 60.0, 3.0)
    return [
        (body, "#305080"),
        (Rot(0, 0, 90) * parts["pot arm"], _COLOURS["petg"]),
        (rod, _COLOURS["steel"]),
        (Pos(far, 0, 2.0) * Rot(0, 0, 90) * Rot(180, 0, 0) * parts["surface horn"], "#e0b080"),
        (surface, _COLOURS["balsa"]),
    ]


def jig(sizes: solids.Sizes, text: str) -> Painted:
    """Return the protractor jig on the boom, the fork holding the fin at 20 deg."""
    axis, start = solids.boom_z(sizes), sizes["housing"]["side"] / 2 + 4.0
    parts = {body.name: body.shape for body in solids.jigs(sizes)}
    found: Painted = []
    for body in solids.vane(sizes):
        turn = Rot(0, 0, 20.0) if body.turns else Pos(0, 0, 0)
        found.append((turn * body.shape, _COLOURS[body.material]))
    tube = Cylinder(sizes["boom"]["outer"] / 2, 120.0)
    found.append((Pos(start + 60.0, 0, axis) * Rot(0, 90, 0) * tube, _COLOURS["carbon"]))
    found.append((parts["protractor jig"], "#90b8e0"))
    found.append((Rot(0, 0, 20.0) * parts["protractor fork"], "#e07050"))
    return found


# Name, what is drawn, where the eye stands.
PICTURES: tuple[tuple[str, Callable[[solids.Sizes, str], Painted], float, float], ...] = (
    ("shield", shield, -70.0, 40.0),
    ("box", box, -65.0, 22.0),
    ("vane-parts", vane_parts, -60.0, 14.0),
    ("boom", boom, -55.0, 28.0),
    ("linkage", linkage, -60.0, -35.0),
    ("jig", jig, -40.0, 35.0),
)


def write(sizes: solids.Sizes, folder: Path) -> int:
    """Write every picture; return how many."""
    text = SHIELD.read_text(encoding="utf-8")
    for name, bodies, azimuth, elevation in PICTURES:
        painted = [(render.triangles(shape), colour) for shape, colour in bodies(sizes, text)]
        render.draw(folder / f"{name}.png", painted, azimuth_deg=azimuth, elevation_deg=elevation)
    return len(PICTURES)

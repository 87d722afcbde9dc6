"""The bodies: vane, mounts, jigs, box; their sizes come from vane.toml.

x downstream, y across, z along the vane's shaft; mm.
"""

from __future__ import annotations

import math
import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from build123d import Align, Box, Cylinder, Part, Pos, Rot

SIZES_PATH = Path(__file__).resolve().parent / "vane.toml"
_UP = (Align.CENTER, Align.CENTER, Align.MIN)
_REAR = (Align.MIN, Align.CENTER, Align.CENTER)

Sizes = dict[str, dict[str, float]]


@dataclass(frozen=True, slots=True)
class Body:
    """One part.

    Attributes
    ----------
    shape
        Where it stands in its assembly, the vane at rest in the wind.
    material
        A name of vane.toml's densities, or "bought" with its own mass.
    quantity
        For one logger: four vanes and a pitot, a boom each.
    turns
        Turns with the vane.
    """

    name: str
    shape: Any
    material: str
    quantity: int
    turns: bool = False
    mass_g: float = 0.0
    group: str = "vane"


def load_sizes() -> Sizes:
    """Read vane.toml."""
    table = tomllib.loads(SIZES_PATH.read_text(encoding="utf-8"))
    return {name: rows for name, rows in table.items() if isinstance(rows, dict)}


def mass_g(body: Body, sizes: Sizes) -> float:
    """Return the mass of one piece."""
    if body.material == "bought":
        return body.mass_g
    return float(body.shape.volume) * sizes["density_gpcm3"][body.material] / 1000.0


def _rod(radius: float, x1: float, x2: float) -> Part:
    return Pos(x1, 0, 0) * Rot(0, 90, 0) * Cylinder(radius, x2 - x1, align=_UP)


def _disc(radius: float, z1: float, z2: float) -> Part:
    return Pos(0, 0, z1) * Cylinder(radius, z2 - z1, align=_UP)


def counterweight(sizes: Sizes, length: float) -> Part:
    """Return the counterweight of a length, its middle in its place."""
    weight, arm = sizes["counterweight"], sizes["arm"]
    front, rear = weight["middle"] - length / 2, weight["middle"] + length / 2
    return _rod(weight["diameter"] / 2, front, rear) - _rod(arm["diameter"] / 2, front, rear)


def moment_gmm(bodies: list[Body], sizes: Sizes) -> float:
    """Return the moment of all turning bodies about the shaft, in g mm, positive tail-heavy."""
    return sum(mass_g(b, sizes) * float(b.shape.center().X) for b in bodies if b.turns)


def inertia_kgm2(bodies: list[Body], sizes: Sizes) -> float:
    """Return the moment of inertia of all turning bodies about the shaft."""
    total = 0.0
    for body in bodies:
        if body.turns:
            own = float(body.shape.matrix_of_inertia[2][2]) / float(body.shape.volume)
            centre = body.shape.center()
            total += mass_g(body, sizes) * (own + centre.X**2 + centre.Y**2)
    return total * 1e-9


def vane(sizes: Sizes) -> list[Body]:
    """Return the parts of one vane, balanced to what a caliper can do."""
    turning = _turning(sizes)
    heavy = moment_gmm(turning, sizes)
    weight = sizes["counterweight"]
    area = float(counterweight(sizes, 1.0).volume)
    per_mm = area * sizes["density_gpcm3"]["brass"] / 1000.0 * -weight["middle"]
    length = round(heavy / per_mm / weight["step"]) * weight["step"]
    turning.append(Body("counterweight", counterweight(sizes, length), "brass", 4, turns=True))
    return turning + _standing(sizes)


def _turning(sizes: Sizes) -> list[Body]:
    fin, arm, hub = sizes["fin"], sizes["arm"], sizes["hub"]
    shaft, magnet, housing = sizes["shaft"], sizes["magnet"], sizes["housing"]
    radius = arm["diameter"] / 2
    plate = Pos(fin["leading_edge"], 0, 0) * Box(
        fin["chord"], fin["thickness"], fin["span"], align=_REAR
    )
    slot = Pos(fin["leading_edge"], 0, 0) * Box(fin["slot"], 9, arm["diameter"], align=_REAR)
    rod = _rod(radius, arm["front"], arm["rear"])
    tab_x = -(hub["tab_inner"] + hub["tab_outer"]) / 2
    tab_long = hub["tab_outer"] - hub["tab_inner"]
    base = -hub["height"] / 2
    bridge = Pos(tab_x / 1.35, 0, base + 1.0) * Box(-tab_x, hub["tab_width"], 2.0)
    body = _disc(hub["diameter"] / 2, base, -base) + bridge
    body += Pos(tab_x, 0, base - hub["tab_depth"] / 2 + 1.0) * Box(
        tab_long, hub["tab_width"], hub["tab_depth"] + 2.0
    )
    body -= _rod(radius, -20, 20)
    body -= _disc(shaft["diameter"] / 2, base, shaft["top"])
    low = shaft["bottom"] - magnet["height"] - 0.5
    cup = _disc(magnet["holder_diameter"] / 2, low, shaft["bottom"] + 3.5)
    cup -= _disc(shaft["diameter"] / 2, shaft["bottom"], shaft["bottom"] + 3.5)
    cup -= _disc(magnet["diameter"] / 2 + housing["press"], low, low + magnet["height"])
    pin = _disc(shaft["diameter"] / 2, shaft["bottom"], shaft["top"]) - rod
    return [
        Body("fin", plate - slot, "balsa", 4, turns=True),
        Body("arm", rod, "carbon", 4, turns=True),
        Body("hub", body, "petg", 4, turns=True),
        Body("shaft", pin, "steel", 4, turns=True),
        Body("magnet holder", cup, "petg", 4, turns=True),
        Body(
            "magnet", _disc(magnet["diameter"] / 2, low, low + magnet["height"]), "magnet", 4, True
        ),
    ]


def magnet_face(sizes: Sizes) -> float:
    """Return z of the magnet's lower face."""
    return sizes["shaft"]["bottom"] - sizes["magnet"]["height"] - 0.5


def _standing(sizes: Sizes) -> list[Body]:
    bearing, sensor = sizes["bearing"], sizes["sensor"]
    seat = bearing["outer"] / 2
    rings = []
    for top in (bearing["first"], bearing["second"]):
        ring = _disc(seat, top - bearing["width"], top)
        rings.append(ring - _disc(sizes["shaft"]["diameter"] / 2, top - bearing["width"], top))
    chip_top = magnet_face(sizes) - sizes["magnet"]["air_gap"]
    board_top = chip_top - sensor["chip"]
    floor = board_top - sensor["thickness"]
    side = sensor["side"]
    board = Pos(0, 0, floor) * Box(side, side, sensor["thickness"], align=_UP)
    board += Pos(0, 0, board_top) * Box(5.0, 6.0, sensor["chip"], align=_UP)
    plug_x, wide, long = sensor["plug_x"], sensor["plug_wide"], sensor["plug_long"]
    high = sensor["plug_high"]
    board += Pos(plug_x, 0, floor - high) * Box(wide, long, high, align=_UP)
    board += Pos(plug_x - 0.5, 0, board_top) * Box(1.0, 6.0, sensor["pins"], align=_UP)
    return [
        Body("bearing", rings[0], "bought", 8, mass_g=bearing["mass_g"]),
        Body("second bearing", rings[1], "bought", 0, mass_g=bearing["mass_g"]),
        Body("housing", _housing(sizes, board_top, floor), "petg", 4),
        Body("lid", _lid(sizes, floor), "petg", 4),
        Body("encoder board", board, "bought", 0, mass_g=sensor["mass_g"]),
    ]


def _corners(sizes: Sizes) -> list[tuple[float, float]]:
    place = sizes["housing"]["side"] / 2 - 2.2
    return [(x, y) for x in (-place, place) for y in (-place, place)]


def _housing(sizes: Sizes, board_top: float, floor: float) -> Part:
    bearing, housing, boom = sizes["bearing"], sizes["housing"], sizes["boom"]
    hub, side = sizes["hub"], housing["side"]
    top = bearing["first"] + 0.5
    shelf = bearing["second"] - bearing["width"] + 1.0
    body = _disc(housing["collar"] / 2, shelf, top)
    body += _disc(hub["tab_outer"] + 2.0, shelf - 0.5, top - 3.5)
    body += Pos(0, 0, floor) * Box(side, side, shelf - floor, align=_UP)
    radius = (hub["tab_inner"] + hub["tab_outer"]) / 2
    wide = 2 * radius * math.sin(math.radians(housing["stop_width_deg"] / 2))
    # Tab and stop meet at the tab's inner corner.
    widths = math.atan2(hub["tab_width"] / 2, hub["tab_inner"]) + math.atan2(
        wide / 2, hub["tab_inner"]
    )
    angle = housing["limit_deg"] + math.degrees(widths)
    for turn in (180 - angle, 180 + angle):
        stop = Pos(radius, 0, top - 3.6) * Box(
            hub["tab_outer"] - hub["tab_inner"] + 2.4, wide, 2.6, align=_UP
        )
        body += Rot(0, 0, turn) * stop
    middle_z = floor + housing["socket_outer"] / 2
    socket = Pos(side / 2 - 1, 0, middle_z) * Rot(0, 90, 0)
    length = housing["socket_length"] + 1
    body += socket * Cylinder(housing["socket_outer"] / 2, length, align=_UP)
    bore = Pos(side / 2 + 4, 0, middle_z) * Rot(0, 90, 0)
    body -= bore * Cylinder(boom["outer"] / 2 + 0.1, length, align=_UP)
    body -= _disc(bearing["outer"] / 2 + housing["press"], bearing["first"] - bearing["width"], top)
    body -= _disc(2.2, bearing["second"] - 3.0, top)
    low = bearing["second"] - bearing["width"]
    body -= _disc(bearing["outer"] / 2 + housing["press"], low - 2, bearing["second"])
    body -= _disc(sizes["magnet"]["holder_diameter"] / 2 + 1.0, board_top - 1, low)
    recess = sizes["sensor"]["side"] + 2 * housing["play"]
    body -= Pos(0, 0, floor - 1) * Box(recess, recess, board_top - floor + 1, align=_UP)
    chip = sizes["sensor"]["chip"] + 0.6
    body -= Pos(0, 0, board_top) * Box(18.0, 18.0, chip, align=_UP)
    for x, y in _corners(sizes):
        body -= Pos(x, y, floor) * Cylinder(housing["screw"] / 2, 8.0, align=_UP)
    return body


def _lid(sizes: Sizes, floor: float) -> Part:
    housing = sizes["housing"]
    body = Pos(0, 0, floor - 2.4) * Box(housing["side"], housing["side"], 2.4, align=_UP)
    sensor, play = sizes["sensor"], 2 * housing["play"]
    body -= Pos(sensor["plug_x"], 0, floor - 3) * Box(
        sensor["plug_wide"] + play, sensor["plug_long"] + play, 4.0, align=_UP
    )
    for x, y in _corners(sizes):
        body -= Pos(x, y, floor - 3) * Cylinder(1.1, 4.0, align=_UP)
    return body


def mounts(sizes: Sizes) -> list[Body]:
    """Return boom, clamp, pitot holder, pot linkage."""
    boom, clamp, pitot, pot = sizes["boom"], sizes["clamp"], sizes["pitot"], sizes["pot"]
    tube = Cylinder(boom["outer"] / 2, boom["length"]) - Cylinder(boom["inner"] / 2, boom["length"])
    ring = boom["outer"] / 2 + 0.1
    outer = ring + clamp["wall"]
    saddle = Box(clamp["length"], clamp["width"], clamp["base"], align=_UP)
    along = Pos(-clamp["length"] / 2, 0, outer) * Rot(0, 90, 0)
    saddle += along * Cylinder(outer, clamp["length"], align=_UP)
    saddle -= along * Cylinder(ring, clamp["length"], align=_UP)
    for x in (-9.0, 9.0):
        for y in (-13.0, 13.0):
            saddle -= Pos(x, y, -1) * Cylinder(clamp["hole"] / 2, 9.0, align=_UP)
    bore = pitot["tube"] / 2 + 0.1
    holder = Cylinder(outer, pitot["length"])
    holder += Pos(pitot["offset"], 0, 0) * Cylinder(bore + pitot["wall"], pitot["length"])
    holder += Pos(pitot["offset"] / 2, 0, 0) * Box(pitot["offset"], 6.0, pitot["length"])
    holder -= Cylinder(ring, pitot["length"])
    holder -= Pos(pitot["offset"], 0, 0) * Cylinder(bore, pitot["length"])
    return [
        Body("boom", tube, "carbon", 5, group="mount"),
        Body("boom clamp", saddle, "petg", 10, group="mount"),
        Body("pitot holder", holder, "petg", 1, group="mount"),
        Body("pot arm", _lever(pot, shaped=True), "petg", 4, group="mount"),
        Body("surface horn", _lever(pot, shaped=False), "petg", 4, group="mount"),
    ]


def _lever(pot: dict[str, float], *, shaped: bool) -> Part:
    half, thick = pot["width"] / 2, pot["thickness"]
    body = Cylinder(half, thick) + Pos(pot["arm"], 0, 0) * Cylinder(half, thick)
    body += Pos(pot["arm"] / 2, 0, 0) * Box(pot["arm"], pot["width"], thick)
    body -= Pos(pot["arm"], 0, 0) * Cylinder(pot["pin"] / 2, thick)
    if not shaped:  # a foot to glue to the surface
        foot = Pos(0, 0, thick / 2) * Box(3 * pot["width"], pot["width"], 2.0)
        return body + foot
    shaft = Cylinder(pot["shaft"] / 2 + 0.05, thick)
    return body - (shaft - Pos(pot["flat"] + 5.0, 0, 0) * Box(10.0, 10.0, thick))


def jigs(sizes: Sizes) -> list[Body]:
    """Return protractor jig with its fork, and throw gauge: teeth at known angles."""
    gauge = sizes["gauge"]
    hinge, reach = gauge["hinge"], gauge["reach_deg"]
    arc = Cylinder(hinge + gauge["width"], gauge["thickness"]) - Cylinder(hinge, gauge["thickness"])
    arc -= Pos(-3 * hinge + 20.0, 0, 0) * Box(6 * hinge, 6 * hinge, gauge["thickness"])
    for sign in (-1, 1):
        edge = Rot(0, 0, sign * (reach + 5)) * Pos(0, sign * 2 * hinge, 0)
        arc -= edge * Box(8 * hinge, 4 * hinge, gauge["thickness"])
    arc -= _slots(hinge + 3.0, reach, 10.0, (6.0, 0.8, gauge["thickness"]))
    return [
        Body("protractor jig", _protractor(sizes), "petg", 1, group="jig"),
        Body("protractor fork", _fork(sizes), "petg", 1, group="jig"),
        Body("throw gauge", arc, "petg", 1, group="jig"),
    ]


def _plate_top(sizes: Sizes) -> float:
    return -sizes["fin"]["span"] / 2 - sizes["protractor"]["below_fin"]


def boom_z(sizes: Sizes) -> float:
    """Return z of the boom's axis, which lies along x."""
    sensor = sizes["sensor"]
    chip_top = magnet_face(sizes) - sizes["magnet"]["air_gap"]
    floor = chip_top - sensor["chip"] - sensor["thickness"]
    return floor + sizes["housing"]["socket_outer"] / 2


def _protractor(sizes: Sizes) -> Part:
    # Stands where it is used: on the boom of a vane, below its fin.
    jig, boom, housing = sizes["protractor"], sizes["boom"], sizes["housing"]
    radius, thick, top = jig["radius"], jig["thickness"], _plate_top(sizes)
    middle, axis = top - thick / 2, boom_z(sizes)
    plate = Cylinder(radius, thick) - Cylinder(sizes["hub"]["tab_outer"] + 4.0, thick)
    plate -= Pos(-radius * 0.2, 0, 0) * Box(
        2 * radius, 3 * radius, thick, align=(Align.MAX, *_REAR[1:])
    )
    for sign in (-1, 1):
        edge = Rot(0, 0, sign * (jig["reach_deg"] + 6)) * Pos(0, sign * radius, 0)
        plate -= edge * Box(4 * radius, 2 * radius, thick)
    wide = jig["fork_gap"] + 2 * jig["fork_prong"] + 0.1
    slot = (2 * jig["slot"], wide, thick)
    plate -= _slots(radius, jig["reach_deg"], jig["step_deg"], slot)
    # The boom's socket stands higher than the plate.
    reach = housing["side"] / 2 + housing["socket_length"] + 1.0
    plate -= Box(2 * reach, housing["socket_outer"] + 0.6, thick)
    body = Pos(0, 0, middle) * plate
    low = axis - 3.0
    foot = Pos(reach + 10.0, 0, low) * Box(
        18.0, boom["outer"] + 8.0, top - low, align=(Align.CENTER, Align.CENTER, Align.MIN)
    )
    clip = Pos(0, 0, axis) * Rot(0, 90, 0) * Cylinder(boom["outer"] / 2 + 0.15, 4 * radius)
    return body + foot - clip


def _fork(sizes: Sizes) -> Part:
    # In the slot at neutral: its tongue in the plate, a prong on each side of the fin.
    jig = sizes["protractor"]
    wide = jig["fork_gap"] + 2 * jig["fork_prong"]
    inner, top = jig["radius"] - jig["slot"] + 0.2, _plate_top(sizes)
    tongue = Pos(inner, 0, top - jig["fork_thick"]) * Box(
        jig["fork_long"], wide, jig["fork_thick"], align=(Align.MIN, Align.CENTER, Align.MIN)
    )
    prongs = Pos(inner, 0, top) * Box(
        jig["slot"], wide, jig["fork_high"], align=(Align.MIN, Align.CENTER, Align.MIN)
    )
    return (
        tongue
        + prongs
        - Pos(0, 0, top) * Box(4 * jig["radius"], jig["fork_gap"], jig["fork_high"], align=_UP)
    )


def _slots(
    radius: float, reach_deg: float, step_deg: float, size: tuple[float, float, float]
) -> Part:
    count = round(reach_deg // step_deg)
    cuts = Part()
    for k in range(-count, count + 1):
        cuts += Rot(0, 0, k * step_deg) * Pos(radius, 0, 0) * Box(*size)
    return cuts


def cases(sizes: Sizes) -> list[Body]:
    """Return box, its lid, and the IMU's tray; the box stands around the Mega's corner."""
    tray = sizes["imu_tray"]
    long, wide, base, rim = tray["length"], tray["width"], tray["base"], tray["rim"]
    plate = Box(long, wide, base + rim, align=_UP)
    plate -= Pos(0, 0, base) * Box(long - 4, wide - 4, rim, align=_UP)
    return [
        Body("box", _box(sizes), "petg", 1, group="case"),
        Body("box lid", _box_lid(sizes), "petg", 1, group="case"),
        Body("IMU tray", plate, "petg", 1, group="case"),
    ]


def mega_holes() -> list[tuple[float, float]]:
    """Return the four outer holes of the Mega, from its lower left corner."""
    text = (SIZES_PATH.parent / "components.toml").read_text(encoding="utf-8")
    holes = tomllib.loads(text)["mega"]["holes"]
    return [(x, y) for x, y in holes if not 60.0 < x < 70.0]


def _box(sizes: Sizes) -> Part:
    # Inner corner at zero, then moved so that the Mega's corner is.
    box = sizes["box"]
    wall, x, y, height = box["wall"], box["inner_x"], box["inner_y"], box["height"]
    low = (Align.MIN, Align.MIN, Align.MIN)
    body = Pos(-wall, -wall, -wall) * Box(x + 2 * wall, y + 2 * wall, height + wall, align=low)
    body -= Box(x, y, height, align=low)
    count = round(box["glands"])
    for k in range(count):
        place = x / 2 + (k - (count - 1) / 2) * 30.0
        hole = Pos(place, -3 * wall, box["gland_z"]) * Rot(-90, 0, 0)
        body -= hole * Cylinder(box["gland"] / 2, 6 * wall, align=_UP)
    body -= Pos(
        -2 * wall,
        box["mega_y"] + box["usb_y"],
        box["boss"] + 1.6 + box["usb_z"],
    ) * Box(4 * wall, box["usb_wide"], box["usb_high"])
    slot = Box(box["servo_slot"], 4 * wall, 2 * box["servo_slot_deep"])
    body -= Pos(x / 2, y, height) * slot
    for hole_x, hole_y in mega_holes():
        at = Pos(box["mega_x"] + hole_x, box["mega_y"] + hole_y, 0)
        body += at * Cylinder(box["boss_diameter"] / 2, box["boss"], align=_UP)
        body -= at * Cylinder(box["boss_hole"] / 2, box["boss"], align=_UP)
    return Pos(*_mega_corner(sizes)) * body


def _mega_corner(sizes: Sizes) -> tuple[float, float, float]:
    # z is zero on the upper face of the Mega's board, 1.6 mm thick.
    box = sizes["box"]
    return -box["mega_x"], -box["mega_y"], -box["boss"] - 1.6


def _box_lid(sizes: Sizes) -> Part:
    box = sizes["box"]
    wall, x, y = box["wall"], box["inner_x"], box["inner_y"]
    lid = Pos(x / 2, y / 2, 0) * Box(x + 2 * wall, y + 2 * wall, wall, align=_UP)
    rim = Box(x - 0.4, y - 0.4, 2.0, align=_UP) - Box(x - 4, y - 4, 2.0, align=_UP)
    lid += Pos(x / 2, y / 2, -2.0) * rim
    lid -= Pos(20.0, 20.0, 0) * Cylinder(box["button"] / 2, wall, align=_UP)
    lid -= Pos(35.0, 20.0, 0) * Cylinder(box["led"] / 2, wall, align=_UP)
    left, front, floor = _mega_corner(sizes)
    return Pos(left, front, floor + box["height"]) * lid


def everything(sizes: Sizes) -> list[Body]:
    """Return every body of one logger."""
    return vane(sizes) + mounts(sizes) + jigs(sizes) + cases(sizes)

"""What stands beside each drawing's views: the sizes of vane.toml that make the part."""

from __future__ import annotations

from collections.abc import Mapping

import solids

# The table of vane.toml that a part follows, where it is called otherwise.
_TABLES: Mapping[str, str] = {
    "magnet holder": "magnet",
    "boom clamp": "clamp",
    "pitot holder": "pitot",
    "pot arm": "pot",
    "surface horn": "pot",
    "protractor jig": "protractor",
    "protractor fork": "protractor",
    "throw gauge": "gauge",
    "IMU tray": "imu_tray",
}


def rows(body: solids.Body, sizes: solids.Sizes) -> list[tuple[str, str]]:
    """Return what is measured and its size, in mm or as named.

    Parameters
    ----------
    body
        The part.
    sizes
        vane.toml.
    """
    own = sizes.get(_TABLES.get(body.name, body.name), {})
    return [(what.replace("_", " "), f"{value:g}") for what, value in own.items()] + [
        (what, size) for what, size in _also(sizes).get(body.name, ())
    ]


def _also(sizes: solids.Sizes) -> dict[str, list[tuple[str, str]]]:
    # Holes and places that follow from another part.
    arm, shaft, box = sizes["arm"]["diameter"], sizes["shaft"], sizes["box"]
    holes = [
        (f"boss at x {box['mega_x'] + x:g}", f"y {box['mega_y'] + y:g}")
        for x, y in solids.mega_holes()
    ]
    return {
        "fin": [("slot, wide, in the middle of the span", f"{arm:g}")],
        "counterweight": [("bore", f"{arm:g}"), ("balance by its length", "drawn above")],
        "shaft": [
            (f"hole across, {shaft['top']:g} below the upper end", f"{arm:g}"),
            ("length", f"{shaft['top'] - shaft['bottom']:g}"),
        ],
        "hub": [("bore", f"{shaft['diameter']:g}"), ("hole across, half height", f"{arm:g}")],
        "box": [("glands apart", "30"), ("from the inner corner:", ""), *holes],
        "lid": [("plug's opening at x", f"{sizes['sensor']['plug_x']:g}")],
    }
